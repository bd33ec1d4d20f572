// A smooth correction of simulated drives ([residual] of model.toml): what no cause that has a name
// explains, as Gaussian-process regression leaves it.
//
// A correction is a sum of terms.  Each is a shift of the predicted end, (x, y, heading), a
// weighted sum of bumps about centres in the space of a few covariates:
//
//   shift(z) = sum_k w_k exp(-|(z - c_k) / length|^2 / 2),
//
// where differences of headings count as 2 sin(difference / 2), so that a turn comes back to
// itself.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/pose/pose.h"

namespace gapfarm {

// What a correction may look at beside the pose that it is asked for.
struct LoggedMotion {
  std::string command;
  Pose X_WS;        // measured start
  double left = 0;  // duties, [-1, 1]
  double right = 0;
  double duration_s = 0;
  double session_time_s = 0;
  int last_left = 0;  // signs of the sides' last duties before
  int last_right = 0;
  bool moved = true;  // by hand, just before
};

// How much is driven: the greater side's duty times the duration, s at full duty.
double drive_s(const LoggedMotion& facts);

struct ResidualCovariate {
  const char* name;   // in model.toml
  const char* label;  // "start heading": in words and pictures
  const char* unit;
  bool cyclic;      // an angle
  bool of_reading;  // of a pose alone, so that a shift of readings may depend on it
  // `X_WR`: the start; of readings each of both ends.
  double (*value)(const LoggedMotion& facts, const Pose& X_WR);
};
std::span<const ResidualCovariate> residual_covariates();

enum class ResidualFrame {
  kRobot,     // the axes of the predicted end
  kWorld,     // the world's axes
  kReadings,  // the world's: every reading is shifted by where it lies, the end's less the start's
  kMotion     // shares of the predicted motion's own parts, in the axes of the predicted end
};
// "robot", "world", "readings", "motion", in that order.
const std::vector<std::string>& residual_frame_names();

struct ResidualWeights {
  std::string command;     // empty: all commands
  Eigen::MatrixXd shifts;  // a row a centre: m, m, rad; of kMotion shares
};

struct ResidualTerm {
  ResidualFrame frame = ResidualFrame::kRobot;
  bool by_drive = false;                // shifts are for a second at full duty, not for a trial
  std::vector<std::size_t> covariates;  // rows of residual_covariates()
  std::vector<double> lengths;          // one a covariate, in its unit
  Eigen::MatrixXd centres;              // a row each, a column a covariate
  std::vector<ResidualWeights> weights;
};

using ResidualField = std::vector<ResidualTerm>;

// What the shifts of a term are multiplied by for this drive, one a centre.
Eigen::VectorXd residual_features(const ResidualTerm& term, const LoggedMotion& facts,
                                  const Pose& X_WE);
// From the frame of a term's shifts to the axes of the predicted end.
Eigen::Matrix3d residual_axes(ResidualFrame frame, const Pose& X_WS, const Pose& X_WE);

// The whole shift of a predicted end, in its own axes: m, m, rad.
Eigen::Vector3d residual_shift(const ResidualField& field, const LoggedMotion& facts,
                               const Pose& X_WE);
// Where the end is expected with it.
Pose corrected_end(const ResidualField& field, const LoggedMotion& facts, const Pose& X_WE);

// A few centres suffice for what varies over a length; more would be a table, not a shape.
inline constexpr std::size_t kMostResidualTerms = 8;
inline constexpr std::size_t kMostResidualCentres = 64;

// Errors name the term, the key, what was found and what it has to be.  `commands`: the model's.
Status check_residual(const ResidualField& field, std::span<const std::string> commands);

}  // namespace gapfarm
