// Whether a correction can be used.
#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/suggest.h"
#include "common/residual/field.h"

namespace gapfarm {
namespace {

std::string plain(double value) {
  std::string text = std::to_string(value);
  return text;
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
      return Error{where + " has length " + plain(length) + "; expected one between 1e-9 and 1e9"};
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

Status check_residual(const ResidualField& field, std::span<const std::string> commands) {
  if (field.size() > kMostResidualTerms) {
    return Error{"residual has " + std::to_string(field.size()) + " terms, expected at most " +
                 std::to_string(kMostResidualTerms)};
  }
  for (std::size_t i = 0; i < field.size(); ++i) {
    const ResidualTerm& term = field[i];
    const std::string where = "residual term " + std::to_string(i + 1);
    if (Status s = check_covariates(term, where); !s) return s;
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
    if (Status s = check_weights(term, commands, where); !s) return s;
  }
  return {};
}

}  // namespace gapfarm
