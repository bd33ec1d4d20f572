// A second look at what is called unknown, from a base that nothing draws to itself.

#include <algorithm>

#include "master/diagnose/step_parts.h"

namespace gapfarm::steps {

// What acts in a place leaves the base where it is.
bool draws_base(const Inquiry& of, const Judgement& judgement) {
  const std::vector<ChosenEffect>& chosen = judgement.unnamed;
  if (chosen.empty() || judgement.left.empty()) return false;
  const Signature& strongest = chosen.front().candidate.signature;
  if (!of.subject.effects->row(strongest.effect).places.empty()) return false;
  double gained = 0;
  for (const ChosenEffect& c : chosen) gained += c.candidate.gain;
  return gained > judgement.left.front().excess;
}

Result<std::optional<Freed>> look_from_free_base(const Inquiry& of, const Evidence& measured,
                                                 const Judgement& judgement) {
  const bool was_free = of.subject.base_moves || !measured.study.on_bounds.empty();
  if (judgement.verdict != Verdict::kUnknown || was_free || of.options.keep_base ||
      !draws_base(of, judgement)) {
    return std::optional<Freed>();
  }
  const auto unless_it_fell = [](const Error& error) -> Result<std::optional<Freed>> {
    if (error.code == ErrorCode::kSimulation) return std::optional<Freed>();
    return error;
  };
  auto screening = screen(of, measured, /*free_base=*/true);
  if (!screening) return unless_it_fell(screening.error());
  const auto judged = judge(of, *screening);
  if (!judged) return unless_it_fell(judged.error());
  if (judged->verdict != Verdict::kEffect) return std::optional<Freed>();
  auto refitted = refit(of, measured, *screening, *judged);
  if (!refitted) return unless_it_fell(refitted.error());
  if (refitted->judged.verdict != Verdict::kEffect) return std::optional<Freed>();
  return std::optional<Freed>(Freed{std::move(*screening), std::move(*refitted)});
}

}  // namespace gapfarm::steps
