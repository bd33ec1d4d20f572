#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "common/score/motion_model.h"
#include "common/trials/context.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

constexpr double kMostFalse = 0.25;  // of the trials
constexpr std::size_t kFewestRepeats = 3;
constexpr std::size_t kFewestSamePose = 3;
constexpr std::size_t kFewestProven = 3;     // for those that nothing confirms to be of their kind
constexpr double kDeviations = 8;            // beyond what moves leave unsure: no noise is that far
constexpr double kMostSpread = 3;            // over the median command's
constexpr std::size_t kOfWhichByChance = 4;  // false readings, one on the way
constexpr std::size_t kOfWhichAlone = 200;   // trials, one that is like no other
constexpr double kTimesTheOthers = 4;        // as any other: no effect of few trials
// Reaches of a command: so far from its own a drive is another one's whose it is as near as this.
constexpr double kFarFromItsOwn = 2, kNearAnother = 0.5;
constexpr int kStepsOfWay = 20;
// Pushes of one name deviate by less (median) where they are one push again and again: practice
// logs stay below 8 mm and 0.04 rad.
constexpr double kSamePlace_m = 0.02, kSameWay_rad = 0.12;
constexpr double kMostKnownTurn_rad = 2.5;  // beyond it the way round may have been the other

// Where drives of one command end, seen from their starts.
struct Cell {
  Pose end;
  double reach_m = 0, reach_rad = 0;  // ends beyond are none of these

  // How far from there, over how far these reach.
  double distance(const Pose& X_SE, const Pose& from, bool any_heading = false) const {
    const double moved = std::hypot(X_SE.x - from.x, X_SE.y - from.y) / reach_m;
    const double turned = std::abs(wrap_angle(X_SE.theta - from.theta)) / reach_rad;
    return any_heading ? moved : std::max(moved, turned);
  }
  bool holds(const Pose& X_SE) const { return distance(X_SE, end) <= 1; }
  bool holds_on_the_way(const Pose& X_SE) const {
    const Twist way = log(end);
    const bool any_heading = std::abs(end.theta) > kMostKnownTurn_rad;
    for (int k = 0; k <= kStepsOfWay; ++k) {
      if (distance(X_SE, exp(way * k / kStepsOfWay), any_heading) <= 1) return true;
    }
    return false;
  }
};

// Their reach is their spread as yet.
std::optional<Cell> cell_of(const std::vector<Pose>& ends) {
  if (ends.size() < kFewestRepeats) return std::nullopt;
  const auto x = mapped(ends, &Pose::x), y = mapped(ends, &Pose::y);
  std::vector<double> theta = mapped(ends, &Pose::theta);
  Cell cell{{median(x), median(y), circular_centre(theta)}};
  for (double& t : theta) t = wrap_angle(t - cell.end.theta);
  cell.reach_m = std::max(median_deviation(x, cell.end.x), median_deviation(y, cell.end.y));
  cell.reach_rad = median_deviation(theta);
  return cell;
}

// Whether a finger comes to the piece from the same place and in the same direction, as far as a
// hand can.  Drives have no tip.
bool come_alike(const std::vector<const Trial*>& pushes) {
  std::vector<double> x, y, direction;
  for (const Trial* push : pushes) {
    if (push->tip.size() < 2) return true;
    const TipSample &from = push->tip.front(), &to = push->tip.back();
    const Pose X_RF =
        between(push->X_WS, {from.x, from.y, std::atan2(to.y - from.y, to.x - from.x)});
    x.push_back(X_RF.x);
    y.push_back(X_RF.y);
    direction.push_back(X_RF.theta);
  }
  const double middle = circular_centre(direction);
  for (double& d : direction) d = wrap_angle(d - middle);
  return std::max(median_deviation(x, median(x)), median_deviation(y, median(y))) < kSamePlace_m &&
         median_deviation(direction) < kSameWay_rad;
}

// What was commanded, and for a piece what the log says of the push ("start"): pushes differ by
// more than their command.
using Command = std::vector<std::string>;
using Cells = std::map<Command, std::optional<Cell>>;

// Of few drives a false one or two make the spread.
void reach_beyond_noise(const MoveTolerance& unsure, Cells* cells) {
  const auto reach = [&](double Cell::*of, double least) {
    const auto all = filtered(
        *cells, [](auto& one) { return one.second.has_value(); },
        [&](auto& one) { return (*one.second).*of; });
    if (all.empty()) return;
    const double most = kMostSpread * median(all);
    for (auto& [command, cell] : *cells) {
      if (cell) (*cell).*of = least + kDeviations * std::min((*cell).*of, most);
    }
  };
  reach(&Cell::reach_m, unsure.distance_m);
  reach(&Cell::reach_rad, unsure.heading_rad);
}

// What other readings make of one.
enum class Reading { kFine, kLate, kUnconfirmed, kContradicted };

class Drives {
 public:
  explicit Drives(const Problem& problem) : trials_(problem.log.trials) {
    const MoveTolerance unsure = estimate_move_tolerance(problem.log);
    std::vector<DrivenCommand> driven;
    std::map<Command, std::vector<Pose>> ends;
    std::map<Command, std::vector<const Trial*>> alike;
    for (const Trial& t : trials_) {
      commands_.push_back(t.extra);
      commands_.back().push_back(t.command);
      driven.emplace_back();
      commanded_.push_back(false);
      if (t.tip.empty()) {
        const CommandSpec c = resolved_command(t, problem.commands);
        driven.back() = {c.left, c.right, c.duration_s};
        commanded_.back() = c.left != 0 || c.right != 0;
        commands_.back() = {formatted("%.17g %.17g %.17g", c.left, c.right, c.duration_s)};
      }
      alike[commands_.back()].push_back(&t);
      if (!repeats_start(driven.size() - 1))
        ends[commands_.back()].push_back(between(t.X_WS, t.X_WE));
      ++same_end_[key(t.X_WE)];
    }
    for (const auto& [command, trials] : alike) {
      cells_[command] = come_alike(trials) ? cell_of(ends[command]) : std::nullopt;
    }
    reach_beyond_noise(unsure, &cells_);
    const std::vector<TrialContext> contexts = trial_contexts(problem.log, driven, unsure);
    std::size_t moved = 0, read = 0;
    for (const TrialContext& context : contexts) {
      if (context.previous && repeats_start(*context.previous)) continue;
      ++read;
      moved += context.moved ? 1 : 0;
    }
    chained_ = 2 * moved < read;
    next_.resize(trials_.size());
    moved_.resize(trials_.size());
    for (std::size_t i = 0; i < contexts.size(); ++i) {
      previous_.push_back(contexts[i].previous);
      moved_[i] = contexts[i].moved;
      if (contexts[i].previous) next_[*contexts[i].previous] = i;
    }
  }

  // Whether most trials begin where the one before ends: else nothing is confirmed anyway.
  bool chained() const { return chained_; }

  Reading end_of(std::size_t i) const {
    const Trial& t = trials_[i];
    const auto& cell = cells_.at(commands_[i]);
    const Pose X_SE = between(t.X_WS, t.X_WE);
    const bool went_on = next_[i] && moved_[*next_[i]];
    if (chained_ && went_on && commanded_[i] && repeats_start(i)) return Reading::kContradicted;
    if (!cell || cell->holds(X_SE)) return Reading::kFine;
    if (same_end_.at(key(t.X_WE)) >= kFewestSamePose) return Reading::kContradicted;
    if (next_[i] && !moved_[*next_[i]]) return Reading::kFine;
    if (t.X_WS != t.X_WE && cell->holds_on_the_way(X_SE)) return Reading::kLate;
    if (!next_[i]) return Reading::kUnconfirmed;
    return cell->holds(between(t.X_WS, trials_[*next_[i]].X_WS)) ? Reading::kContradicted
                                                                 : Reading::kUnconfirmed;
  }

  // An end that repeats its start to the last digit was not read, if the robot drove.
  bool repeats_start(std::size_t i) const { return trials_[i].X_WS == trials_[i].X_WE; }

  // How far it ends from where drives of its command do, over how far these reach; 0: nobody knows.
  double distance(std::size_t i) const {
    const auto& cell = cells_.at(commands_[i]);
    return cell ? cell->distance(between(trials_[i].X_WS, trials_[i].X_WE), cell->end) : 0;
  }

  // Whether it ends far from where drives of its command do and lead through, and where another
  // one's end.
  bool is_of_another(std::size_t i) const {
    if (!trials_[i].tip.empty() || distance(i) < kFarFromItsOwn) return false;
    const Pose X_SE = between(trials_[i].X_WS, trials_[i].X_WE);
    if (cells_.at(commands_[i])->holds_on_the_way(X_SE)) return false;  // late, say
    return std::ranges::any_of(cells_, [&](const auto& one) {
      const auto& [command, cell] = one;
      return cell && command != commands_[i] && cell->distance(X_SE, cell->end) < kNearAnother;
    });
  }

  bool has_false_start(std::size_t i) const {
    const Trial& t = trials_[i];
    const auto& cell = cells_.at(commands_[i]);
    if (!cell || !previous_[i] || !moved_[i]) return false;
    return !cell->holds(between(t.X_WS, t.X_WE)) &&
           cell->holds(between(trials_[*previous_[i]].X_WE, t.X_WE));
  }

 private:
  using Key = std::array<double, 3>;
  static Key key(const Pose& X) { return {X.x, X.y, X.theta}; }

  const std::vector<Trial>& trials_;
  std::vector<Command> commands_;
  std::vector<bool> commanded_;  // to drive
  Cells cells_;
  std::map<Key, std::size_t> same_end_;
  std::vector<std::optional<std::size_t>> previous_, next_;  // in the session
  bool chained_ = false;
  std::vector<bool> moved_;  // where it begins is not where the one before ends
};

}  // namespace

double farthest_of_others(std::vector<double> distances, double usual) {
  std::ranges::sort(distances, std::greater<>());
  const std::size_t most = std::max<std::size_t>(1, distances.size() / kOfWhichAlone);
  double limit = INFINITY;
  for (std::size_t k = 0; k < most && k + 1 < distances.size(); ++k) {
    const double others = std::max(usual, distances[k + 1]);
    if (distances[k] > kTimesTheOthers * others) limit = others;
  }
  return limit;
}

std::vector<std::size_t> exchanged_commands(const Problem& problem) {
  const Drives drives(problem);
  const auto trials = indices(problem.log.trials.size());
  auto rows = filtered(trials, [&](std::size_t i) { return drives.is_of_another(i); });
  if (static_cast<double>(rows.size()) > kMostFalse * static_cast<double>(trials.size())) return {};
  return rows;
}

std::vector<std::size_t> false_readings(const Problem& problem) {
  const Drives drives(problem);
  std::vector<std::size_t> rows;
  std::map<Reading, std::size_t> count;
  std::vector<Reading> readings;
  std::vector<double> distances;
  for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
    readings.push_back(drives.has_false_start(i) ? Reading::kContradicted : drives.end_of(i));
    ++count[readings.back()];
    const bool known =
        readings.back() != Reading::kFine && readings.back() != Reading::kUnconfirmed;
    distances.push_back(known ? 0 : drives.distance(i));
  }
  const bool proven = drives.chained() && count[Reading::kContradicted] >= kFewestProven;
  const std::size_t off_the_way = count[Reading::kContradicted] + count[Reading::kUnconfirmed];
  const bool by_chance = count[Reading::kLate] * kOfWhichByChance <= off_the_way;
  const double limit = farthest_of_others(distances, 1);
  const auto pushed_on = against_their_fingers(problem);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const Reading of = readings[i];
    if (distances[i] > limit || contains(pushed_on, i) || of == Reading::kContradicted ||
        (proven && of == Reading::kUnconfirmed) || (proven && by_chance && of == Reading::kLate)) {
      rows.push_back(i);
    }
  }
  const auto was_read = [&](std::size_t i) { return !drives.repeats_start(i); };
  const auto all = static_cast<double>(problem.log.trials.size());
  if (static_cast<double>(std::ranges::count_if(rows, was_read)) > kMostFalse * all) rows.clear();
  return rows;
}

}  // namespace gapfarm
