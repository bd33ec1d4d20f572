#include "master/diagnose/headline.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "master/diagnose/spread_row.h"
#include "master/sanity/words.h"

namespace gapfarm {
namespace {

constexpr std::size_t kLine = 100;  // characters, about what fits on one line in large print
constexpr double kDegreesEach = 180 / std::numbers::pi;

// Of driven robots.
constexpr ShortWords kShort[] = {
    {"motor_asymmetry", "ratio", 100, " %", "The right side runs % faster than the left",
     "The left side runs % faster than the right", "Trim the faster side's duty by %"},
    {"motor_deadband", "duty", 100, " %", "Duty below % moves nothing", nullptr,
     "Add % of duty to every command"},
    {"motor_lag", "tau", 1000, " ms", "The motors follow their duty with a lag of %", nullptr,
     "Give the simulated motors that lag"},
    {"timing_offset", "offset", 1000, " ms", "The motors run % longer than told",
     "The motors run % shorter than told", "Correct the commanded time by %"},
    {"battery_sag", "rate", 100, " %", "The battery loses % of its speed a minute",
     "The robot gains % of its speed a minute", "Charge before a session, or keep sessions short"},
    {"backlash", "travel", 1000, " mm", "A side that changes direction first loses % of travel",
     nullptr, "Take up the play before a drive"},
    {"slip_events", "probability", 100, " %", "In % of the drives a side slips", nullptr,
     "Clean the treads and the floor"},
    {"floor_tilt", "angle", 1000, " mrad", "The floor slopes by %", nullptr, "Level the floor"},
    {"floor_nap", "strength", 100, " %", "The floor has a nap that drags with % of the weight",
     nullptr, "Drive on a floor without pile"},
    {"friction_patch", "ratio", 1, "", "A patch of the floor has % times the friction", nullptr,
     "Look at the floor there"},
    {"rolling_resistance", "coefficient", 100, " %", "Rolling drags with % of the weight", nullptr,
     "Give the simulation that drag"},
    {"com_offset", "x", 1000, " mm", "The centre of mass is off the middle of the treads", nullptr,
     "Weigh the robot's ends, or move its load"},
    {"camera_aspect", "ratio", 1, "", "The camera's y scale is % times its x scale", nullptr,
     "Calibrate the camera's scales"},
    {"camera_distortion", "k1", 1, "", "The camera's lens bends positions", nullptr,
     "Calibrate the lens"},
    {"camera_seam", "position", 1, " m", "Two cameras disagree at @ = %",
     "Two cameras disagree at @ = −%", "Calibrate the cameras against each other at the seam"},
    {"heading_offset", "angle", 1000, " mrad", "The marker is turned % to the left on the robot",
     "The marker is turned % to the right on the robot", "Turn the marker back by %"},
    {"marker_offset", "x", 1000, " mm", "The marker is not over the turning centre", nullptr,
     "Move the marker, or correct its poses"},
    {"pose_latency", "share", 100, " %", "% of the poses were read too early", nullptr,
     "Let the robot rest before its pose is read"},
    {"pose_quantisation", "step", 1000, " mm", "Positions are rounded to %", nullptr,
     "Log more digits"},
};

// Null where it has none, or where `diagnosis` is of something else than drives.
const ShortWords* short_words(const Diagnosis& diagnosis, std::string_view effect) {
  if (!diagnosis.words.ends.empty()) return nullptr;
  const auto* found = std::find_if(std::begin(kShort), std::end(kShort),
                                   [&](const ShortWords& w) { return w.effect == effect; });
  if (found != std::end(kShort)) return found;
  const SpreadRow* row = spread_row(effect);
  return row == nullptr ? nullptr : &row->short_words;
}

const Estimate* size_of(const NamedEffect& effect, const ShortWords& words) {
  for (const Estimate& e : effect.parameters) {
    if (e.key == words.key && std::isfinite(e.value)) return &e;
  }
  return nullptr;
}

std::string filled(const char* text, const NamedEffect& effect, const ShortWords& words,
                   double value) {
  std::string line;
  for (const char* c = text; *c != 0; ++c) {
    if (*c == '%') {
      line += plain_number(std::abs(words.factor * value)) + words.unit;
    } else if (*c == '@') {
      line += effect.axis.empty() ? "the seam" : effect.axis;
    } else {
      line += *c;
    }
  }
  return line;
}

std::string cause_of(const Diagnosis& d, const NamedEffect& effect, const EffectWordsByName* own) {
  const ShortWords* words = short_words(d, effect.name);
  const Estimate* size = words != nullptr ? size_of(effect, *words) : nullptr;
  if (size == nullptr) return effect_claim(effect, own);
  const bool opposite = size->value < 0 && words->opposite != nullptr;
  std::string line = filled(opposite ? words->opposite : words->cause, effect, *words, size->value);
  for (const Estimate& e : effect.parameters) {
    if (effect.name == "floor_tilt" && e.key == "direction") {
      line += " toward " + plain_number(std::round(kDegreesEach * e.value)) + " degrees";
    }
  }
  return line;
}

std::string first_cause(const Diagnosis& d, const EffectWordsByName* own) {
  if (d.effects.empty()) return "The readings, not the robot, are odd";
  std::string line = cause_of(d, d.effects.front(), own);
  std::string others;
  for (std::size_t i = 1; i < d.effects.size(); ++i) {
    others += (i > 1 ? ", " : "; also ") + d.effects[i].name;
  }
  if (line.size() + others.size() > kLine) {
    const std::size_t more = d.effects.size() - 1;
    others = "; " + std::to_string(more) + (more == 1 ? " more cause" : " more causes");
  }
  return line + others;
}

// What keeps the diagnosis from naming anything; null where nothing does.
const SanityFinding* doubt_of(const Diagnosis& d) {
  const bool doubtful = d.verdict == Verdict::kUnusable || d.verdict == Verdict::kUnknown;
  if (!doubtful || d.sanity.empty() || d.sanity.front().severity == Severity::kNote) return nullptr;
  return &d.sanity.front();
}

}  // namespace

std::string headline(const Diagnosis& diagnosis, const EffectWordsByName* words) {
  const SanityFinding* doubt = doubt_of(diagnosis);
  switch (diagnosis.verdict) {
    case Verdict::kUnusable:
      return "Not usable as it is: " +
             (doubt != nullptr ? finding_phrase(*doubt) : "something is wrong with it") + ".";
    case Verdict::kNone:
      return "Nothing is missing that these data could show.";
    case Verdict::kUnknown:
      if (doubt != nullptr) return "No cause can be named: " + finding_phrase(*doubt) + ".";
      return "Something is missing that no effect of the catalogue explains.";
    case Verdict::kEffect:
      return first_cause(diagnosis, words) + ".";
    case Verdict::kEffectAndUnknown:
      return first_cause(diagnosis, words) + "; something more is unexplained.";
  }
  return "";
}

std::string action(const Diagnosis& diagnosis) {
  if (const SanityFinding* doubt = doubt_of(diagnosis); doubt != nullptr) return doubt->remedy;
  if (diagnosis.effects.empty()) {
    if (diagnosis.verdict == Verdict::kNone) {
      return "Use tuned.toml as it is; only more trials, or other ones, could show more.";
    }
    if (diagnosis.where.empty()) return "Look at the worst drives below.";
    const Where& w = diagnosis.where.front();
    return "Look first at how " + (w.command == "all" ? "all commands" : w.command) +
           (w.covariate.empty() ? " miss" : " depend on " + w.covariate) +
           ": the first row under where the model goes wrong.";
  }
  const NamedEffect& first = diagnosis.effects.front();
  if (!first.aliases.empty() && !diagnosis.next.empty() && diagnosis.next.front().trials > 0) {
    return "Drive the " + std::to_string(diagnosis.next.front().trials) +
           " trials under what to try next: they tell " + first.name + " from " +
           first.aliases.front() + ".";
  }
  const ShortWords* words = short_words(diagnosis, first.name);
  const Estimate* size = words != nullptr ? size_of(first, *words) : nullptr;
  const std::string paste = "paste the parameters below into your config.";
  if (size == nullptr) return "P" + paste.substr(1);
  return filled(words->remedy, first, *words, size->value) + ", or " + paste;
}

void tell(const EffectWordsByName* words, Diagnosis* diagnosis) {
  diagnosis->headline = headline(*diagnosis, words);
  diagnosis->action = action(*diagnosis);
  diagnosis->findings = findings(*diagnosis);
}

}  // namespace gapfarm
