#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/base/text.h"
#include "common/math/laws.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

constexpr std::size_t kLine = 100;  // characters, about what fits on one line in large print

// What its line is about; null: it has no line, or the size is not known.
const Estimate* size_of(const NamedEffect& effect, const EffectPhrases& phrases) {
  if (phrases.remedy == nullptr) return nullptr;
  const Estimate* size = find_by(effect.parameters, phrases.parameters[0].key, &Estimate::key);
  return size != nullptr && std::isfinite(size->value) ? size : nullptr;
}

std::string brief_claim(NamedEffect effect, const EffectPhrases& phrases, const char* text) {
  for (std::size_t i = 0; i < phrases.parameters.size(); ++i) {
    Estimate* e = find_by(effect.parameters, phrases.parameters[i].key, &Estimate::key);
    if (e == nullptr) continue;
    if (i == 0) e->value = std::abs(e->value);
    if (phrases.parameters[i].factor == kDegrees)  // where to, as far as anybody looks
      e->value = std::round(kDegrees * e->value) / kDegrees;
  }
  return effect_claim(effect, phrases, text, false);
}

std::string cause_of(const NamedEffect& effect, const EffectDiagnoses& effects) {
  const EffectPhrases& phrases = effects.row(effect.name).phrases;
  const Estimate* size = size_of(effect, phrases);
  if (size == nullptr) return effect_claim(effect, phrases, phrases.sentence, false);
  const bool opposite = size->value < 0 && phrases.opposite != nullptr;
  const char* brief = phrases.brief != nullptr ? phrases.brief : phrases.sentence;
  return brief_claim(effect, phrases, opposite ? phrases.opposite : brief);
}

std::string first_cause(const Diagnosis& d, const EffectDiagnoses& effects) {
  if (d.effects.empty()) return "The readings, not the robot, are odd";
  const std::string line = cause_of(d.effects.front(), effects);
  const auto more = std::span(d.effects).subspan(1);
  if (more.empty()) return line;
  const std::string others = "; also " + joined(more, ", ", &NamedEffect::name);
  if (line.size() + others.size() <= kLine) return line + others;
  return line + "; " + counted(more.size(), "more cause", "more causes");
}

// What keeps the diagnosis from naming anything; null where nothing does.
const SanityFinding* warning_of(const Diagnosis& d) {
  const bool has_warning = d.verdict == Verdict::kUnusable || d.verdict == Verdict::kUnknown;
  if (!has_warning || d.sanity.empty() || d.sanity.front().severity == Severity::kNote)
    return nullptr;
  return &d.sanity.front();
}

// What the blind checks of docs/diagnosis.md and scripts/transform_logs.py counted.
struct Counts {
  double of, hits;
};
constexpr Counts kRightNames = {99, 98};       // 36 single effects, 31 pairs
constexpr Counts kNullsWithAName = {120, 1};   // logs with nothing in them
constexpr Counts kRightWarnings = {121, 121};  // 11 logs, each the wrong way round in 11 ways

constexpr double kTail = 0.05;

// Of the posterior after Jeffreys's prior; it leaves room however good the record is.
double posterior(const Counts& c, double share) {
  return beta_quantile(c.hits + 0.5, c.of - c.hits + 0.5, share);
}
double at_least(const Counts& c) { return posterior(c, kTail); }
double at_most(const Counts& c) { return posterior(c, 1 - kTail); }

}  // namespace

std::string headline(const Diagnosis& diagnosis, const EffectDiagnoses& effects) {
  const SanityFinding* warning = warning_of(diagnosis);
  switch (diagnosis.verdict) {
    case Verdict::kUnusable:
      return "Not usable as it is: " +
             (warning != nullptr ? finding_phrase(*warning) : "something is wrong with it") + ".";
    case Verdict::kNone:
      return "Nothing is missing that these data could show.";
    case Verdict::kUnknown:
      if (warning != nullptr) return "No cause can be named: " + finding_phrase(*warning) + ".";
      return "Something is missing that no effect of the catalogue explains.";
    case Verdict::kEffect:
      return first_cause(diagnosis, effects) + ".";
    case Verdict::kEffectAndUnknown:
      return first_cause(diagnosis, effects) + "; something more is unexplained.";
  }
  return "";
}

std::string action(const Diagnosis& diagnosis, const EffectDiagnoses& effects) {
  if (const SanityFinding* warning = warning_of(diagnosis); warning != nullptr)
    return warning->remedy;
  if (diagnosis.effects.empty()) {
    if (diagnosis.verdict == Verdict::kNone) {
      return "Use tuned.toml as it is; only more trials, or other ones, could show more.";
    }
    const bool differs =
        !diagnosis.checks.empty() && diagnosis.checks.front().covariate == "session";
    if (diagnosis.verdict == Verdict::kUnknown && differs) {
      return "Diagnose each session in a file of its own: what is missing in one is not in the "
             "others.";
    }
    if (diagnosis.where.empty()) return "Look at the worst drives below.";
    const Where& w = diagnosis.where.front();
    std::string motions = motions_of(w.command);
    motions.front() = static_cast<char>(std::tolower(motions.front()));
    return "Look first at how " + motions +
           (w.covariate.empty() ? " miss" : " depend on " + w.covariate) +
           ": the first row under where the model goes wrong.";
  }
  const NamedEffect& first = diagnosis.effects.front();
  if (!first.aliases.empty() && !diagnosis.next.empty() && diagnosis.next.front().trials > 0) {
    return "Drive the " + std::to_string(diagnosis.next.front().trials) +
           " trials under what to try next: they distinguish " + first.name + " from " +
           first.aliases.front() + ".";
  }
  const EffectPhrases& phrases = effects.row(first.name).phrases;
  const std::string paste = "paste the parameters below into your config.";
  if (size_of(first, phrases) == nullptr) return "P" + paste.substr(1);
  return brief_claim(first, phrases, phrases.remedy) + ", or " + paste;
}

void fill_conclusions(const EffectDiagnoses& effects, Diagnosis* diagnosis) {
  diagnosis->headline = headline(*diagnosis, effects);
  diagnosis->action = action(*diagnosis, effects);
  diagnosis->findings = findings(*diagnosis);
}

double confidence_of(double gain, double least_gain) {
  // What luck gains falls off by e a nat.
  const double luck = at_most(kNullsWithAName) * std::exp(-std::max(0.0, gain - least_gain));
  return at_least(kRightNames) - luck;
}

double sanity_confidence() { return at_least(kRightWarnings); }

}  // namespace gapfarm
