// Tuning the base of drives.

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "master/diagnose/fit/estimate.h"
#include "master/diagnose/fit/free_commands.h"
#include "master/diagnose/fit/slopes.h"
#include "master/diagnose/study.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kGainStep = 0.02;
constexpr double kSameSlope = 0.05;   // relative: a parameter that moves the ends as the gain does
constexpr double kLeastAhead = 0.05;  // mean duty of a drive that does
// How near to its bounds a parameter may be tuned.
constexpr double kAboveLower = 1.1, kBelowUpper = 0.9;

// The turn beyond which a trial says nothing yet: a heading off by half a turn looks as if it were
// off the other way.  In the first rounds the speed of turning may be off by these shares.
double most_turn(std::vector<double> turns, int round) {
  constexpr double kSureTurn = 2;  // rad
  constexpr double kShares[] = {0.35, 0.15, 0.05};
  constexpr std::size_t kFewest = 12;
  if (round >= static_cast<int>(std::size(kShares))) return INFINITY;
  for (double& turn : turns) turn = std::abs(turn);
  std::sort(turns.begin(), turns.end());
  return std::max(kSureTurn / kShares[round], turns[std::min(kFewest, turns.size()) - 1]);
}

// Change of every end for both sides' gain, from what lesser duties would do: no duty may be more
// than full.  The parabola through three points, at its end.
Result<Slope> slope_of_duties(Predictor& predictor, const Overrides& at,
                              const std::vector<Pose>& ends) {
  ASSIGN_OR_RETURN(const auto less, predictor.attempt_slower(at, 1 - kGainStep));
  ASSIGN_OR_RETURN(const auto least, predictor.attempt_slower(at, 1 - 2 * kGainStep));
  if (!less || !least) return predictor.failed("the base model cannot be driven a little slower");
  Slope slope;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    slope.push_back(
        (local_difference(ends[i], (*least)[i]) - 4 * local_difference(ends[i], (*less)[i])) /
        (2 * kGainStep));
  }
  return slope;
}

// Of drives that go ahead: at the end of theirs they do at the speed at full duty.
double speed_by(const Study& study, const Slope& both) {
  std::vector<double> speeds;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const CommandSpec& c = study.cells[study.trials[i].cell].command;
    const double ahead = (c.left + c.right) / 2;
    if (std::abs(ahead) > kLeastAhead) speeds.push_back(both[i].x() / (ahead * c.duration_s));
  }
  return speeds.empty() ? kMeasuredSpeed_m_s : std::max(median(speeds), 1e-3);
}

// A program's parameter that does what the gain of both sides does, if it has one.
std::optional<std::size_t> speed_among(const std::vector<BaseParameter>& parameters,
                                       const std::vector<Slope>& slopes, const Slope& both) {
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    double apart = 0, all = 0;
    for (std::size_t i = 0; i < both.size(); ++i) {
      apart += (slopes[k][i] - both[i]).squaredNorm();
      all += both[i].squaredNorm();
    }
    if (all > 0 && apart < kSameSlope * kSameSlope * all) return parameters[k].row;
  }
  return std::nullopt;
}

// At the study's base: predicted ends, both sides' derivatives and the speed.  On the way to where
// `tuned` ends it may be that a robot cannot be driven with sides that differ.
Status settle(Predictor& predictor, bool tuned, Study* study) {
  ASSIGN_OR_RETURN(const auto ends, predictor.attempt({{study->base, {}}}));
  if (!ends.front()) return predictor.failed("the base model cannot be simulated");
  study->use_predicted_ends(*ends.front());
  const bool external = predictor.problem().external != nullptr;
  constexpr const char* kApart = "motor_asymmetry.ratio";
  std::vector<Probe> probes = {{"", {{kApart, kGainStep}}, {{kApart, -kGainStep}}, 2 * kGainStep}};
  for (const BaseParameter& p : study->drive.tuned) {
    if (external || p.row == study->drive.speed)
      probes.push_back(share_probe(*study, p.row, kGainStep));
  }
  ASSIGN_OR_RETURN(auto slopes, probe_all(predictor, *study, probes));
  Slope apart = std::move(slopes.front());
  slopes.erase(slopes.begin());
  Slope both;
  if (external) {
    ASSIGN_OR_RETURN(both, slope_of_duties(predictor, study->base, *ends.front()));
    study->speed_m_s = speed_by(*study, both);
    study->drive.speed = speed_among(study->drive.tuned, slopes, both);
  } else {
    study->speed_m_s = study->base.at(*study->drive.speed);
    both = std::move(slopes.front());
  }
  if (!tuned && apart.empty()) apart.assign(study->size(), Eigen::Vector3d::Zero());
  if (apart.empty() || both.empty())
    return predictor.failed("the base model's sides cannot be moved by 2 %");
  for (std::size_t i = 0; i < study->size(); ++i) {
    study->trials[i].right = both[i] / 2 + apart[i];
    study->trials[i].left = both[i] / 2 - apart[i];
  }
  study->use_predicted_ends(*ends.front());  // what sides do says how motions differ
  study->use_noise(study->noise);
  return {};
}

// Omits trials that turn too far for this round; whether there are any.
bool omit_far_turns(int round, Study* study) {
  const std::vector<double> turns =
      mapped(study->trials, [](const ResidualTrial& t) { return of_gain(t)[2]; });
  const double most = most_turn(turns, round);
  study->ignored.resize(study->size(), false);
  bool any = false;
  for (std::size_t i = 0; i < study->size(); ++i) {
    if (std::abs(turns[i]) <= most) continue;
    any = study->ignored[i] = true;
  }
  return any;
}

// Beside the misfits that any simulation has, about the base that the study begins with.
Status fit_base(Predictor& predictor, Study* study) {
  const Overrides configured = study->base;
  for (int round = 0;; ++round) {
    RETURN_IF_ERROR(settle(predictor, /*tuned=*/false, study));
    Study seen = *study;
    seen.base = configured;
    const bool some = omit_far_turns(round, &seen);
    ASSIGN_OR_RETURN(const auto fit,
                     fit_jointly(predictor, seen, {}, study->base, BaseParameters::kFitted,
                                 misfit_columns(seen), some ? 2 : kTuningRounds));
    for (const BaseParameter& p : study->drive.tuned) {
      const auto [lower, upper] = tunable((*study->table)[p.row]);
      study->base[p.row] = std::clamp(fit.at.at(p.row), lower, upper);
    }
    if (!some) return {};
  }
}

}  // namespace

std::pair<double, double> tunable(const Parameter& p) {
  const double lower = p.lower * kAboveLower, upper = p.upper * kBelowUpper;
  if (lower < upper) return {lower, upper};
  const double edge = (1 - kBelowUpper) * (p.upper - p.lower);
  return {p.lower + edge, p.upper - edge};
}

std::vector<std::size_t> base_on_bounds(const Study& study, const Overrides& at) {
  std::vector<std::size_t> rows;
  for (const BaseParameter& p : study.drive.tuned) {
    const auto [lower, upper] = tunable((*study.table)[p.row]);
    const double value = at.at(p.row);
    if (value <= lower * 1.001 || value >= upper * 0.999) rows.push_back(p.row);
  }
  return rows;
}

Status tune_base(Predictor& predictor, bool keep, Study* study) {
  const Problem& problem = predictor.problem();
  const auto begin = [&](std::size_t row) {
    if (!keep || !study->base.contains(row)) study->base[row] = problem.values[row];
  };
  for (const BaseParameter& p : study->drive.tuned) begin(p.row);
  for (const std::size_t row : study->drive.kept) begin(row);
  if (!keep) {
    if (!study->drive.tuned.empty()) RETURN_IF_ERROR(fit_base(predictor, study));
    study->on_bounds = base_on_bounds(*study, study->base);
  }
  return settle(predictor, /*tuned=*/true, study);
}

}  // namespace gapfarm
