#include "common/parameters/tracked.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/base/text.h"
#include "common/parameters/rows.h"
#include "common/parameters/srv1_robot_file.h"

namespace gapfarm {
namespace {

constexpr double kSphereShare = 1.0 / 14;  // radius of a contact's sphere over the contact length
constexpr double kHalfWidthShare = 0.24;   // of a wheel over its radius, where none is stated
// Contacts of the SRV-1 give a little: load sharing among four supports has one answer instead of
// many.
constexpr double kSrv1Softness = 1e-3;
constexpr double kFastest_m_s = 5;  // faster is taken for a simulation that has diverged

// What the table's rows ask of a robot.
struct TreadNumbers {
  double mass_kg = 0, contact_length_m = 0, track_gauge_m = 0, mass_height_m = 0;
  double full_speed_m_s = 0;
  double friction = 0, friction_ratio = 0;
  double wheel_radius_m = 0;

  double reach_m() const { return std::hypot(contact_length_m, track_gauge_m) / 2; }
};

TreadNumbers numbers_of(const GroundRobot& robot) {
  const RobotWheel& left = *robot.wheel("left");
  const RobotWheel& right = *robot.wheel("right");
  return {*robot.mass_kg,
          *left.contact_length_m,
          *left.y_m - *right.y_m,
          *robot.com_z_m,
          *robot.motors.full_speed_rad_s * *left.radius_m,
          robot.friction,
          robot.friction_ratio,
          *left.radius_m};
}

const GroundRobot& srv1_file() {
  static const GroundRobot robot = [] {
    auto read = parse_robot(kSrv1RobotFile, "srv1.toml");
    assert(read.ok() && check_tracked(*read).ok());
    return *std::move(read);
  }();
  return robot;
}

const TreadNumbers& srv1_numbers() {
  static const TreadNumbers numbers = numbers_of(srv1_file());
  return numbers;
}

// Bounds are no measurements.
double three_digits(double value) { return rounded_to_digits(value, 3); }

Parameter scaled(double factor, Parameter row) {
  row.lower = three_digits(row.lower * factor);
  row.upper = three_digits(row.upper * factor);
  row.nominal *= factor;
  return row;
}

// Bounds as they are, but for a robot whose own value lies beyond them.
Parameter holding(Parameter row) {
  row.lower = std::min(row.lower, row.nominal);
  row.upper = std::max(row.upper, row.nominal);
  return row;
}

// Bounds that stand for the SRV-1 are, for another robot, as far from its own values.
std::vector<Parameter> tracked_rows(const TreadNumbers& own) {
  using namespace rows;  // NOLINT: what follows is rows
  const TreadNumbers& srv1 = srv1_numbers();
  const auto size = [&](const char* key, const char* unit, double lower, double upper,
                        double TreadNumbers::*at, const char* summary) {
    Parameter row = scaled(own.*at / srv1.*at, real(key, unit, lower, upper, srv1.*at, summary));
    row.nominal = own.*at;
    row.beyond =
        "beyond, it is another robot: measure a copy of configs/robots/srv1.toml anew, and name it "
        "in [robot] file";
    return row;
  };
  const double wider = std::max(1.0, own.reach_m() / srv1.reach_m());
  const double faster_wheels =
      (own.full_speed_m_s / own.wheel_radius_m) / (srv1.full_speed_m_s / srv1.wheel_radius_m);
  const double stronger = own.mass_kg * own.wheel_radius_m / (srv1.mass_kg * srv1.wheel_radius_m);
#define ROW(name, row) row,
#define SETTING(name, member, row) row,
  return {
#include "common/parameters/srv1_rows.inc"
  };
}

// Lengths of the robot itself grow and shrink with it, those of its floor only grow.
std::vector<Effect> tracked_effects(double scale) {
  const auto catalogue = srv1_effects_and_seconds();
  std::vector<Effect> effects(catalogue.begin(), catalogue.end());
  for (Effect& effect : effects) {
    const double factor = effect.of_the_robot ? scale : std::max(1.0, scale);
    for (Parameter& p : effect.parameters) {
      if (p.unit != "m") continue;
      p.lower = three_digits(p.lower * factor);
      p.upper = three_digits(p.upper * factor);
    }
  }
  return effects;
}

RobotSize size_of(const GroundRobot& robot) {
  const TreadNumbers own = numbers_of(robot);
  const TreadNumbers& srv1 = srv1_numbers();
  RobotSize size;
  size.body_length_m = robot.body_length_m.value_or(own.contact_length_m);
  size.body_width_m = robot.body_width_m.value_or(own.track_gauge_m);
  size.body_height_m = robot.body_height_m.value_or(2 * own.mass_height_m);
  // The yaw inertia has the last word; where it follows from the box it is the box's.
  const double wider =
      std::sqrt(*robot.yaw_inertia_kg_m2 /
                box_yaw_inertia(own.mass_kg, size.body_length_m, size.body_width_m));
  size.body_length_m *= wider;
  size.body_width_m *= wider;
  size.contact_radius_m = own.contact_length_m * kSphereShare;
  size.wheel_radius_m = own.wheel_radius_m;
  const auto& width = robot.wheel("left")->width_m;
  size.wheel_half_width_m =
      width.value_or(0) > 0 ? *width / 2 : kHalfWidthShare * own.wheel_radius_m;
  size.contact_softness = kSrv1Softness * (srv1.mass_kg / own.mass_kg);
  return size;
}

// What the file says that is an effect here, by row; only what is not neutral.
std::vector<std::pair<const char*, double>> stated_effects(const GroundRobot& robot) {
  const std::pair<const char*, double> all[] = {
      {"motor_lag.tau", robot.motors.lag_s},
      {"motor_deadband.duty", robot.motors.dead_band},
      {"rolling_resistance.coefficient", robot.rolling_resistance},
      {"com_offset.x", *robot.com_x_m},
      {"com_offset.y", *robot.com_y_m},
      {"heading_offset.angle", robot.X_RM.theta},
      {"marker_offset.x", robot.X_RM.x},
      {"marker_offset.y", robot.X_RM.y}};
  std::vector<std::pair<const char*, double>> stated;
  for (const auto& [key, value] : all) {
    if (value != 0) stated.emplace_back(key, value);
  }
  return stated;
}

bool alike(double a, double b) { return std::abs(a - b) <= 1e-6 * (std::abs(a) + std::abs(b)); }

Status check_treads(const GroundRobot& robot) {
  const auto treads = std::count_if(robot.wheels.begin(), robot.wheels.end(),
                                    [](const auto& w) { return w.kind == WheelKind::kTread; });
  const RobotWheel& left = *robot.wheel("left");
  const RobotWheel& right = *robot.wheel("right");
  const bool mirrored = alike(*left.y_m, -*right.y_m) && *left.y_m > 0 &&
                        std::abs(*left.x_m) + std::abs(*right.x_m) <= 1e-6 * *left.y_m;
  const bool same = alike(*left.contact_length_m, *right.contact_length_m) &&
                    alike(*left.radius_m, *right.radius_m);
  const bool straight =
      left.heading_rad == 0 && right.heading_rad == 0 && left.driven && right.driven;
  if (treads != 2 || robot.wheels.size() != 2 || !mirrored || !same || !straight) {
    return Error{
        "trials from rest (scenario \"srv1\") take two like treads, \"left\" and \"right\", that "
        "mirror one another with x = 0; what differs between the sides is reported by [effects] of "
        "the config (motor_asymmetry, com_offset)"};
  }
  if (!(*left.contact_length_m > 0)) return Error{"a tread's contact_length must be more than 0 m"};
  return {};
}

}  // namespace

Status check_tracked(const GroundRobot& robot) {
  if (robot.drive != DriveKind::kTracked) {
    return Error{"the drive is \"" + drive_names()[static_cast<std::size_t>(robot.drive)] +
                 "\", but trials from rest (scenario \"srv1\") are of tracked robots; log its runs "
                 "and use scenario = \"ground\" (docs/ground.md), or say drive = \"tracked\" with "
                 "the treads' contact_length"};
  }
  RETURN_IF_ERROR(check_treads(robot));
  const RobotMotors& m = robot.motors;
  if (!m.full_speed_rad_s) {
    return Error{
        "trials from rest need the speed at full duty: state full_surface_speed, in m/s of a "
        "tread"};
  }
  const double speed = *m.full_speed_rad_s * *robot.wheel("left")->radius_m;
  if (!(speed <= kFastest_m_s)) {
    return Error{"a tread's speed at full duty is " + std::to_string(speed) +
                 " m/s, expected up to 5 m/s; full_surface_speed is in m/s, full_speed in rad/s"};
  }
  if (m.acceleration_limit_m_s2 || m.command_timeout_s) {
    return Error{
        "trials from rest know neither acceleration_limit nor cmd_vel_timeout; leave them out and "
        "state lag, or use scenario = \"ground\""};
  }
  return {};
}

TrackedTable::TrackedTable(const GroundRobot& robot)
    : name_(robot.name),
      scale_(numbers_of(robot).reach_m() / srv1_numbers().reach_m()),
      size_(size_of(robot)),
      effects_(tracked_effects(scale_)),
      table_(std::make_unique<ParameterTable>(tracked_rows(numbers_of(robot)), effects_)),
      values_(table_->nominal()) {
  for (const auto& [key, value] : stated_effects(robot)) values_[table_->row(key)] = value;
}

Result<std::shared_ptr<const TrackedTable>> make_tracked_table(const GroundRobot& robot) {
  RETURN_IF_ERROR(check_tracked(robot));
  auto table = std::make_shared<const TrackedTable>(robot);
  for (std::size_t row = 0; row < table->values().size(); ++row) {
    RETURN_IF_ERROR(table->table().check(row, table->values()[row]));
  }
  return table;
}

const TrackedTable& srv1_robot() {
  static const TrackedTable table(srv1_file());
  return table;
}

const ParameterTable& srv1_table() { return srv1_robot().table(); }

}  // namespace gapfarm
