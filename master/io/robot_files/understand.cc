#include "master/io/robot_files/understand.h"

#include <algorithm>
#include <cctype>
#include <numbers>
#include <set>

#include "common/trials/text/csv.h"
#include "master/io/robot_files/urdf/urdf.h"

namespace gapfarm {
namespace {

using std::numbers::pi;

// Wheels this near to one another along the robot share an axle; share of the robot's length.
constexpr double kSameAxle = 0.05;
// Gazebo's friction beyond this means "never slips", not a floor.
constexpr double kRealFriction = 2;

std::string millimetres(double m) { return format_double(std::round(m * 1e4) / 10) + " mm"; }

// A name that stands in TOML and SVG as it is.
std::string plain_name(std::string name) {
  for (char& c : name) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '.';
    if (!plain) c = '_';
  }
  return name.substr(0, 64);
}

class Understanding {
 public:
  Understanding(const UrdfModel& model, const std::vector<DriveFacts>& controllers)
      : model_(model), facts_(controllers), poses_(link_poses(model)) {
    for (DriveFacts& plugin : plugin_facts(model)) facts_.push_back(std::move(plugin));
  }

  Result<RobotReading> run() {
    ASSIGN_OR_RETURN(chassis_, find_chassis(model_, facts_));
    remark(model_.notes);
    remark(chassis_.remarks);
    for (const DriveFacts& facts : facts_) {
      remark(facts.remarks);
      if (!facts.unread.empty()) return Error{unread_text(facts)};
    }
    mark_driven();
    ASSIGN_OR_RETURN(guess_, guess_drive(model_, chassis_, facts_));
    robot().drive = guess_.drive;
    reading_.evidence = guess_.evidence;
    remark(guess_.remarks);
    place_wheels();
    name_wheels();
    read_masses();
    read_friction();
    take_controller(facts_, reading_);
    compare_facts(facts_, reading_);
    draw_outlines();
    robot().name = plain_name(model_.name);
    reading_.base_link = model_.root;
    reading_.floor_z_B_m = chassis_.floor_z_B_m;
    reading_.floor_from = chassis_.floor_from;
    return std::move(reading_);
  }

 private:
  GroundRobot& robot() { return reading_.robot; }
  void remark(const std::vector<std::string>& all) {
    reading_.remarks.insert(reading_.remarks.end(), all.begin(), all.end());
  }

  bool free(const ChassisWheel& wheel) const { return !wheel.caster && !wheel.steered; }

  // Casters aside, what a controller, plugin or transmission names is driven; where nobody names
  // any wheel, all of them are.
  void mark_driven() {
    bool any = false;
    for (const ChassisWheel& wheel : chassis_.wheels) any = any || wheel.named;
    if (any) return;
    for (ChassisWheel& wheel : chassis_.wheels) wheel.named = !wheel.caster;
    reading_.remarks.push_back(
        "no controller, plugin or transmission names a wheel; all but casters are taken as driven");
  }

  // R: midway between the wheels that the drive turns about.
  void place_wheels() {
    const bool car = is_steered(robot());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (const ChassisWheel& wheel : chassis_.wheels) {
      if (!free(wheel) || (!car && !wheel.named)) continue;
      sum += wheel.centre_B_m;
      ++count;
    }
    origin_B_ = sum / std::max(count, 1);
    reading_.X_BR = {origin_B_.x(), origin_B_.y(), guess_.forward_rad};
    for (const ChassisWheel& wheel : chassis_.wheels) add_wheel(wheel, car);
    for (const ChassisSupport& support : chassis_.supports) {
      RobotWheel wheel;
      wheel.kind = WheelKind::kCaster;
      wheel.driven = false;
      wheel.x_m = guess_.along(support.point_B_m - origin_B_);
      wheel.y_m = guess_.across(support.point_B_m - origin_B_);
      add(wheel, {"", support.name, support.line, "", "", false, {}, {}, false, {}});
    }
  }

  void add(RobotWheel wheel, const WheelSource& source) {
    // Files carry places to the micrometre of somebody's CAD; zero is zero.
    for (auto* value : {&wheel.x_m, &wheel.y_m}) {
      *value = std::round(**value * 1e6) / 1e6 + 0.0;
    }
    robot().wheels.push_back(std::move(wheel));
    reading_.sources.push_back(source);
  }

  void add_wheel(const ChassisWheel& found, bool car) {
    RobotWheel wheel;
    Eigen::Vector3d place = found.centre_B_m;
    // A caster is where it swivels from; on average it carries there.
    if (found.caster && found.turning != nullptr) {
      place = poses_.find(found.turning->child)->second.translation();
    }
    wheel.x_m = guess_.along(place - origin_B_);
    wheel.y_m = guess_.across(place - origin_B_);
    wheel.radius_m = found.radius_m;
    wheel.width_m = found.width_m;
    wheel.steered = found.steered;
    wheel.driven = found.named && !found.caster;
    const bool wheel_of_car = car && !found.caster;
    if (!wheel.driven && !wheel_of_car) wheel.kind = WheelKind::kCaster;
    const double rolls = std::atan2(-found.axis_B.x(), found.axis_B.y());
    const double heading = wrap_angle(rolls - guess_.forward_rad);
    WheelSource source;
    source.joint = found.joint->name;
    source.link = found.link->name;
    source.line = found.joint->line;
    source.radius_from = found.radius_from;
    if (found.turning != nullptr) source.turning = found.turning->name;
    if (robot().drive == DriveKind::kOmni && wheel.driven) {
      wheel.kind = WheelKind::kOmni;
      wheel.heading_rad = heading;
    } else {
      source.turns_backward = std::abs(heading) > pi / 2;
    }
    source.axle = poses_.find(source.link)->second.linear().transpose() * found.axis_B;
    if (!found.link->collisions.empty()) {
      source.axle = found.link->collisions.front().X_LG.linear().transpose() * source.axle;
    }
    for (const UrdfSurface& surface : model_.surfaces) {
      if (surface.link != found.link->name) continue;
      if (surface.mu1) source.mu1 = surface.mu1;
      if (surface.mu2) source.mu2 = surface.mu2;
      if (!surface.fdir1) continue;
      source.mu1_across = std::abs(surface.fdir1->normalized().dot(source.axle)) > std::sqrt(0.5);
    }
    if (robot().drive == DriveKind::kMecanum && wheel.driven) {
      wheel.kind = WheelKind::kMecanum;
      wheel.roller_angle_rad = *wheel.x_m * *wheel.y_m > 0 ? -pi / 4 : pi / 4;
    }
    add(wheel, source);
  }

  // left, front_left, rear_right, middle_left, wheel_1, caster_front: by place.
  void name_wheels() {
    double front = -1e9, rear = 1e9;
    std::size_t driven = 0;
    for (const RobotWheel& wheel : robot().wheels) {
      if (wheel.kind == WheelKind::kCaster) continue;
      front = std::max(front, *wheel.x_m);
      rear = std::min(rear, *wheel.x_m);
      ++driven;
    }
    std::set<std::string> taken;
    int omni = 0;
    for (RobotWheel& wheel : robot().wheels) {
      const std::string side = *wheel.y_m > 1e-3 ? "left" : *wheel.y_m < -1e-3 ? "right" : "";
      std::string name;
      if (wheel.kind == WheelKind::kCaster) {
        const double middle = 0.5 * (front + rear);
        const bool beside = std::abs(*wheel.x_m - middle) < kSameAxle * (front - rear + 0.1);
        name = std::string("caster") +
               (beside                ? ""
                : *wheel.x_m > middle ? "_front"
                                      : "_rear") +
               (side.empty() ? "" : "_" + side);
      } else if (wheel.kind == WheelKind::kOmni) {
        name = "wheel_" + std::to_string(++omni);
      } else if (robot().drive == DriveKind::kDifferential) {
        name = side;
      } else {
        const double at = (*wheel.x_m - rear) / std::max(front - rear, 1e-9);
        const std::string row = at > 1 - kSameAxle ? "front" : at < kSameAxle ? "rear" : "middle";
        name = row + (side.empty() ? "" : "_" + side);
      }
      wheel.name = name;
      for (int i = 2; !taken.insert(wheel.name).second; ++i) {
        wheel.name = name + "_" + std::to_string(i);
      }
      const bool two_sides =
          robot().drive == DriveKind::kDifferential || robot().drive == DriveKind::kSkid;
      if (two_sides && wheel.driven) {
        wheel.side = side == "left" ? WheelSide::kLeft : WheelSide::kRight;
        if (robot().drive == DriveKind::kSkid) wheel.group = side;
      }
    }
  }

  void read_masses() {
    const MassSum masses = sum_masses(model_, poses_);
    remark(masses.remarks);
    if (masses.mass_kg <= 0) {
      reading_.remarks.push_back("no link has a mass; state mass in kg in the robot's table");
      return;
    }
    robot().mass_kg = masses.mass_kg;
    const Eigen::Vector3d from = masses.com_B_m - origin_B_;
    robot().com_x_m = guess_.along(from);
    robot().com_y_m = guess_.across(from);
    robot().com_z_m = masses.com_B_m.z() - chassis_.floor_z_B_m;
    if (masses.yaw_inertia_kgm2 > 0) robot().yaw_inertia_kg_m2 = masses.yaw_inertia_kgm2;
    std::vector<Eigen::Vector2d> points;
    double reach = 0;
    for (const RobotWheel& wheel : robot().wheels) {
      points.emplace_back(*wheel.x_m, *wheel.y_m);
      reach = std::max(reach, points.back().norm());
    }
    const double gyration = std::sqrt(masses.yaw_inertia_kgm2 / masses.mass_kg);
    if (gyration > 2 * reach) {
      reading_.remarks.push_back("the inertia about z, " +
                                 format_double(std::round(masses.yaw_inertia_kgm2 * 1e3) / 1e3) +
                                 " kg m^2, is that of a mass " + millimetres(gyration) +
                                 " from the middle, and the wheels reach " + millimetres(reach) +
                                 ": probably a placeholder");
    }
    const Eigen::Vector2d com(*robot().com_x_m, *robot().com_y_m);
    if (!wheel_loads(points, com, 1).empty()) return;
    reading_.remarks.push_back(
        "the centre of mass is not above the wheels: the robot would fall over; a caster or its "
        "collision is missing, or a mass is in the wrong place");
  }

  void read_friction() {
    for (std::size_t i = 0; i < robot().wheels.size(); ++i) {
      const WheelSource& source = reading_.sources[i];
      if (!robot().wheels[i].driven || !source.mu1) continue;
      const double mu2 = source.mu2.value_or(*source.mu1);
      if (*source.mu1 <= 0 || *source.mu1 > kRealFriction || mu2 <= 0 || mu2 > kRealFriction) {
        reading_.remarks.push_back("Gazebo's mu1 " + format_double(*source.mu1) + ", mu2 " +
                                   format_double(mu2) + " of link '" + source.link +
                                   "' stand for wheels that never slip, and were not taken");
        return;
      }
      robot().friction = source.mu1_across ? mu2 : *source.mu1;
      robot().friction_ratio = source.mu1_across ? *source.mu1 / mu2 : mu2 / *source.mu1;
      return;
    }
  }

  void draw_outlines() {
    for (const UrdfLink& link : model_.links) {
      for (const UrdfGeometry& shape : link.collisions) {
        RobotOutline drawn{link.name, {}};
        for (const Eigen::Vector2d& corner : outline(poses_.find(link.name)->second, shape)) {
          const Eigen::Vector3d from = Eigen::Vector3d(corner.x(), corner.y(), 0) - origin_B_;
          drawn.corners_R_m.emplace_back(guess_.along(from), guess_.across(from));
        }
        if (drawn.corners_R_m.size() >= 3) reading_.outlines.push_back(std::move(drawn));
      }
    }
  }

  const UrdfModel& model_;
  std::vector<DriveFacts> facts_;
  LinkPoses poses_;
  Chassis chassis_;
  RobotReading reading_;
  DriveGuess guess_;
  Eigen::Vector3d origin_B_ = Eigen::Vector3d::Zero();
};

}  // namespace

Result<RobotReading> understand_robot(const UrdfModel& model,
                                      const std::vector<DriveFacts>& controllers) {
  return Understanding(model, controllers).run();
}

}  // namespace gapfarm
