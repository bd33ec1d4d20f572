// What follows from a robot's drive and the sizes that its file states.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/robot/robot.h"

namespace gapfarm {
namespace {

using std::numbers::pi;

// A skid-steer of which nothing but the gauge is known is taken for as long as it is wide.
constexpr double kSquare = 1;
constexpr double kWheelPerGauge = 0.3;   // radius over separation, where nobody states a radius
constexpr double kHeightPerGauge = 0.2;  // centre of mass over the floor
constexpr double kMass_kg = 10;          // hardly matters to Coulomb friction
constexpr double kTrackPerBase = 0.6;    // of a car

std::string digits4(double value) { return formatted("%.4g", value); }

class Completion {
 public:
  explicit Completion(GroundRobot* robot) : r_(*robot) {}

  Status run() {
    RETURN_IF_ERROR(wheels());
    RETURN_IF_ERROR(sizes());
    RETURN_IF_ERROR(full_speed());
    complete_controller(r_);
    return check_robot(r_);
  }

 private:
  void assume(const std::string& sentence) { r_.notes.push_back("assumed: " + sentence); }

  Error missing(const std::string& what) const {
    return Error{"a robot of drive \"" + drive_names()[static_cast<std::size_t>(r_.drive)] +
                 "\" needs " + what};
  }

  RobotWheel* find(std::string_view name) { return const_cast<RobotWheel*>(r_.wheel(name)); }

  // The wheel of this name, made like this when the file has none.
  RobotWheel& ensure(const std::string& name, bool driven = true, bool steered = false) {
    if (RobotWheel* w = find(name)) return *w;
    RobotWheel& made = r_.wheels.emplace_back();
    made.name = name;
    made.driven = driven;
    made.steered = steered;
    return made;
  }

  static void place(RobotWheel& wheel, double x_m, double y_m) {
    if (!wheel.x_m) wheel.x_m = x_m;
    if (!wheel.y_m) wheel.y_m = y_m;
  }

  // So far to either side.
  void pair(const std::string& name, double x_m, double y_m, bool driven = true,
            bool steered = false) {
    place(ensure(name + "left", driven, steered), x_m, y_m);
    place(ensure(name + "right", driven, steered), x_m, -y_m);
  }

  // Wheels of these names of which the file says no place stand for the sides of a robot.
  bool states_sides() const {
    return std::ranges::all_of(r_.wheels, [](const RobotWheel& w) {
      return !w.driven || ((w.name == "left" || w.name == "right") && !w.x_m);
    });
  }

  std::optional<double> separation() {
    std::optional<double>& stated = r_.controller.wheel_separation_m;
    if (stated) return stated;
    double left = 0, right = 0;
    for (const RobotWheel& w : r_.wheels) {
      if (!w.y_m || !w.driven) continue;
      left = std::max(left, *w.y_m);
      right = std::min(right, *w.y_m);
    }
    if (left > right) stated = left - right;
    return stated;
  }

  Status wheels() {
    for (RobotWheel& w : r_.wheels) {
      if (w.kind == WheelKind::kCaster) w.driven = false;
    }
    for (const RobotWheel& w : r_.wheels) {
      if (!w.steered || !w.x_m || *w.x_m >= 0) continue;
      return Error{"wheel " + w.name + " is steered and stands behind the axle that is not (x " +
                   digits4(*w.x_m) +
                   " m), expected one ahead of it; turn the frame round, x towards the steered "
                   "wheel, and negate the commanded speeds"};
    }
    static constexpr Status (Completion::*kOfDrive[])() = {
        &Completion::differential, &Completion::skid,      &Completion::tracked, &Completion::omni,
        &Completion::mecanum,      &Completion::ackermann, &Completion::tricycle};
    return (this->*kOfDrive[static_cast<std::size_t>(r_.drive)])();
  }

  Status need_separation() {
    const auto gauge = separation();
    if (!gauge) return missing("wheel_separation in m, or the wheels' y");
    if (*gauge > 0) return {};
    return Error{"wheel_separation is " + digits4(*gauge) + " m, expected more than 0"};
  }

  void sides() {
    for (RobotWheel& w : r_.wheels) {
      if (w.side != WheelSide::kNone || !w.driven || !w.y_m || *w.y_m == 0) continue;
      w.side = *w.y_m > 0 ? WheelSide::kLeft : WheelSide::kRight;
    }
  }

  // Wheels that stand on no more than a line would let the robot fall over.
  void prop(double reach_m) {
    double front = -1e9, rear = 1e9;
    for (const RobotWheel& w : r_.wheels) {
      front = std::max(front, w.x_m.value_or(0));
      rear = std::min(rear, w.x_m.value_or(0));
    }
    const double middle = r_.com_x_m.value_or(0);
    const bool ahead = front < middle + 0.05 * reach_m;
    const bool behind = rear > middle - 0.05 * reach_m;
    if (!ahead && !behind) return;
    for (const double side : {1.0, -1.0}) {
      if (!(side > 0 ? ahead : behind)) continue;
      RobotWheel caster;
      caster.name = side > 0 ? "caster_front" : "caster_rear";
      caster.kind = WheelKind::kCaster;
      caster.driven = false;
      caster.x_m = middle + side * reach_m;
      caster.y_m = 0;
      caster.radius_m = 0.1 * reach_m;
      r_.wheels.push_back(caster);
      assume("a caster without drag at x = " + digits4(*caster.x_m) + " m (" + caster.name + ")");
    }
  }

  Status differential() {
    RETURN_IF_ERROR(need_separation());
    const double half = *separation() / 2;
    if (states_sides()) pair("", 0, half);
    sides();
    prop(half);
    return {};
  }

  // Contacts of four-point Coulomb theory at +-b along and +-c across, with friction across the
  // wheels r times that along, turn as if they stood 1 + (r b / c)^2 times as wide apart.
  double half_base(double half_gauge) {
    if (r_.controller.wheelbase_m) return *r_.controller.wheelbase_m / 2;
    const double multiplier = r_.controller.wheel_separation_multiplier;
    double ratio = kSquare;
    if (multiplier > 1.01) {
      ratio = std::sqrt(multiplier - 1) / r_.friction_ratio;
      assume("the axles " + digits4(2 * half_gauge * ratio) +
             " m apart, which makes a skid turn as wide as wheel_separation_multiplier " +
             digits4(multiplier) + " says");
    } else {
      assume("the axles as far apart as the wheels: " + digits4(2 * half_gauge) + " m");
    }
    r_.controller.wheelbase_m = 2 * half_gauge * ratio;
    return half_gauge * ratio;
  }

  Status skid() {
    RETURN_IF_ERROR(need_separation());
    if (states_sides()) {
      const double c = *separation() / 2;
      const double b = half_base(c);
      const RobotWheel left = ensure("left");
      const RobotWheel right = ensure("right");
      r_.wheels.clear();
      for (const double x : {b, -b}) {
        for (const RobotWheel* side : {&left, &right}) {
          RobotWheel wheel = *side;
          wheel.name = (x > 0 ? "front_" : "rear_") + side->name;
          wheel.group = side->name;
          wheel.side = side == &left ? WheelSide::kLeft : WheelSide::kRight;
          wheel.x_m = x;
          wheel.y_m = side == &left ? c : -c;
          r_.wheels.push_back(wheel);
        }
      }
    }
    sides();
    return {};
  }

  Status tracked() {
    RETURN_IF_ERROR(need_separation());
    const double c = *separation() / 2;
    pair("", 0, c);
    for (const char* name : {"left", "right"}) {
      RobotWheel& tread = *find(name);
      tread.kind = WheelKind::kTread;
      if (!tread.contact_length_m) tread.contact_length_m = 2 * half_base(c);
    }
    sides();
    return {};
  }

  bool places_wheels() const {
    return std::ranges::any_of(r_.wheels, [](const RobotWheel& w) { return w.x_m && w.driven; });
  }

  Status omni() {
    if (!places_wheels()) {
      const auto radius = r_.controller.robot_radius_m;
      if (!radius) return missing("robot_radius in m, or the wheels' x, y and heading");
      std::vector<std::string> names = mapped(r_.wheels, &RobotWheel::name);
      if (names.empty() && r_.command == CommandKind::kTwist) {
        names = {"wheel_1", "wheel_2", "wheel_3"};
        assume("three wheels");
      }
      if (names.empty()) names = r_.channels;
      if (names.size() < 3) return missing("three or more wheels, or as many channels");
      const double n = static_cast<double>(names.size());
      for (std::size_t i = 0; i < names.size(); ++i) {
        const double at = r_.controller.wheel_offset_rad + 2 * pi * static_cast<double>(i) / n;
        RobotWheel& w = ensure(names[i]);
        place(w, *radius * std::cos(at), *radius * std::sin(at));
        w.heading_rad = wrap_angle(at + pi / 2);
      }
    }
    for (RobotWheel& w : r_.wheels) {
      if (w.driven) w.kind = WheelKind::kOmni;
    }
    return {};
  }

  Status mecanum() {
    const auto& k = r_.controller;
    if (!places_wheels()) {
      double lx = 0, ly = 0;
      if (k.wheelbase_m && k.wheel_separation_m) {
        lx = *k.wheelbase_m / 2;
        ly = *k.wheel_separation_m / 2;
      } else if (k.sum_of_robot_center_projection_m) {
        lx = ly = *k.sum_of_robot_center_projection_m / 2;
        assume("wheels as far apart along as across: only lx + ly is stated");
      } else {
        return missing("wheelbase and wheel_separation, or sum_of_robot_center_projection, in m");
      }
      pair("front_", lx, ly);
      pair("rear_", -lx, ly);
    }
    for (RobotWheel& w : r_.wheels) {
      if (!w.driven) continue;
      w.kind = WheelKind::kMecanum;
      const bool as_usual = w.roller_angle_rad == 0 && w.x_m && w.y_m;
      if (as_usual) w.roller_angle_rad = *w.x_m * *w.y_m > 0 ? -pi / 4 : pi / 4;
    }
    return {};
  }

  // How far the wheels of the unsteered axle stand apart, by their places; 0: no two are placed.
  double placed_track() const {
    double left = 0, right = 0;
    for (const RobotWheel& w : r_.wheels) {
      if (w.steered || !w.x_m || !w.y_m || w.kind == WheelKind::kCaster) continue;
      left = std::max(left, *w.y_m);
      right = std::min(right, *w.y_m);
    }
    return left > 0 && right < 0 ? left - right : 0;
  }

  // Of the unsteered axle: stated, or assumed from the wheelbase, which is.
  double stated_track() {
    auto& k = r_.controller;
    if (!k.traction_track_width_m) k.traction_track_width_m = k.wheel_separation_m;
    if (const double placed = placed_track(); placed > 0 && !k.traction_track_width_m) {
      k.traction_track_width_m = placed;
    }
    if (!k.traction_track_width_m) {
      k.traction_track_width_m = kTrackPerBase * *k.wheelbase_m;
      assume("a track of " + digits4(*k.traction_track_width_m) + " m");
    }
    return *k.traction_track_width_m;
  }

  Status ackermann() {
    auto& k = r_.controller;
    if (!k.wheelbase_m) return missing("wheelbase in m");
    const double track = stated_track();
    const double front = k.steering_track_width_m.value_or(track);
    pair("front_", *k.wheelbase_m, front / 2, /*driven=*/false, /*steered=*/true);
    pair("rear_", 0, track / 2);
    return {};
  }

  Status tricycle() {
    auto& k = r_.controller;
    if (!k.wheelbase_m) return missing("wheelbase in m");
    const double track = stated_track();
    if (find("front") == nullptr) {
      assume("the front wheel drives (where the others do, give all three in [wheels.NAME])");
    }
    place(ensure("front", true, /*steered=*/true), *k.wheelbase_m, 0);
    if (placed_track() == 0) pair("rear_", 0, track / 2, /*driven=*/false);
    return {};
  }

  // Where the wheels share the load alike.  A car's or a tricycle's frame begins at its rear axle,
  // over which its mass would not stand.
  double middle(std::optional<double> RobotWheel::*at) const {
    if (r_.drive == DriveKind::kDifferential) return 0;
    double sum = 0, count = 0;
    for (const RobotWheel& w : r_.wheels) {
      if (w.kind == WheelKind::kCaster) continue;
      sum += (w.*at).value_or(0);
      count += 1;
    }
    return sum / std::max(count, 1.0);
  }

  Status sizes() {
    // Sizes that nobody states are shares of how far the farthest wheel stands out.
    const double reach = wheel_reach_m(r_), across = 2 * reach;
    if (!(across > 0)) return Error{"every wheel stands at the origin; state x and y in m"};
    bool assumed = false;
    for (RobotWheel& w : r_.wheels) {
      if (w.group.empty()) w.group = w.name;
      if (!w.x_m || !w.y_m) return Error{"wheel \"" + w.name + "\" needs x and y in m"};
      if (w.radius_m) continue;
      if (r_.controller.wheel_radius_m) {
        w.radius_m = r_.controller.wheel_radius_m;
      } else if (w.driven && r_.command == CommandKind::kWheelSpeeds) {
        return Error{"wheel \"" + w.name + "\" needs a radius in m: its commands are in rad/s"};
      } else {
        w.radius_m = kWheelPerGauge * across / 2;
        assumed = assumed || w.driven;
      }
    }
    if (assumed) assume("wheel radii of " + digits4(kWheelPerGauge * across / 2) + " m");
    if (!r_.mass_kg) {
      r_.mass_kg = kMass_kg;
      assume("a mass of " + digits4(kMass_kg) + " kg");
    }
    if (!r_.com_x_m) r_.com_x_m = middle(&RobotWheel::x_m);
    if (!r_.com_y_m) r_.com_y_m = middle(&RobotWheel::y_m);
    if (!r_.com_z_m) {
      r_.com_z_m = kHeightPerGauge * across;
      assume("the centre of mass " + digits4(*r_.com_z_m) + " m over the floor");
    }
    if (!r_.yaw_inertia_kg_m2 && r_.body_length_m && r_.body_width_m) {
      r_.yaw_inertia_kg_m2 = box_yaw_inertia(*r_.mass_kg, *r_.body_length_m, *r_.body_width_m);
    }
    if (!r_.yaw_inertia_kg_m2) {
      // A plate of the wheels' circle, of even mass.
      r_.yaw_inertia_kg_m2 = *r_.mass_kg * reach * reach / 2;
      assume("a yaw inertia of " + digits4(*r_.yaw_inertia_kg_m2) + " kg m^2");
    }
    return {};
  }

  Status full_speed() {
    RobotMotors& m = r_.motors;
    if (!m.full_surface_speed_m_s) return {};
    if (m.full_speed_rad_s) {
      return Error{"full_speed (rad/s) and full_surface_speed (m/s) say the same; state one"};
    }
    if (const RobotWheel* any = driven_wheel(r_)) {
      m.full_speed_rad_s = *m.full_surface_speed_m_s / *any->radius_m;
    }
    m.full_surface_speed_m_s.reset();
    return {};
  }

  GroundRobot& r_;
};

}  // namespace

Status complete_robot(GroundRobot* robot) { return Completion(robot).run(); }

}  // namespace gapfarm
