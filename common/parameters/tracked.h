// The parameter table of scenario `srv1`, trials from rest of a tracked robot: its rows are the
// same for every robot, their nominal values and bounds come from the robot's file.
#pragma once

#include <memory>
#include <vector>

#include "common/parameters/table.h"
#include "common/robot/robot.h"

namespace gapfarm {

// Whether trials from rest of this robot can be simulated: tracked, two like treads that mirror one
// another, a full speed, nothing stated that the scenario does not know.  The error says the
// remedy. REQUIRES: a complete robot.
Status check_tracked(const GroundRobot& robot);

class TrackedTable {
 public:
  // REQUIRES: check_tracked() is OK.
  explicit TrackedTable(const GroundRobot& robot);
  TrackedTable& operator=(TrackedTable&&) = delete;

  const ParameterTable& table() const { return *table_; }
  // The nominal ones, and what the file says that is an effect here: lag, dead band, rolling
  // resistance, where the mass lies, the marker's place.
  const ParameterValues& values() const { return values_; }
  const RobotSize& size() const { return size_; }
  const std::string& name() const { return name_; }
  // How many times as far from its middle as the SRV-1's contacts its own stand.
  double scale() const { return scale_; }

 private:
  std::string name_;
  double scale_ = 1;
  RobotSize size_;
  std::vector<Effect> effects_;
  std::unique_ptr<ParameterTable> table_;
  ParameterValues values_;
};

// Errors: check_tracked()'s, a value of an effect that is out of its bounds.
Result<std::shared_ptr<const TrackedTable>> make_tracked_table(const GroundRobot& robot);

// The SRV-1's, of configs/robots/srv1.toml as it was when the program was built.
const TrackedTable& srv1_robot();

}  // namespace gapfarm
