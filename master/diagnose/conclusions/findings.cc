#include "master/diagnose/conclusions/findings.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "common/base/text.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "common/pose/pose.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/fit/free_commands.h"
#include "master/diagnose/fit/proposals.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr std::size_t kFewTrialsToJudge = 60;

std::string estimate_text(const Estimate& e, double factor, const std::string& unit,
                          bool intervals) {
  std::string text = plain_number(factor * e.value) + unit;
  if (!intervals || !std::isfinite(e.lo) || !std::isfinite(e.hi) || !(e.lo < e.hi)) return text;
  return text + " (" + plain_number(factor * e.lo) + " to " + plain_number(factor * e.hi) + ")";
}

// Without the words of a table: "name with key value unit, ...".
std::string plain_claim(const NamedEffect& effect, bool intervals) {
  std::vector<std::string> values = mapped(effect.parameters, [&](const Estimate& e) {
    return e.key + " " +
           estimate_text(e, 1, e.unit.empty() || e.unit == "-" ? "" : " " + e.unit, intervals);
  });
  return "The data show " + effect.name + (values.empty() ? "" : " with " + listed(values));
}

std::string percent(double share) {
  return std::to_string(std::lround(100 * std::clamp(share, 0.0, 1.0))) + " %";
}

}  // namespace

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::string times_text(double times) {
  return times <= 1 ? "once" : "about " + plain_number(times) + " times";
}

std::string plain_number(double value) {
  if (!std::isfinite(value)) return "an unknown number";
  const double size = std::abs(value);
  const std::string text = formatted(size >= 1000 && size < 1e7 ? "%.0f" : "%.3g", value);
  return text == "-0" ? "0" : text;
}

std::string listed(std::span<const std::string> phrases, std::string_view last) {
  std::string text;
  for (std::size_t i = 0; i < phrases.size(); ++i) {
    if (i > 0) text += i + 1 == phrases.size() ? " " + std::string(last) + " " : ", ";
    text += phrases[i];
  }
  return text;
}

std::string motions_of(const std::string& command) {
  static const std::map<std::string, std::string> phrases = {
      {"all", "All motions"},
      {"forward", "Forward drives"},
      {"backward", "Backward drives"},
      {"turn_ccw", "Counter-clockwise turns"},
      {"turn_cw", "Clockwise turns"},
      {"wide_ccw", "Wide counter-clockwise arcs"},
      {"wide_cw", "Wide clockwise arcs"}};
  const auto found = phrases.find(command);
  return found != phrases.end() ? found->second : "Trials of " + command;
}

std::string amount_text(double size, int component) {
  return plain_number(std::abs(size)) + (component == 2 ? " mrad" : " mm");
}

std::string component_text(int component) {
  if (component == 2) return "heading";
  return component == 0 ? "end along its heading" : "end across its heading";
}

std::string deviation_text(int component, double size, bool along_motion, bool trend) {
  const std::string much = amount_text(size, component);
  const bool positive = size > 0;
  if (along_motion) {
    const std::string verb = component == 2 ? "turn " : "travel ";
    const std::string aside = component == 1 ? " sideways" : "";
    if (trend) return verb + much + (positive ? " more" : " less") + aside;
    return verb + much + (positive ? " too far" : " too little") + aside;
  }
  const std::string far = trend ? "farther" : "too far";
  if (component == 0) return "end " + much + " " + far + (positive ? " ahead" : " back");
  const std::string side = positive ? "left" : "right";
  if (component == 1) return "end " + much + " " + far + " to the " + side;
  return "end turned " + much + " " + far + " to the " + side;
}

// " (errors from 66 to 58.6 mm and from 103 to 98.7 mrad)".
std::string change_text(const GapFigures& position_mm, const GapFigures& heading_mrad) {
  return " (errors from " + plain_number(position_mm.tuned) + " to " +
         plain_number(position_mm.final_) + " mm and from " + plain_number(heading_mrad.tuned) +
         " to " + plain_number(heading_mrad.final_) + " mrad)";
}

std::string effect_claim(const NamedEffect& effect, const EffectPhrases& phrases, const char* text,
                         bool intervals) {
  if (text == nullptr) return plain_claim(effect, intervals);
  std::string filled;
  for (const char* c = text; *c != 0; ++c) {
    if (*c != '%') {
      filled += *c;
      continue;
    }
    if (*++c == 'a') {
      filled += effect.axis.empty() ? "its axis" : effect.axis;
      continue;
    }
    const ShownParameter& shown = phrases.parameters[*c - '1'];
    const Estimate* e = find_by(effect.parameters, shown.key, &Estimate::key);
    if (e == nullptr) return plain_claim(effect, intervals);
    filled += estimate_text(*e, shown.factor, shown.unit, intervals);
  }
  return filled;
}

std::string effect_sentence(const NamedEffect& effect, const EffectDiagnoses& effects) {
  const EffectPhrases& phrases = effects.row(effect.name).phrases;
  NamedEffect shown = effect;
  const char* claim = phrases.sentence;
  Estimate* first = phrases.opposite == nullptr
                        ? nullptr
                        : find_by(shown.parameters, phrases.parameters[0].key, &Estimate::key);
  if (first != nullptr && first->value < 0) {
    claim = phrases.opposite;
    *first = {first->key, -first->value, -first->hi, -first->lo, first->unit};
  }
  std::string text = effect_claim(shown, phrases, claim, true);
  if (std::isfinite(effect.closed) && effect.closed > 0) {
    text += "; adding that closes " + percent(effect.closed) + " of the gap in log score";
    if (effect.position_mm_before && effect.position_mm_after && effect.heading_mrad_before &&
        effect.heading_mrad_after) {
      text += change_text({*effect.position_mm_before, *effect.position_mm_after, 0},
                          {*effect.heading_mrad_before, *effect.heading_mrad_after, 0});
    }
  }
  return text + ".";
}

std::vector<std::string> findings(const Diagnosis& diagnosis) {
  const double gap = diagnosis.gap.tuned - diagnosis.gap.floor;
  const double closed = gap > 0 ? (diagnosis.gap.tuned - diagnosis.gap.final_) / gap : 0;
  std::vector<std::string> text = mapped(diagnosis.effects, &NamedEffect::text);
  if (diagnosis.effects.size() > 1) {
    text.push_back("Together they close " + percent(closed) + " of the gap" +
                   change_text(diagnosis.position_mm, diagnosis.heading_mrad) + ".");
  }
  if (diagnosis.verdict == Verdict::kNone) {
    text.emplace_back("The tuned model predicts the log as well as its own noise allows.");
  }
  const bool remains = diagnosis.verdict == Verdict::kEffectAndUnknown;
  if (remains) text.emplace_back("Something remains that no effect of the catalogue explains.");
  const std::vector<Where>& left =
      diagnosis.unexplained.empty() ? diagnosis.where : diagnosis.unexplained;
  if ((remains || diagnosis.verdict == Verdict::kUnknown) && !left.empty()) {
    text.push_back(left.front().text);
  }
  return text;
}

int sector_of(double angle_rad) {
  constexpr int kSectors = 12;
  const double turn = (angle_rad + std::numbers::pi) / (2 * std::numbers::pi);
  return static_cast<int>(std::floor(turn * kSectors)) % kSectors;
}

std::vector<std::string> stated(const std::vector<std::pair<bool, std::string>>& sentences) {
  using Sentence = std::pair<bool, std::string>;
  return filtered(sentences, &Sentence::first, &Sentence::second);
}

LogVariety log_variety(std::span<const ResidualTrial> trials, std::span<const Cell> cells,
                       const TrialLog& log) {
  using T = const ResidualTrial&;
  LogVariety v;
  v.trials = trials.size();
  v.paths = log.has_paths();
  v.times = std::ranges::any_of(log.trials, [](const Trial& t) { return t.t_s.has_value(); });
  v.sessions = distinct(trials, &ResidualTrial::session);
  v.commands = distinct(trials, [&](T t) {  // free ones may have one name
    return std::tuple(t.command, cells[t.cell].kind, cells[t.cell].mirror);
  });
  v.durations =
      distinct(trials, [&](T t) { return std::lround(1000 * cells[t.cell].command.duration_s); });
  v.levels = distinct(trials, [&](T t) { return std::lround(1000 * cells[t.cell].level); });
  v.headings = distinct(trials, [](T t) { return sector_of(t.X_WS.theta); });
  v.longest_min = max_of(trials, [](T t) { return t.context.session_time_s / 60; });
  v.followers = std::ranges::count_if(trials, [](T t) { return !t.context.moved; });
  Extent box;
  for (T t : trials) box.add(t.X_WS);
  if (!trials.empty()) v.width_m = box.longer_side();
  const std::vector<double> counts =
      filtered(mapped(cells, [](const Cell& cell) { return double(cell.trials); }),
               [](double count) { return count > 0; });
  if (!counts.empty()) v.typical_cell = median(counts);
  return v;
}

std::vector<std::string> lacking(const LogVariety& v) {
  return stated({{v.commands < 3, "several commands"},
                 {v.durations < 2, "several durations"},
                 {v.levels < 2, "several levels"},
                 {v.headings < 4, "several start headings"},
                 {v.width_m < 0.3, "several start places"},
                 {v.followers == 0, "trials that start where the one before ended"},
                 {!v.times, "times"},
                 {!v.paths, "paths"}});
}

std::string alias_sentence(const std::string& effect, const std::vector<std::string>& aliases,
                           std::size_t alike, std::span<const std::string> lacks) {
  const auto others = aliases.begin() + static_cast<std::ptrdiff_t>(alike);
  const std::vector<std::string> well(aliases.begin(), others), rest(others, aliases.end());
  std::vector<std::string> sentences;
  if (!well.empty()) {
    sentences.push_back("In these data " + listed(well, "or") + " would explain about as much as " +
                        effect + " in another way" +
                        (lacks.empty() ? "." : "; the log lacks " + listed(lacks) + "."));
  }
  if (!rest.empty()) {
    sentences.push_back(listed(rest, "or") +
                        " moves things in much the same way: these data prefer " + effect +
                        " as far as contacts are simulated right.");
  }
  return joined(sentences, " ");
}

std::string few_trials_caution(std::size_t trials, const std::string& one,
                               const std::string& many) {
  if (trials >= kFewTrialsToJudge) return "";
  return "There " + std::string(trials == 1 ? "is " : "are ") + counted(trials, one, many) +
         "; below " + std::to_string(kFewTrialsToJudge) +
         " only large effects show, and no claim is sure.";
}

std::vector<std::string> cautions(std::span<const ResidualTrial> trials,
                                  std::span<const Cell> cells, const TrialLog& log) {
  const LogVariety v = log_variety(trials, cells, log);
  const std::string few = few_trials_caution(v.trials, "trial", "trials");
  if (v.trials == 0) return {few};
  const bool free = commands_are_free(cells);
  return stated(
      {{!few.empty(), few},
       {free,
        "Hardly a command repeats: the noise is what trials vary by beyond a smooth dependence on "
        "duties and duration, so a small dependence that is not smooth may pass for noise."},
       {!free && v.typical_cell < kFewInCell,
        "Most conditions were driven " + times_text(v.typical_cell) +
            ", so what repeating one varies by is hardly known, and noise may pass for an effect "
            "or hide one."},
       {v.sessions == 1,
        "All trials are of one session: what would differ in another session cannot be seen, and "
        "held-out trials are from the same one."},
       {v.commands == 1,
        "All trials drive one command (" + cells[trials.front().cell].command.name +
            "): effects that differ between straight drives and turns cannot be distinguished."},
       {v.durations == 1,
        "Every command lasts equally long: motor_lag, timing_offset and backlash look like another "
        "speed."},
       {v.levels == 1,
        "Every command runs at one level: motor_deadband and rolling_resistance look like another "
        "speed."},
       {v.headings < 4,
        "All trials start in " + counted(v.headings, "direction", "directions") +
            " (of twelve): floor_tilt, floor_nap and camera_aspect need several headings."},
       {v.width_m < 0.3,
        "All starts lie within " + plain_number(1000 * v.width_m) +
            " mm: friction_patch, camera_seam and camera_distortion need several places."},
       {v.followers == 0,
        "No trial starts where the one before ended: backlash, a stale start pose and the noise of "
        "one reading cannot be seen."},
       {!v.times,
        "The log has no times; they were guessed from the order of the trials, so the rate of "
        "battery_sag is rough."},
       {v.times && v.longest_min < 3, "The longest session lasts " + plain_number(v.longest_min) +
                                          " minutes: battery_sag needs longer ones."},
       {!v.paths,
        "Start and end poses only: what happens on the way (motor_lag, the moment at which a pose "
        "was read) shows only by where the robot ends."}});
}

double leftover_scale(const Regression& explained) {
  std::vector<double> squares;
  for (double z : studentised(explained, 0.2)) {
    if (z != 0) squares.push_back(z * z);  // rows of ignored trials are
  }
  return squares.empty()
             ? 1
             : std::clamp(median(squares) / 0.455, kLeastLeftoverScale, kMostLeftoverScale);
}

std::vector<Leftover> leftovers(const Regression& explained,
                                const std::vector<CovariateBlock>& blocks) {
  const double middle = leftover_scale(explained);
  // A few that are far off would scatter all, and be what depends on something.
  const double far = kOutlierDeviations * std::sqrt(middle);
  Regression bounded = explained;
  bounded.restart(explained.left().cwiseMax(-far).cwiseMin(far));
  const Eigen::VectorXd z = studentised(bounded, 0.2);
  const auto rows = static_cast<double>((z.array() != 0).count());
  std::vector<Leftover> all;
  for (const CovariateBlock& block : blocks) {
    const auto gain_of = [&](const Regression& of) {
      return block.expected > 0 ? of.gain_beyond(block.columns, block.expected)
                                : of.gain(block.columns);
    };
    const Gain gain = gain_of(bounded), whole = gain_of(explained);
    if (gain.dimensions == 0) continue;
    // What it leaves scatters by its tails, too, which the middle does not know.
    const double rest = (z.squaredNorm() - gain.squares) / std::max(1.0, rows - gain.dimensions);
    const double p = chi_squared_above(gain.dimensions, gain.squares / std::max(middle, rest));
    all.push_back({block.name, std::log10(std::max(p, 1e-300)),
                   std::max(0.0, (whole.squares - whole.dimensions * middle) / 2)});
  }
  std::ranges::stable_sort(all, {}, &Leftover::log10_p);
  return all;
}

Verdict judge_verdict(bool named, double explained_nats, const std::vector<Leftover>& left) {
  const bool unknown = !left.empty() && left.front().log10_p < kUnknownLog10P;
  if (!unknown) return named ? Verdict::kEffect : Verdict::kNone;
  if (!named || left.front().excess > kWrongShare * std::max(explained_nats, 1.0)) {
    return Verdict::kUnknown;
  }
  return Verdict::kEffectAndUnknown;
}

}  // namespace gapfarm
