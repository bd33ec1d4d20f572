#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "common/base/text.h"
#include "common/trials/text/csv.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {
namespace {

using std::numbers::pi;

constexpr double kParallel = 0.985;  // cosine: 10 degrees

bool mentions_mecanum(const UrdfModel& model) {
  const auto mecanum = [](const std::string& text) { return contains_any(text, {"mecanum"}); };
  if (mecanum(model.name)) return true;
  for (const UrdfLink& link : model.links) {
    if (mecanum(link.name)) return true;
    for (const auto* shapes : {&link.collisions, &link.visuals}) {
      for (const UrdfGeometry& shape : *shapes) {
        if (mecanum(shape.mesh)) return true;
      }
    }
  }
  return false;
}

class Guess {
 public:
  Guess(const UrdfModel& model, const Chassis& chassis, const std::vector<DriveFacts>& facts)
      : model_(model), chassis_(chassis), facts_(facts) {
    // Sides are those of the wheels' middle: the root may lie anywhere.
    double count = 0;
    for (const ChassisWheel& wheel : chassis.wheels) {
      if (!free(wheel) || !wheel.named) continue;
      middle_B_ += wheel.centre_B_m;
      ++count;
    }
    middle_B_ /= std::max(count, 1.0);
  }

  Result<DriveGuess> run() {
    RETURN_IF_ERROR(turn_forward());
    RETURN_IF_ERROR(set_drive());
    return std::move(guess_);
  }

 private:
  Error refuse(const std::string& found, const std::string& remedy) const {
    return Error{model_.file + ":1: found " + found +
                 ", expected a differential, skid-steer, omni, mecanum, car or tricycle drive; " +
                 remedy};
  }

  static bool free(const ChassisWheel& wheel) { return !wheel.caster && !wheel.steered; }

  double across(const ChassisWheel& wheel) const {
    return guess_.across(wheel.centre_B_m - middle_B_);
  }

  // Forward is across the axles; nearly always the root's x.
  Status turn_forward() {
    const ChassisWheel* first = nullptr;
    for (const ChassisWheel& wheel : chassis_.wheels) {
      if (!free(wheel)) continue;
      if (first == nullptr) first = &wheel;
      if (std::abs(first->axis_B.dot(wheel.axis_B)) < kParallel) guess_.parallel = false;
    }
    if (first == nullptr) {
      const auto turned = std::ranges::count(chassis_.wheels, true, &ChassisWheel::steered);
      if (turned == 0) {
        return refuse("nothing but casters (joint '" + chassis_.wheels[0].joint->name + "', ...)",
                      "name the driven wheels in a controller file (--controllers)");
      }
      return refuse(std::to_string(turned) +
                        " wheels that all hang on steering joints (a swerve drive, as '" +
                        chassis_.wheels[0].turning->name + "')",
                    "gapfarm does not simulate drives that turn every wheel");
    }
    if (!guess_.parallel) return {};
    if (std::abs(first->axis_B.y()) >= 0.9) return {};
    guess_.forward_rad = std::atan2(-first->axis_B.x(), first->axis_B.y());
    // Either way is across the axles; the sides' names decide, else the way closer to x or y.
    double left = 0;
    for (const ChassisWheel& wheel : chassis_.wheels) {
      if (contains_any(wheel.joint->name, {"left"})) left += across(wheel);
      if (contains_any(wheel.joint->name, {"right"})) left -= across(wheel);
    }
    const bool turn = left != 0 ? left < 0 : std::sin(guess_.forward_rad) < 0;
    if (turn) guess_.forward_rad = wrap_angle(guess_.forward_rad + pi);
    guess_.remarks.push_back("the axles do not lie along the root link's y: ahead was taken at " +
                             format_double(std::round(guess_.forward_rad * 1800 / pi) / 10) +
                             " degrees to its x");
    return {};
  }

  const DriveFacts* stated_drive() const {
    for (const DriveFacts& fact : facts_) {
      if (!fact.drive.empty()) return &fact;
    }
    return nullptr;
  }

  void because(const std::string& sentence) { guess_.evidence.push_back(sentence); }

  Status set_drive() {
    std::vector<const ChassisWheel*> steered, left, right;
    for (const ChassisWheel& wheel : chassis_.wheels) {
      if (wheel.steered) steered.push_back(&wheel);
      if (!free(wheel)) continue;
      const double y = across(wheel);
      if (wheel.named) (y > 0 ? left : right).push_back(&wheel);
    }
    const DriveFacts* stated = stated_drive();
    if (stated != nullptr) {
      because(stated->place(stated->line) + ": " + stated->type + " says " + stated->drive);
    }
    if (!steered.empty()) return set_steered(steered);
    const std::size_t driven = left.size() + right.size();
    if (!guess_.parallel) {
      guess_.drive = DriveKind::kOmni;
      because(std::to_string(driven) + " wheels whose axles are not parallel");
      if (driven >= 3) return {};
      return refuse("two wheels whose axles are not parallel",
                    "check the axis and rpy of their joints");
    }
    because("driven wheels on parallel axles, " + std::to_string(left.size()) + " left and " +
            std::to_string(right.size()) + " right");
    if (left.empty() || left.size() != right.size()) {
      return refuse(std::to_string(left.size()) + " driven wheels on the left and " +
                        std::to_string(right.size()) + " on the right",
                    "name the driven wheels in a controller file (--controllers)");
    }
    return set_parallel(left.size(), stated);
  }

  Status set_parallel(std::size_t each_side, const DriveFacts* stated) {
    if (each_side == 1) {
      guess_.drive = DriveKind::kDifferential;
      return {};
    }
    const std::string drive_text = stated == nullptr ? "" : stated->drive;
    const bool planar = drive_text == "planar" || drive_text == "omni";
    if (each_side == 2 && (drive_text == "mecanum" || planar || mentions_mecanum(model_))) {
      guess_.drive = DriveKind::kMecanum;
      because(drive_text == "mecanum" ? "the controller is one of mecanum wheels"
              : planar                ? "four parallel wheels that may move sideways"
                                      : "a name or mesh says mecanum");
      return {};
    }
    guess_.drive = DriveKind::kSkid;
    if (stated == nullptr && each_side == 2) {
      guess_.remarks.push_back(
          "four parallel wheels may be a skid-steer or carry mecanum rollers, which no URDF shows; "
          "taken as skid-steer: set drive = \"mecanum\" if they carry rollers");
    }
    return {};
  }

  Status set_steered(const std::vector<const ChassisWheel*>& steered) {
    std::set<std::string> joints;
    for (const ChassisWheel* wheel : steered) joints.insert("'" + wheel->turning->name + "'");
    const std::string names = joined(joints);
    because(std::to_string(steered.size()) + " wheels on steering joints (" + names + ")");
    if (steered.size() == 1) {
      guess_.drive = DriveKind::kTricycle;
      return {};
    }
    if (steered.size() == 2) {
      const double apart = guess_.along(steered[0]->centre_B_m - steered[1]->centre_B_m);
      const double track = across(*steered[0]) - across(*steered[1]);
      if (std::abs(apart) < 0.2 * std::abs(track)) {
        guess_.drive = DriveKind::kAckermann;
        return {};
      }
    }
    return refuse(std::to_string(steered.size()) + " steered wheels (" + names + ")",
                  "gapfarm steers one wheel, or two of one axle");
  }

  const UrdfModel& model_;
  const Chassis& chassis_;
  const std::vector<DriveFacts>& facts_;
  Eigen::Vector3d middle_B_ = Eigen::Vector3d::Zero();
  DriveGuess guess_;
};

}  // namespace

Result<DriveGuess> guess_drive(const UrdfModel& model, const Chassis& chassis,
                               const std::vector<DriveFacts>& facts) {
  return Guess(model, chassis, facts).run();
}

}  // namespace gapfarm
