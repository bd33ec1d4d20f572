#include "common/svg/svg.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace gapfarm {
namespace {

// Two decimals of a pixel, without the locale's comma.
std::string number(double value) {
  if (!std::isfinite(value)) value = 0;
  char text[48];
  const auto end = std::to_chars(text, text + sizeof text, std::clamp(value, -1e6, 1e6),
                                 std::chars_format::fixed, 2);
  std::string result(text, end.ptr);
  while (result.back() == '0') result.pop_back();
  if (result.back() == '.') result.pop_back();
  return result == "-0" ? "0" : result;
}

std::string attribute(const char* name, double value) {
  return " " + std::string(name) + "=\"" + number(value) + "\"";
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        // XML has no control characters.
        result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return result;
}

std::string styled(const SvgStyle& style) {
  std::string text = " fill=\"" + style.fill + "\"";
  if (style.stroke != "none") {
    text += " stroke=\"" + style.stroke + "\"" + attribute("stroke-width", style.stroke_width);
  }
  if (!style.dash.empty()) text += " stroke-dasharray=\"" + style.dash + "\"";
  if (style.opacity != 1) text += attribute("opacity", style.opacity);
  return text;
}

}  // namespace

Svg::Svg(double width, double height) : width_(width), height_(height) {}

void Svg::line(SvgPoint from, SvgPoint to, const SvgStyle& style) {
  body_ += "<line" + attribute("x1", from.x) + attribute("y1", from.y) + attribute("x2", to.x) +
           attribute("y2", to.y) + styled(style) + "/>\n";
}

void Svg::polyline(const std::vector<SvgPoint>& points, const SvgStyle& style, bool closed) {
  body_ += closed ? "<polygon points=\"" : "<polyline points=\"";
  for (const SvgPoint& point : points) body_ += number(point.x) + "," + number(point.y) + " ";
  if (!points.empty()) body_.pop_back();
  body_ += "\"" + styled(style) + "/>\n";
}

void Svg::circle(SvgPoint centre, double radius, const SvgStyle& style) {
  body_ += "<circle" + attribute("cx", centre.x) + attribute("cy", centre.y) +
           attribute("r", radius) + styled(style) + "/>\n";
}

void Svg::text(SvgPoint place, std::string_view content, const SvgText& how) {
  body_ += "<text" + attribute("x", place.x) + attribute("y", place.y) +
           attribute("font-size", how.size) + " fill=\"" + how.colour + "\"";
  if (how.anchor == SvgAnchor::kMiddle) body_ += " text-anchor=\"middle\"";
  if (how.anchor == SvgAnchor::kEnd) body_ += " text-anchor=\"end\"";
  if (how.bold) body_ += " font-weight=\"600\"";
  if (how.rotation_deg != 0) {
    body_ += " transform=\"rotate(" + number(how.rotation_deg) + " " + number(place.x) + " " +
             number(place.y) + ")\"";
  }
  body_ += ">" + escaped(content) + "</text>\n";
}

void Svg::begin_clip(SvgPoint corner, double width, double height) {
  const std::string id = "clip" + std::to_string(clips_++);
  body_ += "<clipPath id=\"" + id + "\"><rect" + attribute("x", corner.x) +
           attribute("y", corner.y) + attribute("width", width) + attribute("height", height) +
           "/></clipPath>\n<g clip-path=\"url(#" + id + ")\">\n";
}

void Svg::begin_part(SvgPoint corner) {
  body_ += "<g transform=\"translate(" + number(corner.x) + " " + number(corner.y) + ")\">\n";
}

void Svg::end_part() { body_ += "</g>\n"; }

std::string Svg::finish() const {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\"" + attribute("width", width_) +
         attribute("height", height_) + " viewBox=\"0 0 " + number(width_) + " " + number(height_) +
         "\" font-family=\"'Source Sans 3', 'Helvetica Neue', Arial, 'DejaVu Sans', "
         "sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n" +
         body_ + "</svg>\n";
}

std::vector<double> axis_ticks(double low, double high, unsigned wanted) {
  std::vector<double> ticks;
  if (!(high > low) || wanted == 0) return ticks;
  const double raw = (high - low) / wanted;
  const double power = std::pow(10, std::floor(std::log10(raw)));
  double step = power;
  for (const double factor : {2.0, 5.0, 10.0}) {
    const double candidate = factor * power;
    if (std::abs(std::log(raw / candidate)) < std::abs(std::log(raw / step))) step = candidate;
  }
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) {
    ticks.push_back(k == 0 ? 0.0 : k * step);
  }
  return ticks;
}

std::string tick_label(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  char text[48];
  const bool huge = std::abs(value) >= 1e6;
  const auto end =
      huge ? std::to_chars(text, text + sizeof text, value)
           : std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, decimals);
  std::string result(text, end.ptr);
  // A true minus sign is as wide as a plus and does not look like a hyphen.
  if (std::abs(value) < step * 1e-6) return "0";
  if (result.front() == '-') result = "\u2212" + result.substr(1);
  return result;
}

}  // namespace gapfarm
