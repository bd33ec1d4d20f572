#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/svg/svg.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {
namespace {

constexpr double kDrawing_px = 560;  // the longer side of the robot's frame
constexpr double kMargin_px = 90;
constexpr double kHead_px = 56;
constexpr double kFoot_px = 96;
const std::string kInk = "#222222";
const std::string kFaint = "#6b7280";
const std::string kDriven = "#1f5fa8";
const std::string kFree = "#8a94a3";
const std::string kSteered = "#b45309";
const std::string kMass = "#b91c1c";

// x ahead is up, y left is left, as one looks down on the robot.
class Picture {
 public:
  Picture(const RobotReading& reading, const GroundRobot& robot) : reading_(reading), r_(robot) {
    if (reading.robot.mass_kg) loads_ = standing_loads(robot);
    cover({r_.com_x_m.value_or(0), r_.com_y_m.value_or(0)});
    for (const RobotWheel& wheel : r_.wheels) {
      const double reach = radius(wheel) + 0.5 * width(wheel);
      cover({*wheel.x_m + reach, *wheel.y_m + reach});
      cover({*wheel.x_m - reach, *wheel.y_m - reach});
    }
    for (const RobotOutline& outline : reading_.outlines) {
      for (const Eigen::Vector2d& corner : outline.corners_R_m) cover(corner);
    }
    const Eigen::Vector2d size = high_ - low_;
    scale_ = kDrawing_px / std::max({size.x(), size.y(), 1e-3});
    width_ = std::max(size.y() * scale_, 300.0) + 2 * kMargin_px;
    height_ = size.x() * scale_ + kHead_px + kFoot_px + 2 * 24;
  }

  std::string draw() {
    Svg svg(width_, height_);
    heading(svg);
    for (const RobotOutline& outline : reading_.outlines) {
      const auto corner = [this](const Eigen::Vector2d& p_R) { return at(p_R); };
      svg.polyline(mapped(outline.corners_R_m, corner), {"#e5e7eb", "#c3c8d0", 1, {}, 0.5}, true);
    }
    axles(svg);
    for (const RobotWheel& wheel : r_.wheels) draw_wheel(svg, wheel);
    for (const RobotWheel& wheel : r_.wheels) label(svg, wheel);
    frame(svg);
    mass(svg);
    legend(svg);
    return svg.finish();
  }

 private:
  double radius(const RobotWheel& wheel) const { return wheel.radius_m.value_or(0.02); }
  double width(const RobotWheel& wheel) const {
    return wheel.width_m.value_or(0.4 * radius(wheel));
  }

  void cover(const Eigen::Vector2d& p) {
    low_ = low_.cwiseMin(p);
    high_ = high_.cwiseMax(p);
  }

  SvgPoint at(const Eigen::Vector2d& p_R) const {
    const double middle = 0.5 * (low_.y() + high_.y());
    return {0.5 * width_ - (p_R.y() - middle) * scale_,
            kHead_px + 24 + (high_.x() - p_R.x()) * scale_};
  }

  void heading(Svg& svg) const {
    const std::string name = r_.name.empty() ? "robot" : r_.name;
    svg.text({16, 24}, name, {16, kInk, SvgAnchor::kStart, true});
    std::string line = "drive " + drive_names()[static_cast<std::size_t>(r_.drive)] +
                       ", seen from above, ahead is up";
    if (reading_.robot.mass_kg) line += formatted("; %.4g kg", *reading_.robot.mass_kg);
    svg.text({16, 44}, line, {12, kFaint});
  }

  std::string colour(const RobotWheel& wheel) const {
    if (wheel.kind == WheelKind::kCaster) return kFree;
    if (wheel.steered) return kSteered;
    return wheel.driven ? kDriven : kFree;
  }

  // A line between wheels that stand opposite each other.
  void axles(Svg& svg) const {
    for (const RobotWheel& a : r_.wheels) {
      for (const RobotWheel& b : r_.wheels) {
        const bool pair = a.kind != WheelKind::kCaster && b.kind == a.kind &&
                          a.kind != WheelKind::kOmni && *a.y_m > 0 && *b.y_m < 0 &&
                          std::abs(*a.x_m - *b.x_m) < 0.02 * (*a.y_m - *b.y_m);
        if (!pair) continue;
        svg.line(at({*a.x_m, *a.y_m}), at({*b.x_m, *b.y_m}), {"none", kInk, 1.5, "6 4", 0.7});
      }
    }
  }

  void draw_wheel(Svg& svg, const RobotWheel& wheel) const {
    const Eigen::Vector2d centre(*wheel.x_m, *wheel.y_m);
    const std::string paint = colour(wheel);
    if (wheel.kind == WheelKind::kCaster) {
      svg.circle(at(centre), std::max(5.0, radius(wheel) * scale_), {paint, kInk, 1, "3 2", 0.55});
      return;
    }
    const double length = wheel.contact_length_m.value_or(2 * radius(wheel));
    const Eigen::Vector2d ahead(std::cos(wheel.heading_rad), std::sin(wheel.heading_rad));
    const Eigen::Vector2d left(-ahead.y(), ahead.x());
    std::vector<SvgPoint> corners;
    for (const auto& [a, b] : {std::pair{1, 1}, {1, -1}, {-1, -1}, {-1, 1}}) {
      corners.push_back(at(centre + 0.5 * a * length * ahead + 0.5 * b * width(wheel) * left));
    }
    svg.polyline(corners, {paint, kInk, 1, {}, 0.8}, true);
    if (wheel.kind == WheelKind::kMecanum) {
      const double angle = wheel.heading_rad + wheel.roller_angle_rad;
      const Eigen::Vector2d roller(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d half = 0.35 * length * roller;
      svg.line(at(centre - half), at(centre + half), {"none", "#ffffff", 2});
    }
  }

  void label(Svg& svg, const RobotWheel& wheel) const {
    const Eigen::Vector2d centre(*wheel.x_m, *wheel.y_m);
    SvgPoint place = at(centre);
    const bool left = *wheel.y_m > 1e-3, right = *wheel.y_m < -1e-3;
    const double beside = 0.5 * width(wheel) * scale_ + 8;
    SvgAnchor anchor = SvgAnchor::kMiddle;
    if (left) {
      place.x -= std::max(beside, 14.0);
      anchor = SvgAnchor::kEnd;
    } else if (right) {
      place.x += std::max(beside, 14.0);
      anchor = SvgAnchor::kStart;
    } else {
      place.y += std::max(radius(wheel) * scale_, 6.0) + 14;
    }
    svg.text(place, wheel.name, {12, kInk, anchor, true});
    std::string line = wheel.radius_m && wheel.kind != WheelKind::kCaster
                           ? formatted("r %.4g mm", *wheel.radius_m * 1e3)
                           : "";
    const auto i = static_cast<std::size_t>(&wheel - r_.wheels.data());
    if (i < loads_.size()) line += (line.empty() ? "" : ", ") + formatted("%.3g N", loads_[i]);
    if (!line.empty()) svg.text({place.x, place.y + 14}, line, {11, kFaint, anchor});
  }

  void frame(Svg& svg) const {
    const double arrow = 46 / scale_;
    const SvgPoint o = at({0, 0}), x = at({arrow, 0}), y = at({0, arrow});
    svg.line(o, x, {"none", kInk, 2});
    svg.line(o, y, {"none", kInk, 2});
    svg.polyline({{x.x - 4, x.y + 7}, x, {x.x + 4, x.y + 7}}, {"none", kInk, 2});
    svg.polyline({{y.x + 7, y.y - 4}, y, {y.x + 7, y.y + 4}}, {"none", kInk, 2});
    svg.text({x.x + 8, x.y + 8}, "x", {12, kInk});
    svg.text({y.x + 2, y.y - 8}, "y", {12, kInk});
  }

  void mass(Svg& svg) const {
    if (!reading_.robot.mass_kg) return;
    const SvgPoint c = at({r_.com_x_m.value_or(0), r_.com_y_m.value_or(0)});
    svg.circle(c, 7, {"#ffffff", kMass, 2});
    svg.line({c.x - 7, c.y}, {c.x + 7, c.y}, {"none", kMass, 2});
    svg.line({c.x, c.y - 7}, {c.x, c.y + 7}, {"none", kMass, 2});
  }

  void legend(Svg& svg) const {
    const double y = height_ - 60;
    double x = 16;
    const auto entry = [&](const std::string& paint, const char* caption, double room) {
      svg.rectangle({x, y - 10}, 12, 12, {paint, kInk, 1, {}, 0.8});
      svg.text({x + 18, y}, caption, {11, kInk});
      x += room;
    };
    entry(kDriven, "driven", 74);
    entry(kSteered, "steered", 80);
    entry(kFree, "free, caster", 104);
    svg.circle({x + 6, y - 4}, 6, {"#ffffff", kMass, 2});
    svg.text({x + 18, y}, "centre of mass", {11, kInk});
    // A scale of a round length that fits.
    const double wanted = 0.3 * kDrawing_px / scale_;
    double length = std::pow(10, std::floor(std::log10(wanted)));
    for (const double times : {5.0, 2.0}) {
      if (length * times <= wanted) {
        length *= times;
        break;
      }
    }
    const double foot = height_ - 28;
    svg.line({16, foot}, {16 + length * scale_, foot}, {"none", kInk, 2});
    svg.line({16, foot - 5}, {16, foot + 5}, {"none", kInk, 2});
    svg.line({16 + length * scale_, foot - 5}, {16 + length * scale_, foot + 5}, {"none", kInk, 2});
    svg.text({24 + length * scale_, foot + 4},
             length >= 1 ? formatted("%.4g m", length) : formatted("%.4g mm", length * 1e3),
             {11, kInk});
  }

  const RobotReading& reading_;
  const GroundRobot& r_;
  std::vector<double> loads_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(1e9);
  Eigen::Vector2d high_ = Eigen::Vector2d::Constant(-1e9);
  double scale_ = 1, width_ = 0, height_ = 0;
};

}  // namespace

std::string draw_robot(const RobotReading& reading, const GroundRobot& completed) {
  return Picture(reading, completed).draw();
}

}  // namespace gapfarm
