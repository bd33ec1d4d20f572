// A reselection at what is called unknown: from a base that nothing draws to itself, or without
// what proved worthless.

#include <algorithm>

#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {
namespace {

// Nothing where the reselection does not explain everything, or cannot be simulated.
Result<std::optional<Reselection>> look_again(const DiagnosisRequest& of, const Evidence& measured,
                                              bool free_base) {
  const auto unless_it_fell = [](const Error& error) -> Result<std::optional<Reselection>> {
    if (error.code == ErrorCode::kSimulation) return std::optional<Reselection>();
    return error;
  };
  auto screening = screen(of, measured, free_base);
  if (!screening) return unless_it_fell(screening.error());
  const auto judged = judge(of, *screening);
  if (!judged) return unless_it_fell(judged.error());
  if (judged->verdict != Verdict::kEffect) return std::optional<Reselection>();
  auto refitted = refit(of, measured, *screening, *judged);
  if (!refitted) return unless_it_fell(refitted.error());
  if (refitted->judged.verdict != Verdict::kEffect) return std::optional<Reselection>();
  return std::optional<Reselection>(Reselection{std::move(*screening), std::move(*refitted)});
}

}  // namespace

// What acts in a place leaves the base where it is.
bool draws_base(const DiagnosisRequest& of, const Judgement& judgement) {
  const std::vector<ChosenEffect>& chosen = judgement.unnamed;
  if (chosen.empty() || judgement.left.empty()) return false;
  const Signature& strongest = chosen.front().candidate.signature;
  if (!of.subject.effects->row(strongest.effect).places.empty()) return false;
  double gained = 0;
  for (const ChosenEffect& c : chosen) gained += c.candidate.gain;
  return gained > judgement.left.front().excess;
}

Result<std::optional<Reselection>> look_from_free_base(const DiagnosisRequest& of,
                                                       const Evidence& measured,
                                                       const Judgement& judgement) {
  const bool was_free = of.subject.base_moves || !measured.study.on_bounds.empty();
  if (judgement.verdict != Verdict::kUnknown || was_free || of.options.keep_base ||
      !draws_base(of, judgement)) {
    return std::optional<Reselection>();
  }
  return look_again(of, measured, /*free_base=*/true);
}

Result<std::optional<Reselection>> reselect_without_dropped(const DiagnosisRequest& of,
                                                            const Evidence& measured,
                                                            const Screening& screening,
                                                            const Refit& refit) {
  const Judgement& judged = refit.judged;
  const std::vector<ChosenEffect>& chosen = screening.found.chosen;
  if (of.subject.signatures == nullptr || chosen.empty() || !judged.unnamed.empty() ||
      judged.named.names_anything() || !judged.warnings.empty() ||
      judged.verdict != Verdict::kUnknown) {
    return std::optional<Reselection>();
  }
  DiagnoseOptions options = of.options;
  for (const ChosenEffect& c : chosen) options.excluded.push_back(c.candidate.signature.effect);
  const DiagnosisRequest rest{of.farm, of.predictor, of.problem, of.subject, options, of.frame_m};
  auto second = look_again(rest, measured, /*free_base=*/false);
  if (!second || !*second) return second;
  // What was dropped stays in the table.
  std::vector<Screened>& rows = (*second)->screening.rows;
  for (const Screened& row : screening.rows) {
    const auto is_there = [&](const Screened& other) { return other.effect == row.effect; };
    if (std::none_of(rows.begin(), rows.end(), is_there)) rows.push_back(row);
  }
  return second;
}

}  // namespace gapfarm::steps
