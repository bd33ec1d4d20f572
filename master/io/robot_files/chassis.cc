#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/text.h"
#include "common/trials/text/csv.h"
#include "master/io/robot_files/understand.h"
#include "master/io/robot_files/urdf/urdf.h"

namespace gapfarm {
namespace {

constexpr double kUpright = 0.9;       // cosine to z of an axis that steers
constexpr double kLevel = 0.3;         // cosine to z of an axle, at most
constexpr double kAlong = 0.985;       // cosine of directions that are one: 10 degrees
constexpr double kCasterTrail = 5e-3;  // m; steering knuckles have less
// A wheel may hang this much above the floor: suspensions, and six wheels on a bow.
constexpr double kHangs = 0.02;      // m
constexpr double kHangsShare = 0.3;  // of its radius
// Files agree on the floor to this, m.
constexpr double kFloorAgrees = 2e-3;

// Every joint that a controller of wheels names.
std::set<std::string> stated_joints(const std::vector<DriveFacts>& facts) {
  std::set<std::string> all;
  for (const DriveFacts& fact : facts) {
    for (const auto& [role, stated] : fact.joints) {
      all.insert(stated.names.begin(), stated.names.end());
    }
  }
  return all;
}

class Finder {
 public:
  Finder(const UrdfModel& model, const std::vector<DriveFacts>& facts)
      : model_(model), poses_(link_poses(model)), stated_(stated_joints(facts)), driven_(stated_) {
    driven_.insert(model.actuated.begin(), model.actuated.end());
  }

  Result<Chassis> find() {
    for (const UrdfJoint& joint : model_.joints) {
      if (joint.type == "continuous" || joint.type == "revolute") consider_rolling(joint);
    }
    for (const UrdfJoint& joint : model_.joints) {
      if (joint.type == "fixed") consider_fixed(joint);
    }
    if (error_) return *error_;
    find_floor();
    take_heights_for_radii();
    drop_hanging();
    find_supports();
    if (chassis_.wheels.empty()) return no_wheels();
    return std::move(chassis_);
  }

 private:
  void remark(const UrdfJoint& joint, const std::string& text) {
    chassis_.remarks.push_back("joint '" + joint.name + "' (line " + std::to_string(joint.line) +
                               ") " + text);
  }

  bool sounds_like_wheel(const UrdfJoint& joint) const {
    return contains_any(joint.name + " " + joint.child, {"wheel", "tire", "tyre", "whl"});
  }

  // A joint that turns without end about a level axis, under something round, named or driven.
  void consider_rolling(const UrdfJoint& joint) {
    const bool endless = joint.type == "continuous" || !joint.lower_rad || !joint.upper_rad ||
                         *joint.upper_rad - *joint.lower_rad > 6.3;
    if (!endless) return;
    ChassisWheel wheel = wheel_at(joint);
    const bool name = sounds_like_wheel(joint);
    const auto round = round_shape(model_, *wheel.link, poses_);
    if (!joint.axis_given && name) guess_axis(joint, round, wheel);
    if (std::abs(wheel.axis_B.z()) > kLevel) return;
    if (round && std::abs(round->axis_B.dot(wheel.axis_B)) < kAlong && !round->ball) {
      if (!name && !stated_.count(joint.name)) return;
      if (joint.axis_given && std::abs(round->axis_B.z()) < kLevel) {
        remark(joint, "turns about another axis than its cylinder's; the cylinder's was taken");
        wheel.axis_B = round->axis_B;
      }
    }
    if (!name && !stated_.count(joint.name) && !round) return;
    finish(joint, round, wheel);
  }

  // Wheels that were fixed to draw them: where a controller names them, or nothing else rolls.
  void consider_fixed(const UrdfJoint& joint) {
    if (contains_any(joint.name + " " + joint.child, {"caster", "castor"})) return;
    const bool named = stated_.count(joint.name) != 0;
    if (!named && !(sounds_like_wheel(joint) && rolling_ == 0)) return;
    for (const ChassisWheel& other : chassis_.wheels) {
      if (other.link->name == joint.parent || other.link->name == joint.child) return;
    }
    ChassisWheel wheel = wheel_at(joint);
    auto round = round_shape(model_, *wheel.link, poses_);
    if (!round) {
      // The hub that it is fixed to may carry the shape.
      const UrdfLink* hub = model_.find_link(joint.parent);
      if (hub->name != model_.root) round = round_shape(model_, *hub, poses_);
    }
    if (!round && wheel.link->visuals.empty() && wheel.link->collisions.empty()) return;
    wheel.axis_B = round && !round->ball ? round->axis_B : Eigen::Vector3d::UnitY();
    if (std::abs(wheel.axis_B.z()) > kLevel) return;
    remark(joint, std::string("is fixed, though its wheel is ") +
                      (named ? "driven" : "one by its name") + "; it is taken to roll");
    finish(joint, round, wheel);
  }

  ChassisWheel wheel_at(const UrdfJoint& joint) const {
    ChassisWheel wheel;
    wheel.joint = &joint;
    wheel.link = model_.find_link(joint.child);
    const Eigen::Isometry3d& X_BL = poses_.find(joint.child)->second;
    wheel.centre_B_m = X_BL.translation();
    wheel.axis_B = X_BL.linear() * joint.axis_J;
    wheel.named = driven_.count(joint.name) != 0;
    return wheel;
  }

  void guess_axis(const UrdfJoint& joint, const std::optional<RoundShape>& round,
                  ChassisWheel& wheel) {
    const bool shape = round && !round->ball && std::abs(round->axis_B.z()) < kLevel;
    wheel.axis_B = shape ? round->axis_B : Eigen::Vector3d::UnitY();
    remark(joint, std::string("has no axis, and URDF's default is x; ") +
                      (shape ? "its cylinder's axis" : "y, across the robot,") + " was taken");
  }

  void finish(const UrdfJoint& joint, const std::optional<RoundShape>& round, ChassisWheel wheel) {
    for (const UrdfJoint* above = &joint; above != nullptr;
         above = model_.joint_above(above->parent)) {
      if (!above->unread.empty()) {
        if (!error_) {
          error_ = Error{model_.file + ":" + std::to_string(above->line) + ": found " +
                         quoted_word(above->unread) + " in the place of joint '" + above->name +
                         "', expected numbers; expand it first: xacro FILE > robot.urdf"};
        }
        return;
      }
    }
    wheel.axis_B.normalize();
    if (round) {
      wheel.radius_m = round->radius_m;
      wheel.width_m = round->width_m;
      wheel.radius_from = round->from;
      // A cylinder may sit beside its joint, along the axle.
      const Eigen::Vector3d beside = round->centre_B_m - wheel.centre_B_m;
      wheel.centre_B_m += wheel.axis_B * wheel.axis_B.dot(beside);
    }
    find_turning(wheel);
    if (joint.type != "fixed") ++rolling_;
    chassis_.wheels.push_back(std::move(wheel));
  }

  // The upright joint between the wheel and the body, and whether it steers or swivels.
  void find_turning(ChassisWheel& wheel) const {
    for (const UrdfJoint* above = model_.joint_above(wheel.joint->parent); above != nullptr;
         above = model_.joint_above(above->parent)) {
      if (above->type != "continuous" && above->type != "revolute") continue;
      const Eigen::Isometry3d& X_BL = poses_.find(above->child)->second;
      Eigen::Vector3d axis = X_BL.linear() * above->axis_J;
      const std::string names = above->name + " " + above->child + " " + wheel.joint->name;
      const bool swivel_name = contains_any(names, {"caster", "castor", "swivel"});
      // A swivel without an axis: nobody meant URDF's x.
      if (!above->axis_given && swivel_name) axis = Eigen::Vector3d::UnitZ();
      if (std::abs(axis.z()) < kUpright) continue;
      Eigen::Vector3d trail = wheel.centre_B_m - X_BL.translation();
      trail.z() = 0;
      // Two wheels on one swivel stand beside its axis; what trails is along the rolling way.
      const Eigen::Vector3d level =
          Eigen::Vector3d(wheel.axis_B.x(), wheel.axis_B.y(), 0).normalized();
      trail -= level * level.dot(trail);
      wheel.turning = above;
      wheel.trail_m = trail.norm();
      const bool limited = above->type == "revolute" && above->lower_rad && above->upper_rad;
      const bool driven = driven_.count(above->name) != 0;
      const bool steer_name = contains_any(names, {"steer"});
      wheel.steered =
          driven || steer_name || (!swivel_name && (limited || wheel.trail_m < kCasterTrail));
      wheel.caster = !wheel.steered;
      return;
    }
    const std::string names = wheel.joint->name + " " + wheel.link->name;
    if (!wheel.named && contains_any(names, {"caster", "castor"})) wheel.caster = true;
  }

  void find_floor() {
    for (const char* name : {"base_footprint", "footprint"}) {
      for (const auto& [link, pose] : poses_) {
        if (!contains_any(link, {name}) || chassis_.footprint_z_B_m) continue;
        chassis_.footprint_z_B_m = pose.translation().z();
        footprint_ = link;
      }
    }
    std::optional<double> lowest;
    const ChassisWheel* of = nullptr;
    for (const ChassisWheel& wheel : chassis_.wheels) {
      if (!wheel.radius_m || wheel.caster) continue;
      const double bottom = wheel.centre_B_m.z() - *wheel.radius_m;
      if (lowest && bottom >= *lowest) continue;
      lowest = bottom;
      of = &wheel;
    }
    if (lowest) {
      chassis_.floor_z_B_m = *lowest;
      chassis_.floor_from = "under the wheel of joint '" + of->joint->name + "'";
      check_footprint(*lowest);
      return;
    }
    if (chassis_.footprint_z_B_m) {
      chassis_.floor_z_B_m = *chassis_.footprint_z_B_m;
      chassis_.floor_from = "link '" + footprint_ + "'";
      return;
    }
    // Nothing says where the floor is: many files put their root on it.
    chassis_.floor_from = "link '" + model_.root + "', the root";
    guessed_floor_ = true;
  }

  void check_footprint(double lowest) {
    if (!chassis_.footprint_z_B_m) return;
    const double apart = lowest - *chassis_.footprint_z_B_m;
    if (std::abs(apart) <= kFloorAgrees) return;
    chassis_.remarks.push_back("link '" + footprint_ + "' should lie on the floor, but is " +
                               format_double(std::round(std::abs(apart) * 1e4) / 10) + " mm " +
                               (apart > 0 ? "below" : "above") +
                               " the lowest wheel: a radius or a height is wrong");
  }

  // Where only a mesh is drawn the axle's height is the radius, if we know the floor.
  void take_heights_for_radii() {
    std::string names;
    double least = 1e9, most = 0;
    for (ChassisWheel& wheel : chassis_.wheels) {
      if (wheel.radius_m) continue;
      const double height = wheel.centre_B_m.z() - chassis_.floor_z_B_m;
      if (height <= 1e-3) continue;
      wheel.radius_m = height;
      wheel.radius_from = "height of the axle over " + chassis_.floor_from;
      names += (names.empty() ? "'" : ", '") + wheel.joint->name + "'";
      least = std::min(least, height);
      most = std::max(most, height);
    }
    if (names.empty()) return;
    const auto mm = [](double m) { return format_double(std::round(m * 1e4) / 10); };
    chassis_.remarks.push_back(
        "no shape shows the radius of the wheels of " + names + "; their axles' height over " +
        chassis_.floor_from + ", " + mm(least) + (most - least > 5e-5 ? " to " + mm(most) : "") +
        " mm, was taken" +
        (guessed_floor_ ? " as if that lay on the floor: state the radius in the robot's table"
                        : ""));
  }

  void drop_hanging() {
    std::erase_if(chassis_.wheels, [&](const ChassisWheel& wheel) {
      const double radius = wheel.radius_m.value_or(0);
      const double gap = wheel.centre_B_m.z() - radius - chassis_.floor_z_B_m;
      if (gap <= std::max(kHangs, kHangsShare * radius)) return false;
      // Without a radius the floor is unknown, and its own name must do.
      if (!wheel.radius_m && (wheel.named || sounds_like_wheel(*wheel.joint))) return false;
      if (sounds_like_wheel(*wheel.joint)) {
        remark(*wheel.joint, "does not reach the floor and was omitted");
      }
      return true;
    });
  }

  void find_supports() {
    for (const UrdfLink& link : model_.links) {
      const bool wheel = std::ranges::any_of(chassis_.wheels, [&](const ChassisWheel& w) {
        return w.link == &link || hangs_on_caster(link, w);
      });
      if (wheel) continue;
      const UrdfJoint* above = model_.joint_above(link.name);
      if (above != nullptr && above->type != "fixed") continue;
      const bool name = contains_any(link.name, {"caster", "castor", "ball_wheel", "skid"});
      for (const UrdfGeometry& shape : link.collisions) {
        if (shape.shape == UrdfShape::kMesh && !name) continue;
        const Eigen::Vector3d lowest = lowest_point(poses_.find(link.name)->second, shape);
        const double gap = lowest.z() - chassis_.floor_z_B_m;
        // By its name it may hang a little; a block that nobody named must stand on the floor.
        if (std::abs(gap) > (name ? kHangs : kFloorAgrees)) continue;
        if (!name && shape.shape != UrdfShape::kSphere) continue;
        chassis_.supports.push_back({link.name, lowest, shape.line});
        if (name) break;
      }
    }
  }

  // Hub-caps and forks below a caster's swivel are no supports of their own.
  bool hangs_on_caster(const UrdfLink& link, const ChassisWheel& wheel) const {
    for (const UrdfJoint* above = model_.joint_above(link.name); above != nullptr;
         above = model_.joint_above(above->parent)) {
      if (above == wheel.joint || above == wheel.turning) return true;
    }
    return false;
  }

  Error no_wheels() const {
    const auto moving = std::ranges::count_if(
        model_.joints, [](const UrdfJoint& joint) { return joint.type != "fixed"; });
    return Error{
        model_.file + ":1: found no wheels (" + std::to_string(moving) +
        " joints move, none of them turns without end about a level axis near the floor), expected "
        "a robot that drives; give the URDF with its base, or describe the robot in TOML"};
  }

  const UrdfModel& model_;
  LinkPoses poses_;
  std::set<std::string> stated_;  // by controllers of wheels
  std::set<std::string> driven_;  // these, and what transmissions drive, arms included
  Chassis chassis_;
  std::string footprint_;
  bool guessed_floor_ = false;
  int rolling_ = 0;
  std::optional<Error> error_;
};

}  // namespace

bool contains_any(std::string_view text, std::initializer_list<std::string_view> needles) {
  const std::string lower = lowered(std::string(text));
  return std::ranges::any_of(needles,
                             [&](std::string_view word) { return lower.find(word) != lower.npos; });
}

Result<Chassis> find_chassis(const UrdfModel& model, const std::vector<DriveFacts>& facts) {
  return Finder(model, facts).find();
}

}  // namespace gapfarm
