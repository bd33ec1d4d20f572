#include "common/residual/field.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gapfarm {
namespace {

using Facts = LoggedMotion;

double reversed(int last, double duty) { return last * duty < 0 ? 1.0 : 0.0; }

constexpr std::array<ResidualCovariate, 11> kCovariates = {{
    {"x", "place along x", "m", false, true, [](const Facts&, const Pose& X) { return X.x; }},
    {"y", "place along y", "m", false, true, [](const Facts&, const Pose& X) { return X.y; }},
    {"heading", "heading", "rad", true, true, [](const Facts&, const Pose& X) { return X.theta; }},
    {"time", "time in the session", "s", false, false,
     [](const Facts& f, const Pose&) { return f.session_time_s; }},
    {"duration", "duration", "s", false, false,
     [](const Facts& f, const Pose&) { return f.duration_s; }},
    {"level", "greater duty", "-", false, false,
     [](const Facts& f, const Pose&) { return std::max(std::abs(f.left), std::abs(f.right)); }},
    {"left", "left duty", "-", false, false, [](const Facts& f, const Pose&) { return f.left; }},
    {"right", "right duty", "-", false, false, [](const Facts& f, const Pose&) { return f.right; }},
    {"left_reversed", "change of the left side's direction", "-", false, false,
     [](const Facts& f, const Pose&) { return f.moved ? 0 : reversed(f.last_left, f.left); }},
    {"right_reversed", "change of the right side's direction", "-", false, false,
     [](const Facts& f, const Pose&) { return f.moved ? 0 : reversed(f.last_right, f.right); }},
    {"moved", "unrecorded move before", "-", false, false,
     [](const Facts& f, const Pose&) { return f.moved ? 1.0 : 0.0; }},
}};

// How high each centre's bump is for one pose.
Eigen::VectorXd bumps(const ResidualTerm& term, const LoggedMotion& facts, const Pose& X_WR) {
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(term.centres.rows());
  for (std::size_t j = 0; j < term.covariates.size(); ++j) {
    const ResidualCovariate& covariate = kCovariates[term.covariates[j]];
    const double value = covariate.value(facts, X_WR);
    for (Eigen::Index k = 0; k < squares.size(); ++k) {
      const double away = value - term.centres(k, static_cast<Eigen::Index>(j));
      const double d = (covariate.cyclic ? 2 * std::sin(away / 2) : away) / term.lengths[j];
      squares[k] += d * d;
    }
  }
  return (-0.5 * squares.array()).exp();
}

const ResidualWeights* weights_of(const ResidualTerm& term, const std::string& command) {
  for (const ResidualWeights& w : term.weights) {
    if (w.command.empty() || w.command == command) return &w;
  }
  return nullptr;
}

}  // namespace

std::span<const ResidualCovariate> residual_covariates() { return kCovariates; }

const std::vector<std::string>& residual_frame_names() {
  static const std::vector<std::string> names = {"robot", "world", "readings", "motion"};
  return names;
}

double drive_s(const LoggedMotion& facts) {
  return std::max(std::abs(facts.left), std::abs(facts.right)) * facts.duration_s;
}

Eigen::VectorXd residual_features(const ResidualTerm& term, const LoggedMotion& facts,
                                  const Pose& X_WE) {
  Eigen::VectorXd features = bumps(term, facts, facts.X_WS);
  if (term.frame == ResidualFrame::kReadings) {
    features = bumps(term, facts, X_WE) - features;
  }
  if (term.by_drive) features *= drive_s(facts);
  return features;
}

Eigen::Matrix3d residual_axes(ResidualFrame frame, const Pose& X_WS, const Pose& X_WE) {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  if (frame == ResidualFrame::kRobot) return axes;
  if (frame == ResidualFrame::kMotion) {
    // The start is as far behind the end as the end is ahead of the start.
    const Pose back = between(X_WE, X_WS);
    return Eigen::Vector3d(-back.x, -back.y, -back.theta).asDiagonal();
  }
  const double c = std::cos(X_WE.theta), s = std::sin(X_WE.theta);
  axes.topLeftCorner<2, 2>() << c, s, -s, c;
  return axes;
}

Eigen::Vector3d residual_shift(const ResidualField& field, const LoggedMotion& facts,
                               const Pose& X_WE) {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (const ResidualTerm& term : field) {
    const ResidualWeights* weights = weights_of(term, facts.command);
    if (weights == nullptr) continue;
    const Eigen::VectorXd features = residual_features(term, facts, X_WE);
    shift += residual_axes(term.frame, facts.X_WS, X_WE) * (weights->shifts.transpose() * features);
  }
  return shift;
}

Pose corrected_end(const ResidualField& field, const LoggedMotion& facts, const Pose& X_WE) {
  if (field.empty()) return X_WE;
  const Eigen::Vector3d shift = residual_shift(field, facts, X_WE);
  return X_WE * Pose{shift[0], shift[1], shift[2]};
}

}  // namespace gapfarm
