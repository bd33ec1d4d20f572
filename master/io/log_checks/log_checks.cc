#include "master/io/log_checks/log_checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "common/base/text.h"
#include "common/math/statistics.h"
#include "common/trials/pose_readings.h"

namespace gapfarm {

std::string finding_phrase(const SanityFinding& finding) {
  static const std::map<std::string, std::string> phrases = {
      {"axes_swapped", "x and y are swapped"},
      {"axis_mirrored", "an axis is mirrored"},
      {"heading_flipped", "headings count clockwise"},
      {"heading_turned", "headings are counted from another axis"},
      {"sides_swapped", "left and right are exchanged"},
      {"pieces_swapped", "two pieces' names are exchanged"},
      {kEndsSwapped, "before and after are exchanged"},
      {"direction_reversed", "the motors run backward"},
      {"commands_unrelated", "commands and motions do not belong together"},
      {"unit_error", "it is in another unit"},
      {"slow_runs", "the robot hardly moves, as if times were in another unit"},
      {"robot_out_of_bounds", "this is no robot that the scenario can be"},
      {"base_not_simulated", "the base model cannot be simulated"},
      {"base_on_bounds", "the tuned base sits on its bounds"},
      {"base_misses", "the tuned base misses by far more than the noise"},
      {"unfinished", "a simulation failed on the way"},
      {"no_motion", "nothing moved"},
      {"too_few_trials", "there are too few trials"},
      {"duplicates", "trials are repeated"},
      {"clock_backward", "time runs backward"},
      {"frames_apart", "finger and pieces are not in one frame"},
      {"untouched", "the finger does not touch the pieces"},
      {"headings_rounded", "headings are rounded"},
      {"impossible_rows", "some rows cannot be"},
      {"false_readings", "some readings are false"},
      {"commands_exchanged", "some commands are another trial's"},
      {"tip_jumps", "the finger jumps"}};
  if (const std::string* phrase = find_in(phrases, finding.name)) return *phrase;
  std::string words = finding.name;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

const char* severity_name(Severity severity) {
  constexpr const char* kNames[] = {"note", "doubt", "unusable"};
  return kNames[static_cast<std::size_t>(severity)];
}

namespace {

// Fewer trials name nothing: a place or a direction that is searched for explains any of so few.
constexpr std::size_t kFewestTrials = 40;

constexpr double kManyCopies = 0.2;  // of the trials that moved
constexpr double kCopy = 1e-5;       // m, rad: a fiftieth of the least noise of poses in the tables
constexpr double kLeastHeadingStep_rad = 5e-3;  // finer ones are hidden by any tracker's noise
constexpr double kManySteps = 0.02;             // back in time, of all steps
constexpr std::array<LengthUnit, 5> kUnits = {{{"millimetres", 0.001},
                                               {"centimetres", 0.01},
                                               {"inches", 0.0254},
                                               {"feet", 0.3048},
                                               {"kilometres", 1000}}};

// Of two heaps of lengths in two units.
constexpr std::ptrdiff_t kFewestOfAUnit = 5;
constexpr double kTimesBetween = 3;  // the shortest of one over the longest of the other
constexpr double kNearAUnit = 1.5;   // the ratio of their medians over that of two units
constexpr double kNearInPlaces = 3;  // and of how far apart they end

std::string row_text(const Trial& trial) {
  return "session " + trial.session + ", trial " + std::to_string(trial.trial);
}

// How far they end from their middle, half of them.
double spread_of_ends(const TrialLog& log, std::span<const TrialLength> these) {
  return median(
      from_middle(mapped(these, [&](const TrialLength& t) { return log.trials[t.trial].X_WE; })));
}

// "session s3", or which trials these are.
std::string place_of(const TrialLog& log, std::span<const TrialLength> these,
                     std::span<const TrialLength> others) {
  std::set<std::string> sessions, of_others;
  for (const TrialLength& t : these) sessions.insert(log.trials[t.trial].session);
  for (const TrialLength& t : others) of_others.insert(log.trials[t.trial].session);
  const bool apart = std::ranges::none_of(
      sessions, [&](const std::string& session) { return of_others.contains(session); });
  if (apart) return "session " + joined(sessions, ", ") + " alone";
  const auto first = std::ranges::min_element(these, {}, &TrialLength::trial);
  return "the first is " + row_text(log.trials[first->trial]);
}

}  // namespace

std::vector<double> from_middle(const std::vector<Pose>& poses) {
  const double x = median(mapped(poses, &Pose::x)), y = median(mapped(poses, &Pose::y));
  return mapped(poses, [&](const Pose& X) { return std::hypot(X.x - x, X.y - y); });
}

std::string few_digits(double value) { return formatted("%.3g", value); }

std::span<const LengthUnit> length_units() { return kUnits; }

const LengthUnit* likely_unit(double logged, double lower_m, double upper_m, double expected_m) {
  const LengthUnit* best = nullptr;
  double least = INFINITY;
  for (const LengthUnit& unit : kUnits) {
    const double in_metres = logged * unit.metres;
    if (in_metres < lower_m || in_metres > upper_m) continue;
    const double far = std::abs(std::log(in_metres / expected_m));
    if (far < least) least = far, best = &unit;
  }
  return best;
}

bool check_mixed_units(const TrialLog& log, std::vector<TrialLength> lengths, const char* trials,
                       const char* columns, std::vector<SanityFinding>* findings) {
  std::ranges::sort(lengths, {}, &TrialLength::length);
  const auto count = static_cast<std::ptrdiff_t>(lengths.size());
  std::ptrdiff_t cut = 0;
  double between = kTimesBetween;
  for (std::ptrdiff_t k = kFewestOfAUnit; k + kFewestOfAUnit <= count; ++k) {
    const double times = lengths[k].length / lengths[k - 1].length;
    if (times > between) between = times, cut = k;
  }
  if (cut == 0) return false;
  const std::span<const TrialLength> metric(lengths.data(), cut),
      others(lengths.data() + cut, count - cut);
  const double times = others[others.size() / 2].length / metric[metric.size() / 2].length;
  const LengthUnit* unit = likely_unit(times, 1 / kNearAUnit, kNearAUnit, 1);
  // What goes far by another command ends where the others do.
  const double apart = spread_of_ends(log, others) / spread_of_ends(log, metric) / times;
  if (unit == nullptr || !(apart > 1 / kNearInPlaces && apart < kNearInPlaces)) return false;
  findings->push_back({"unit_error",
                       std::to_string(others.size()) + " of " + std::to_string(count) + " " +
                           trials + " go " + formatted("%.0f", times) +
                           " times as far as the rest, as if they were in " + unit->name + " (" +
                           place_of(log, others, metric) + ").",
                       std::string("Multiply ") + columns + " of such rows, and of no others, by " +
                           few_digits(unit->metres) + "."});
  return true;
}

void check_count(const TrialLog& log, std::vector<SanityFinding>* findings) {
  const std::size_t count = log.trials.size();
  if (count >= kFewestTrials) return;
  findings->push_back({"too_few_trials",
                       (count == 1 ? std::string("There is one trial")
                                   : "There are " + std::to_string(count) + " trials") +
                           ": of fewer than " + std::to_string(kFewestTrials) +
                           " any cause can be made up, and none can be ruled out.",
                       "Log at least " + std::to_string(kFewestTrials) +
                           " trials, better 200, and repeat commands."});
}

void check_copies(const TrialLog& log, std::vector<SanityFinding>* findings) {
  using Key = std::array<double, 6>;
  std::map<Key, const Trial*> seen[2];  // on two grids: what one parts is within a cell of another
  std::size_t copies = 0, moved = 0;
  bool exact = true;
  std::string example;
  for (const Trial& t : log.trials) {
    if (t.X_WS == t.X_WE) continue;
    ++moved;
    const Trial* of = nullptr;
    for (const double shift : {0.0, 0.5}) {
      const auto cell = [&](double at) { return std::round(at / kCopy + shift); };
      const Key key = {cell(t.X_WS.x), cell(t.X_WS.y), cell(t.X_WS.theta),
                       cell(t.X_WE.x), cell(t.X_WE.y), cell(t.X_WE.theta)};
      const auto [first, fresh] = seen[shift > 0].try_emplace(key, &t);
      if (!fresh) of = first->second;
    }
    if (of == nullptr) continue;
    exact &= t.X_WS == of->X_WS && t.X_WE == of->X_WE;
    if (copies++ == 0) example = row_text(t) + " and " + row_text(*of);
  }
  if (copies == 0) return;
  const bool many = static_cast<double>(copies) > kManyCopies * static_cast<double>(moved);
  findings->push_back({"duplicates",
                       std::to_string(copies) + " of " + std::to_string(moved) +
                           " trials repeat the poses of another one to " +
                           (exact ? "the last digit" : few_digits(1e3 * kCopy) + " mm and mrad") +
                           " (" + example + "): no two drives are that much alike.",
                       "Leave the copies out: they count the same evidence twice.",
                       many ? Severity::kUnusable : Severity::kNote});
}

void check_headings(const TrialLog& log, std::vector<SanityFinding>* findings) {
  const double step = pose_grid(log.trials).heading_step_rad;
  if (step < kLeastHeadingStep_rad) return;
  findings->push_back({"headings_rounded",
                       "Headings are rounded to steps of " + few_digits(1e3 * step) + " mrad (" +
                           few_digits(step * 180 / std::numbers::pi) + " deg).",
                       "Log more digits of them: rounding adds " +
                           few_digits(1e3 * step / std::sqrt(12.0)) + " mrad to every reading.",
                       Severity::kNote});
}

void check_clock(const TrialLog& log, std::vector<SanityFinding>* findings) {
  std::map<std::string, double> last;
  std::size_t steps = 0, back = 0;
  std::string example;
  for (const Trial& t : log.trials) {
    if (!t.t_s) continue;
    const auto [before, fresh] = last.try_emplace(t.session, *t.t_s);
    if (fresh) continue;
    ++steps;
    if (*t.t_s < before->second && back++ == 0) {
      example = row_text(t) + " begins at " + few_digits(*t.t_s) + " s, the one before it at " +
                few_digits(before->second) + " s";
    }
    before->second = *t.t_s;
  }
  if (back == 0) return;
  const bool many = static_cast<double>(back) > kManySteps * static_cast<double>(steps);
  findings->push_back({"clock_backward",
                       "Time runs backward " + std::to_string(back) + " times in " +
                           std::to_string(steps) + " steps: " + example + ".",
                       "Sort the rows of each session by time, begin a new session where a clock "
                       "was set, or leave t empty.",
                       many ? Severity::kUnusable : Severity::kNote});
}

}  // namespace gapfarm
