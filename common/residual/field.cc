#include "common/residual/field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "common/base/text.h"

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
      const double away = value - term.centres(k, j);
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

// Of 1 m and of half a turn a correction is a mistake.
constexpr double kMostShift = 1e3;

Status check_covariates(const ResidualTerm& term, const std::string& where) {
  const auto known = residual_covariates();
  if (term.covariates.empty()) {
    return Error{where + " has no covariates; name at least one, such as \"heading\""};
  }
  for (std::size_t j = 0; j < term.covariates.size(); ++j) {
    if (term.covariates[j] >= known.size()) {
      return Error{where + " has covariate number " + std::to_string(term.covariates[j]) +
                   ", of which this build knows " + std::to_string(known.size()) +
                   "; master and worker must be the same build"};
    }
    const ResidualCovariate& covariate = known[term.covariates[j]];
    if (std::count(term.covariates.begin(), term.covariates.end(), term.covariates[j]) > 1) {
      return Error{where + " names covariate '" + covariate.name + "' twice; name it once"};
    }
    if (term.frame == ResidualFrame::kReadings && !covariate.of_reading) {
      return Error{where + " has frame \"readings\" and covariate '" + covariate.name +
                   "', which no reading has; expected x, y or heading there"};
    }
  }
  if (term.lengths.size() != term.covariates.size()) {
    return Error{where + " has " + std::to_string(term.lengths.size()) + " lengths for " +
                 std::to_string(term.covariates.size()) + " covariates; give one a covariate"};
  }
  for (const double length : term.lengths) {
    if (!(length > 1e-9 && length < 1e9)) {
      return Error{where + " has length " + std::to_string(length) +
                   "; expected one between 1e-9 and 1e9"};
    }
  }
  return {};
}

Status check_weights(const ResidualTerm& term, std::span<const std::string> commands,
                     const std::string& where) {
  if (term.weights.empty()) {
    return Error{where + " has no weights; give those of \"all\" or of a command"};
  }
  std::set<std::string> seen;
  for (const ResidualWeights& w : term.weights) {
    const std::string of = w.command.empty() ? "all" : w.command;
    if (!w.command.empty() &&
        std::find(commands.begin(), commands.end(), w.command) == commands.end()) {
      return Error{where + " has weights of command '" + of + "', which the model does not have" +
                   suggestion(w.command, {commands.begin(), commands.end()})};
    }
    if (!seen.insert(of).second) return Error{where + " has weights of '" + of + "' twice"};
    if (w.shifts.rows() != term.centres.rows() || w.shifts.cols() != 3) {
      return Error{where + ": weights of '" + of + "' are " + std::to_string(w.shifts.rows()) +
                   " rows of " + std::to_string(w.shifts.cols()) + ", expected " +
                   std::to_string(term.centres.rows()) + " rows of 3, one a centre"};
    }
    if (!w.shifts.allFinite() || w.shifts.cwiseAbs().maxCoeff() > kMostShift) {
      return Error{where + ": weights of '" + of +
                   "' hold a number that is not finite or beyond 1000; they are m, m and rad"};
    }
    if (term.frame == ResidualFrame::kReadings && !w.shifts.col(2).isZero(0)) {
      return Error{where + ": weights of '" + of +
                   "' turn headings, which frame \"readings\" does not; make the third number 0"};
    }
  }
  if (seen.count("all") > 0 && seen.size() > 1) {
    return Error{where + " has weights of \"all\" and of single commands; keep either"};
  }
  return {};
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

Status check_residual(const ResidualField& field, std::span<const std::string> commands) {
  if (field.size() > kMostResidualTerms) {
    return Error{"residual has " + std::to_string(field.size()) + " terms, expected at most " +
                 std::to_string(kMostResidualTerms)};
  }
  for (std::size_t i = 0; i < field.size(); ++i) {
    const ResidualTerm& term = field[i];
    const std::string where = "residual term " + std::to_string(i + 1);
    RETURN_IF_ERROR(check_covariates(term, where));
    const auto count = static_cast<std::size_t>(term.centres.rows());
    if (count == 0 || count > kMostResidualCentres) {
      return Error{where + " has " + std::to_string(count) + " centres, expected 1 to " +
                   std::to_string(kMostResidualCentres)};
    }
    if (static_cast<std::size_t>(term.centres.cols()) != term.covariates.size() ||
        !term.centres.allFinite()) {
      return Error{where + " has centres that are not " + std::to_string(term.covariates.size()) +
                   " finite numbers each; give one number a covariate"};
    }
    const bool own = term.frame == ResidualFrame::kReadings || term.frame == ResidualFrame::kMotion;
    if (own && term.by_drive) {
      return Error{where + " has frame \"" +
                   residual_frame_names()[static_cast<std::size_t>(term.frame)] +
                   "\" and by_drive = true; that frame has its own measure, so leave by_drive out"};
    }
    RETURN_IF_ERROR(check_weights(term, commands, where));
  }
  return {};
}

}  // namespace gapfarm
