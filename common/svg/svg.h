// A small SVG writer.  Lengths are pixels from the top left; y grows downwards.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gapfarm {

struct SvgPoint {
  double x = 0;
  double y = 0;
};

// How a shape is drawn; "none" leaves fill or stroke out.
struct SvgStyle {
  std::string fill = "none";
  std::string stroke = "none";
  double stroke_width = 1;
  std::string dash = {};  // "6 4"; empty: solid
  double opacity = 1;
};

enum class SvgAnchor { kStart, kMiddle, kEnd };

struct SvgText {
  double size = 12;
  std::string colour = "#222222";
  SvgAnchor anchor = SvgAnchor::kStart;
  bool bold = false;
  double rotation_deg = 0;  // clockwise around the text's place
};

class Svg {
 public:
  Svg(double width, double height);

  void line(SvgPoint from, SvgPoint to, const SvgStyle& style);
  void polyline(const std::vector<SvgPoint>& points, const SvgStyle& style, bool closed = false);
  void circle(SvgPoint centre, double radius, const SvgStyle& style);
  void text(SvgPoint place, std::string_view content, const SvgText& how);
  // What comes before the next end_part() is cut at the rectangle.
  void begin_clip(SvgPoint corner, double width, double height);
  // What comes before the next end_part() counts from this corner.
  void begin_part(SvgPoint corner);
  void end_part();

  // The whole document, on a white ground.
  std::string finish() const;

 private:
  double width_, height_;
  unsigned clips_ = 0;
  std::string body_;
};

// About `wanted` round numbers (1, 2 or 5 times a power of ten apart) within [low, high].
std::vector<double> axis_ticks(double low, double high, unsigned wanted);

// "250", "0.5", "-1e+06": no more digits than ticks `step` apart need.
std::string tick_label(double value, double step);

}  // namespace gapfarm
