// The tuned base model beside the log: the first steps of a diagnosis.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/trials/pose_readings.h"
#include "master/diagnose/evidence/residuals.h"
#include "master/infer/predictor.h"

namespace gapfarm {

// A base parameter that tuning moves, with a weak prior on the logarithm of its value: the data
// cannot distinguish some of them, and the prior keeps those where the config had them.
struct BaseParameter {
  std::size_t row = 0;
  double prior_log_sd = 1;
};

// A parameter of which no effect may claim what another value would do.
struct RetunedParameter {
  std::size_t row = 0;
  // Standard deviation of the prior: of its logarithm where `unit` is 0, else in such units.
  double prior_sd = 1;
  double unit = 0;
};

struct DriveBase {
  std::vector<BaseParameter> tuned;
  std::vector<std::size_t> kept;  // others with a value in Study::base
  std::vector<RetunedParameter> retuned;
  // Row of the speed at full duty.  Of a program's parameters tune_base() finds it, if there is
  // one.
  std::optional<std::size_t> speed;
  bool alike = true;  // whether an unknown gain of all motions alike counts among nuisances
};

// Of srv1, or of what the problem's program declares: of that, `genes` are tuned whose values are
// positive, all such parameters where the config searches none of the program's.
DriveBase drive_base(const Problem& problem, std::span<const Gene> genes);

// A parameter that retuning may move, with a prior on the logarithm of its value, and the change of
// every trial's end for a change of that logarithm, in the axes of the base's ends.
struct RetunedPush {
  BaseParameter parameter;
  std::vector<Eigen::Vector3d> slopes;
};

struct DiagnosisSubject;  // master/diagnose/subject.h

struct Study {
  std::shared_ptr<const DiagnosisSubject> subject;
  const ParameterTable* table = nullptr;
  std::vector<BaseParameter> base_parameters;  // that tuning moves
  DriveBase drive;                             // of scenarios of drives
  std::vector<Cell> cells;
  std::vector<ResidualTrial> trials;
  std::vector<ReadingGap> gaps;
  std::size_t sessions = 0;
  bool free_commands = false;  // hardly a command repeats: see free_commands.h
  PoseGrid grid;               // of the logged positions
  NoiseEstimate noise;         // by which rows are whitened and dependences judged
  // By which trials are scored and the models written predict, where that is another one:
  // drives or readings with heavy tails.
  std::optional<NoiseEstimate> predictive;
  bool reading_noise_known = true;     // from gaps between readings, rather than the config's
  Overrides base;                      // tuned values
  double speed_m_s = 0;                // tuned full speed
  double scale = 1;                    // of lengths of the robot (TrackedTable::scale())
  std::vector<std::size_t> on_bounds;  // rows of the base that tuning left on their bounds
  Eigen::Index misfit_columns = 0;     // last nuisances: what repeats of a trial have in common
  double misfit_expected = 0;          // of their priors: what a sound simulation may miss
  // Of push logs: what a relative change of each of these parameters moves the base's ends by.
  std::vector<RetunedPush> retuned;
  std::vector<Eigen::Matrix3d> whitener;  // L^-1 of each trial's covariance L L'
  double session_spread = 0;  // of gains that each session has of its own; 0: none is known
  std::vector<bool> ignored;  // trials that no fit may learn from; empty: none
  std::vector<double> trust;  // factor of each trial's whitener, (0, 1]; empty: 1

  std::size_t size() const { return trials.size(); }
  const NoiseEstimate& predictive_noise() const { return predictive ? *predictive : noise; }
  // Three rows a trial.
  Eigen::VectorXd whiten(const std::vector<Eigen::Vector3d>& values) const;
  std::vector<Eigen::Vector3d> residuals() const;
  Eigen::VectorXd whitened_residuals() const { return whiten(residuals()); }
  // Of the measured ends, were they predicted there.
  std::vector<Eigen::Vector3d> residuals_about(const std::vector<Pose>& ends) const;
  void use_residuals(const std::vector<Eigen::Vector3d>& residuals);
  std::vector<Pose> predicted_ends() const;
  // With the residuals about them.
  void use_predicted_ends(const std::vector<Pose>& ends);
  bool ignores(std::size_t trial) const { return !ignored.empty() && ignored[trial]; }
  // Zeroes the rows of ignored trials.
  void drop_ignored(Eigen::Ref<Eigen::MatrixXd> rows) const;
  // From whitened rows back to metres and radians.
  std::vector<Eigen::Vector3d> unwhiten(const Eigen::VectorXd& rows) const;
  std::vector<Eigen::Matrix3d> covariances() const;
  // Whitener and covariances from the present noise.
  void use_noise(const NoiseEstimate& estimate);
  // The same values as these rows, which `other`, a study of the same trials, whitened.
  Eigen::MatrixXd rewhitened(const Study& other, const Eigen::MatrixXd& rows) const;
};

// Cells, contexts and reading noise of the problem's log.  Errors: an empty log.  `genes`: what the
// config has searched.
Result<Study> make_study(const Problem& problem, std::span<const Gene> genes);

// Tunes the base parameters by fit_jointly(), or keeps those of the problem, and fills in
// predictions, residuals and gain derivatives.
Status tune_base(Predictor& predictor, bool keep, Study* study);

// Where a parameter may be tuned to; a program may declare narrow bounds.
std::pair<double, double> tunable(const Parameter& p);

// Rows of the base's parameters whose value in `at` lies where tuning has to stop.
std::vector<std::size_t> base_on_bounds(const Study& study, const Overrides& at);

// From the first ends to the others, in the axes of the first, divided by `scale`.
std::vector<Eigen::Vector3d> differences(const std::vector<Pose>& from, const std::vector<Pose>& to,
                                         double scale = 1);

}  // namespace gapfarm
