#include "master/diagnose/steps/watch.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

constexpr std::size_t kMostCandidates = 8;
constexpr std::size_t kMostPlaces = 3;

bool watched(const DiagnosisRequest& of) { return of.options.on_finding != nullptr; }

std::string three_digits(double value) { return plain_number(rounded_to_digits(value, 3)); }

// "3.1 mm and 12 mrad (root mean square)".
std::string misses_text(const RootMeanSquare& error) {
  return three_digits(error.position_mm) + " mm and " + three_digits(error.heading_mrad) +
         " mrad (root mean square)";
}

}  // namespace

void emit_base(const DiagnosisRequest& of, const Study& study) {
  if (!watched(of)) return;
  Finding finding;
  finding.about = "the base model";
  finding.text = fmt::format("The base model, {} {} trials, misses their ends by {}.",
                             of.options.keep_base ? "as it was given and held against" : "tuned on",
                             study.size(), misses_text(root_mean_square(study.residuals())));
  for (const std::size_t row : study.on_bounds) {
    finding.text += " " + of.table()[row].key + " ended on its bound.";
  }
  finding.columns = {"parameter", "value"};
  for (const auto& [row, value] : study.base) {
    finding.rows.emplace_back(of.table()[row].key,
                              of.table().format(row, rounded_to_digits(value, 4)));
  }
  of.options.on_finding(std::move(finding));
}

void emit_noise(const DiagnosisRequest& of, const Study& study) {
  if (!watched(of)) return;
  const std::vector<Eigen::Vector3d> residuals = study.residuals();
  const double share = of.outlier_share();
  const double gap = floor_score(study, share) - mean(scores_of(study, residuals, share));
  Finding finding;
  finding.about = "the noise";
  finding.text = fmt::format(
      "By chance alone ends would be missed by {}; beyond that, {} nats a trial are there to be "
      "explained.",
      misses_text(error_of_noise(study)), three_digits(std::max(0.0, gap)));
  finding.columns = {"noise", "standard deviation"};
  Overrides at;
  set_noise(of, study.noise, &at);
  for (const auto& [row, value] : at) {
    if (value == 0) continue;
    finding.rows.emplace_back(of.table()[row].key,
                              of.table().format(row, rounded_to_digits(value, 3)));
  }
  of.options.on_finding(std::move(finding));
  const std::vector<Where> places = of.subject.where(study, residuals, of.problem);
  Finding lies{"where the gap lies", "", {}, {}};
  for (std::size_t i = 0; i < std::min(places.size(), kMostPlaces); ++i) {
    lies.text += (i == 0 ? "" : " ") + places[i].text;
  }
  if (places.empty()) lies.text = "Nothing that chance does not explain is left of the ends.";
  of.options.on_finding(std::move(lies));
}

void emit_readings(const DiagnosisRequest& of, const Explanation& found) {
  if (!watched(of)) return;
  Finding finding{"readings and single drives", "", {}, {}};
  if (found.spread("pose_latency") != nullptr) {
    finding.text += fmt::format("{} % of the poses were read late. ",
                                plain_number(rounded_to_digits(100 * found.latency.share, 2)));
  }
  if (found.spread("motor_lag") != nullptr)
    finding.text += "Paths show motors that lag by " + three_digits(found.lag.tau_s) + " s. ";
  if (const FoundSpread* slips = found.spread("slip_events")) {
    finding.text +=
        fmt::format("Each side slips in {} % of the drives. ",
                    plain_number(rounded_to_digits(100 * slips->fit.estimates[0].value, 2)));
  }
  if (!found.odd_drives.empty()) finding.text += found.odd_drives + " ";
  if (finding.text.empty()) return;
  finding.text.pop_back();
  of.options.on_finding(std::move(finding));
}

void emit_candidates(const DiagnosisRequest& of, const std::vector<EffectCandidate>& candidates) {
  if (!watched(of) || candidates.empty()) return;
  std::vector<const EffectCandidate*> best;
  for (const EffectCandidate& c : candidates) best.push_back(&c);
  std::ranges::stable_sort(best, [](const auto* a, const auto* b) { return a->gain > b->gain; });
  Finding finding;
  finding.about = "what the catalogue offers";
  finding.text = fmt::format(
      "Each of {} effects on its own; one is named from {} nats over all trials on, and what looks "
      "alike is distinguished by what comes next.",
      candidates.size(), plain_number(of.subject.least_gain));
  finding.columns = {"effect", "would gain, nats"};
  for (std::size_t i = 0; i < std::min(best.size(), kMostCandidates); ++i) {
    if (best[i]->gain <= 0) break;
    finding.rows.emplace_back(best[i]->effect(), three_digits(best[i]->gain));
  }
  of.options.on_finding(std::move(finding));
}

void emit_fit(const DiagnosisRequest& of, const JointFit& fit) {
  if (!watched(of)) return;
  Finding finding{"effects and their sizes", "", {"parameter", "value and standard error"}, {}};
  std::vector<std::string> names;
  for (const FittedParameter& fitted : fit.parameters) {
    const Parameter& row = of.table()[fitted.row];
    if (row.effect.empty()) continue;
    if (!contains(names, row.effect)) {
      names.push_back(row.effect);
    }
    const double value = fitted.value + of.frame_of(row.key, fit.at);
    finding.rows.emplace_back(row.key, of.table().format(fitted.row, rounded_to_digits(value, 4)) +
                                           " ± " + three_digits(fitted.standard_error));
  }
  if (names.empty()) return;
  finding.text = "Fitted together: " + listed(names) + ".";
  of.options.on_finding(std::move(finding));
}

void emit_choice(const DiagnosisRequest& of, const Explanation& found, bool has_warnings) {
  if (!watched(of)) return;
  std::vector<std::string> names;
  for (const EffectCandidate& c : found.chosen) names.push_back(c.effect());
  for (const FoundSpread& s : found.spreads) names.push_back(s.effect);
  Finding finding{"what explains the gap", "", {}, {}};
  finding.text = has_warnings
                     ? "The base is in question, so nothing of the catalogue is looked for."
                 : names.empty() ? "Nothing of the catalogue explains more than chance does."
                                 : "Chosen from the catalogue so far: " + listed(names) + ".";
  for (const EffectCandidate& c : found.chosen) {
    for (const std::string& alias : c.aliases) {
      finding.text += " " + c.effect() + " is not distinguished from " + alias + ".";
    }
  }
  of.options.on_finding(std::move(finding));
}

void emit_verdict(const DiagnosisRequest& of, const Judgement& judged) {
  if (!watched(of)) return;
  const bool has_warnings = !judged.warnings.empty();
  emit_choice(of, judged.named, has_warnings);
  Finding finding{"what is left", "", {"what is left depends on", "log10 p"}, {}};
  for (const Leftover& l : judged.left) {
    if (l.log10_p < kUnknownLog10P) {
      finding.rows.emplace_back(l.covariate, three_digits(l.log10_p));
    }
  }
  finding.text =
      has_warnings || finding.rows.empty()
          ? "Nothing is left that chance does not explain."
          : "Beside what was chosen the ends still depend on something, more than chance explains.";
  if (has_warnings) finding.text = "Not looked at: the base is in question.";
  of.options.on_finding(std::move(finding));
}

void emit_gaps(const DiagnosisRequest& of, const std::vector<NestedFit>& nested) {
  if (!watched(of)) return;
  const double perfect = floor_score(nested.back().study, of.outlier_share());
  Finding finding{"how far the gap closes", "", {"predicted with", "gap, nats a trial"}, {}};
  for (const NestedFit& n : nested) {
    finding.rows.emplace_back(n.name, three_digits(perfect - mean(n.scores)));
  }
  finding.text = nested.size() == 1
                     ? "No effect is left beside the base, which trials that a fit did not see "
                       "miss by so much:"
                     : "On trials that a fit did not see, one effect after the other:";
  of.options.on_finding(std::move(finding));
}

}  // namespace gapfarm::steps
