// What a diagnosis found, in plain language.
#pragma once

#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/ranges.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/evidence/covariates.h"
#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// Of twelve.
int sector_of(double angle_rad);

// How many different things `of` makes of the items.
template <class Range, class Of>
std::size_t distinct(const Range& range, Of of) {
  const auto all = mapped(range, of);
  return std::set(all.begin(), all.end()).size();
}

// The sentences that apply.
std::vector<std::string> stated(const std::vector<std::pair<bool, std::string>>& sentences);

// "3.14" to three significant digits, without trailing zeros and exponents where it can be read.
std::string plain_number(double value);
// "1 side", "2 sides".
std::string counted(std::size_t count, const std::string& one, const std::string& many);
// "once", "about 2.5 times".
std::string times_text(double times);
// "a", "a and b", "a, b and c".
std::string listed(std::span<const std::string> phrases, std::string_view last = "and");

// "Forward drives", "Clockwise turns"; "all": "All motions".
std::string motions_of(const std::string& command);
// "3.1 mm", "0.9 mrad": without its sign.  Components are 0, 1, 2 for x, y, theta here and below.
std::string amount_text(double size, int component);
// "heading", "end along its heading", "end across its heading".
std::string component_text(int component);
// "end 3.1 mm too far to the left" for a residual or, as a trend, "end 3.1 mm farther to the left";
// along the motion "turn 0.9 mrad too little" or "turn 0.9 mrad less".
std::string deviation_text(int component, double size, bool along_motion, bool trend);

// "The battery loses 0.35 % of its speed a minute (0.31 to 0.4); adding that closes 88 % of the
// gap."  Effects without words, or without their parameters, are named with what is there.
std::string effect_sentence(const NamedEffect& effect, const EffectDiagnoses& effects);

// `text`, one of its phrases, with its values put in and without a full stop.
std::string effect_claim(const NamedEffect& effect, const EffectPhrases& phrases, const char* text,
                         bool intervals);

std::vector<std::string> findings(const Diagnosis& diagnosis);

struct LogVariety {
  std::size_t trials = 0;
  std::size_t sessions = 0;
  std::size_t commands = 0;
  std::size_t durations = 0;
  std::size_t levels = 0;
  std::size_t headings = 0;   // of twelve sectors of the start heading, those with trials
  double width_m = 0;         // of the box around the starts, its greater side
  double longest_min = 0;     // of a session
  std::size_t followers = 0;  // trials that start where the one before ended
  bool times = false;         // some are logged
  bool paths = false;
  double typical_cell = 0;  // trials with the same command, duties and duration, median
};
LogVariety log_variety(std::span<const ResidualTrial> trials, std::span<const Cell> cells,
                       const TrialLog& log);

// What the log lacks and two effects would need to part: "several durations", ...
std::vector<std::string> lacking(const LogVariety& variety);

// Of the first `alike`, which explain the log about as well, and of the others, which act alike;
// empty without aliases.  `lacks`: what the log would need to part them.
std::string alias_sentence(const std::string& effect, const std::vector<std::string>& aliases,
                           std::size_t alike, std::span<const std::string> lacks);

// "There are 12 trials; below 60 ...": one sentence, where so few were made; else empty.
std::string few_trials_caution(std::size_t trials, const std::string& one, const std::string& many);

// What cannot be seen, or not be trusted, in data as thin as these; one sentence each.
std::vector<std::string> cautions(std::span<const ResidualTrial> trials,
                                  std::span<const Cell> cells, const TrialLog& log);

// Variance of what is left over the noise's, the degrees of freedom that were spent given back:
// robust, and bounded since the noise was measured.
double leftover_scale(const Regression& explained);

// Most significant first.
std::vector<Leftover> leftovers(const Regression& explained,
                                const std::vector<CovariateBlock>& blocks);

// `explained_nats`: by the named effects.  Whether they are to be believed at all is the caller's
// to drop when the verdict is kUnknown.  A leftover dependence below kUnknownLog10P is no
// chance.
Verdict judge_verdict(bool named, double explained_nats, const std::vector<Leftover>& left);

// A diagnosis in one line and one action (headline.cc).

// "Two cameras disagree at y = 1.34 m; something more is unexplained.": the likeliest cause in
// plain language, about a line long; of a log with a data-quality warning, what is wrong with it.
std::string headline(const Diagnosis& diagnosis,
                     const EffectDiagnoses& effects = drive_effect_diagnoses());

// "Correct the commanded time by 40 ms, or paste the parameters below into your config.": the one
// thing to do next.  Once next experiments are known.
std::string action(const Diagnosis& diagnosis,
                   const EffectDiagnoses& effects = drive_effect_diagnoses());

void fill_conclusions(const EffectDiagnoses& effects, Diagnosis* diagnosis);

// That an effect that gained `gain` nats beyond luck, where `least_gain` names one, is there, or
// one of its aliases: grows with the gain, and stays below 1 by what the counts leave open.
double confidence_of(double gain, double least_gain);

// The same of what the sanity stage names.
double sanity_confidence();

}  // namespace gapfarm
