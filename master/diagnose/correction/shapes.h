// What a correction may depend on: the dependences that the last tests of a diagnosis look at.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/residual/field.h"

namespace gapfarm {

// A term before it is fitted.
struct ResidualShape {
  ResidualFrame frame = ResidualFrame::kRobot;
  bool by_drive = true;
  bool by_command = true;  // shifts of its own for each command
  bool edge = false;       // nothing, and one shift for all beyond an edge, wherever that lies
  std::vector<std::size_t> covariates;
  // Length scales to choose from: of what has a range in the log a share of it; of headings and of
  // what is or is not so, as they are.
  std::vector<std::vector<double>> lengths;  // one a covariate each
};

// Where commands repeat every command has its own shifts; where they do not, duties are covariates.
std::vector<ResidualShape> residual_shapes(bool free_commands);

}  // namespace gapfarm
