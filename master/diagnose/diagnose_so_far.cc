// What each step found, told to who watches before there is a report.  Nothing here changes the
// run, and every number may still move.

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "common/score/statistics.h"
#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/digits.h"
#include "master/diagnose/findings.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostCandidates = 8;
constexpr std::size_t kMostPlaces = 3;

std::string three_digits(double value) { return plain_number(rounded_to_digits(value, 3)); }

// "3.1 mm and 12 mrad": root mean squares over `count` trials.
std::string misses_words(double position_squares, double heading_squares, std::size_t count) {
  const double n = static_cast<double>(std::max<std::size_t>(count, 1));
  return three_digits(1e3 * std::sqrt(position_squares / n)) + " mm and " +
         three_digits(1e3 * std::sqrt(heading_squares / n)) + " mrad (root mean square)";
}

std::vector<Eigen::Vector3d> residuals_of(const Study& study) {
  std::vector<Eigen::Vector3d> residuals;
  for (const ResidualTrial& trial : study.trials) residuals.push_back(trial.residual);
  return residuals;
}

}  // namespace

void DiagnosisRun::tell_of_stage(std::size_t k) const {
  if (!watched()) return;
  switch (k) {
    case 0:
      return tell_of_base();
    case 1:
      return tell_of_noise();
    case 2:
      tell_of_readings();
      return tell_of_choice();
    case 3:
      return tell_of_verdict();
    default:
      return;  // the report follows
  }
}

void DiagnosisRun::tell_of_base() const {
  double position = 0, heading = 0;
  for (const ResidualTrial& trial : study_.trials) {
    position += trial.residual.head<2>().squaredNorm();
    heading += trial.residual[2] * trial.residual[2];
  }
  Finding told;
  told.about = "the base model";
  told.text = fmt::format("The base model, {} {} trials, misses their ends by {}.",
                          options_.keep_base ? "as it was given and held against" : "tuned on",
                          study_.size(), misses_words(position, heading, study_.size()));
  for (const std::size_t row : study_.on_bounds) {
    told.text += " " + problem_.table()[row].key + " ended on its bound.";
  }
  told.columns = {"parameter", "value"};
  for (const auto& [row, value] : study_.base) {
    told.rows.emplace_back(problem_.table()[row].key,
                           problem_.table().format(row, rounded_to_digits(value, 4)));
  }
  options_.on_finding(std::move(told));
}

void DiagnosisRun::tell_of_noise() const {
  double position = 0, heading = 0;
  for (const Eigen::Matrix3d& cov : study_.covariances()) {
    position += cov(0, 0) + cov(1, 1);
    heading += cov(2, 2);
  }
  const std::vector<Eigen::Vector3d> residuals = residuals_of(study_);
  const double share = problem_.fitness.outlier_share;
  const double gap = floor_score(study_, share) - mean(scores_of(study_, residuals, share));
  Finding told;
  told.about = "the noise";
  told.text = fmt::format(
      "By chance alone ends would be missed by {}; beyond that, {} nats a trial are there to be "
      "explained.",
      misses_words(position, heading, study_.size()), three_digits(std::max(0.0, gap)));
  told.columns = {"noise", "standard deviation"};
  Overrides at;
  set_noise(study_.noise, &at);
  for (const auto& [row, value] : at) {
    if (value == 0) continue;
    told.rows.emplace_back(problem_.table()[row].key,
                           problem_.table().format(row, rounded_to_digits(value, 3)));
  }
  options_.on_finding(std::move(told));
  const std::vector<Where> places = subject_.where(study_, residuals, problem_);
  Finding lies{"where the gap lies", "", {}, {}};
  for (std::size_t i = 0; i < std::min(places.size(), kMostPlaces); ++i) {
    lies.text += (i == 0 ? "" : " ") + places[i].text;
  }
  if (places.empty()) lies.text = "Nothing that chance does not explain is left of the ends.";
  options_.on_finding(std::move(lies));
}

void DiagnosisRun::tell_of_readings() const {
  Finding told{"readings and single drives", "", {}, {}};
  if (latency_.gain > 0 && !first_.empty()) {
    told.text += fmt::format("{} % of the poses were read late. ",
                             plain_number(rounded_to_digits(100 * latency_.share, 2)));
  }
  if (lag_.gain > 0)
    told.text += "Paths show motors that lag by " + three_digits(lag_.tau_s) + " s. ";
  if (slip_.gain > 0) {
    told.text += fmt::format("In {} % of the drives a side slips. ",
                             plain_number(rounded_to_digits(100 * slip_.probability, 2)));
  }
  if (!odd_drives_.empty()) told.text += odd_drives_ + " ";
  if (told.text.empty()) return;
  told.text.pop_back();
  options_.on_finding(std::move(told));
}

void DiagnosisRun::tell_of_candidates(const std::vector<EffectCandidate>& candidates) const {
  if (!watched() || candidates.empty()) return;
  std::vector<const EffectCandidate*> best;
  for (const EffectCandidate& c : candidates) best.push_back(&c);
  std::stable_sort(best.begin(), best.end(),
                   [](const auto* a, const auto* b) { return a->gain > b->gain; });
  Finding told;
  told.about = "what the catalogue offers";
  told.text = fmt::format(
      "Each of {} effects on its own; one is named from {} nats over all trials on, and what looks "
      "alike is told apart by what comes next.",
      candidates.size(), plain_number(subject_.least_gain));
  told.columns = {"effect", "would gain, nats"};
  for (std::size_t i = 0; i < std::min(best.size(), kMostCandidates); ++i) {
    if (best[i]->gain <= 0) break;
    told.rows.emplace_back(best[i]->signature.effect, three_digits(best[i]->gain));
  }
  options_.on_finding(std::move(told));
}

// Sizes of the effects, as far as they have been fitted together.
void DiagnosisRun::tell_of_fit(const JointFit& fit) const {
  if (!watched()) return;
  Finding told{"effects and their sizes", "", {"parameter", "value and standard error"}, {}};
  std::vector<std::string> names;
  for (const FittedParameter& fitted : fit.parameters) {
    const Parameter& row = problem_.table()[fitted.row];
    if (row.effect.empty()) continue;
    if (std::find(names.begin(), names.end(), row.effect) == names.end()) {
      names.push_back(row.effect);
    }
    const double value = fitted.value + frame_of(row.key, fit.at);
    told.rows.emplace_back(
        row.key, problem_.table().format(fitted.row, rounded_to_digits(value, 4)) + " ± " +
                     three_digits(fitted.standard_error));
  }
  if (names.empty()) return;
  told.text = "Fitted together: " + listed(names) + ".";
  options_.on_finding(std::move(told));
}

void DiagnosisRun::tell_of_choice() const {
  std::vector<std::string> names;
  for (const ChosenEffect& c : chosen_) names.push_back(c.candidate.signature.effect);
  for (const Signature& s : first_) names.push_back(s.effect);
  if (lag_.gain > 0) names.emplace_back("motor_lag");
  if (slip_.gain > 0) names.emplace_back("slip_events");
  Finding told{"what explains the gap", "", {}, {}};
  told.text = doubted_        ? "The base is in doubt, so nothing of the catalogue is looked for."
              : names.empty() ? "Nothing of the catalogue explains more than chance does."
                              : "Chosen from the catalogue so far: " + listed(names) + ".";
  for (const ChosenEffect& c : chosen_) {
    for (const Alias& alias : c.aliases) {
      told.text += " " + c.candidate.signature.effect + " is not told from " + alias.effect + ".";
    }
  }
  options_.on_finding(std::move(told));
}

void DiagnosisRun::tell_of_verdict() const {
  tell_of_choice();
  Finding told{"what is left", "", {"what is left depends on", "log10 p"}, {}};
  for (const Leftover& l : leftovers_) {
    if (l.log10_p < subject_.unknown_log10_p) {
      told.rows.emplace_back(l.covariate, three_digits(l.log10_p));
    }
  }
  told.text = doubted_ || told.rows.empty()
                  ? "Nothing is left that chance does not explain."
                  : "Beside what was chosen the ends still depend on something, more than chance "
                    "explains.";
  if (doubted_) told.text = "Not looked at: the base is in doubt.";
  options_.on_finding(std::move(told));
}

// On trials that the fits did not see.
void DiagnosisRun::tell_of_gaps() const {
  if (!watched()) return;
  const double perfect = floor_score(nested_studies_.back(), problem_.fitness.outlier_share);
  Finding told{"how far the gap closes", "", {"predicted with", "gap, nats a trial"}, {}};
  for (std::size_t k = 0; k < nested_scores_.size() && k < result_.fits.size(); ++k) {
    told.rows.emplace_back(result_.fits[k].first, three_digits(perfect - mean(nested_scores_[k])));
  }
  told.text = nested_scores_.size() == 1
                  ? "No effect is left beside the base, which trials that a fit did not see miss "
                    "by so much:"
                  : "On trials that a fit did not see, one effect after the other:";
  options_.on_finding(std::move(told));
}

}  // namespace gapfarm
