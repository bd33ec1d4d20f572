#include "master/diagnose/drive_designs.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "master/diagnose/conclusions/findings.h"

namespace gapfarm {
namespace {

enum class StartKind { kManyStarts, kAfterOpposite, kLate };

constexpr int kStarts = 5;  // no harmonic of the heading up to the fourth repeats on five
constexpr double kFirstHeading = 0.3;  // rad
constexpr double kEarly_s = 30;
constexpr double kLate_s = 1200;
constexpr double kTrouble_s = 10;  // what a special way costs beyond the command
constexpr std::array<double, 3> kDurations_s = {0.5, 1, 2};
constexpr std::array<double, 2> kLevels = {0.5, 1};  // of each command's own duties

// Places over the box around the log's own starts; the origin alone without a log.
std::vector<Pose> starts_like(const TrialLog& log) {
  double x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    const Pose& X = log.trials[i].X_WS;
    if (i == 0) x0 = x1 = X.x, y0 = y1 = X.y;
    x0 = std::min(x0, X.x), x1 = std::max(x1, X.x);
    y0 = std::min(y0, X.y), y1 = std::max(y1, X.y);
  }
  std::vector<Pose> starts;
  for (int k = 0; k < kStarts; ++k) {
    // Steps of 2/5 in y against 1/5 in x: no two on a line with a side of the box.
    const double across = (k + 0.5) / kStarts;
    const double along = ((2 * k) % kStarts + 0.5) / kStarts;
    starts.push_back({x0 + across * (x1 - x0), y0 + along * (y1 - y0),
                      wrap_angle(kFirstHeading + 2 * std::numbers::pi * k / kStarts)});
  }
  return starts;
}

Trial trial_of(const CommandSpec& c, const Pose& start, double t_s, const std::string& session) {
  Trial trial;
  trial.session = session;
  trial.t_s = t_s;
  trial.command = c.name;
  trial.left = c.left;
  trial.right = c.right;
  trial.duration_s = c.duration_s;
  trial.X_WS = start;
  trial.X_WE = start;
  return trial;
}

// Every trial has a session of its own, so that what went before is what the design says.
std::vector<std::uint32_t> add_trials(const std::vector<Pose>& starts, const CommandSpec& command,
                                      StartKind start_kind, std::vector<Trial>* log) {
  std::vector<std::uint32_t> indices;
  const std::size_t count = start_kind == StartKind::kManyStarts ? starts.size() : 1;
  for (std::size_t k = 0; k < count; ++k) {
    const std::string session = "d" + std::to_string(log->size());
    double t_s = start_kind == StartKind::kLate ? kLate_s : kEarly_s;
    if (start_kind == StartKind::kAfterOpposite) {
      CommandSpec opposite = command;
      opposite.left = -opposite.left;
      opposite.right = -opposite.right;
      log->push_back(trial_of(opposite, starts[k], t_s, session));
      t_s += opposite.duration_s + 4;
    }
    indices.push_back(static_cast<std::uint32_t>(log->size()));
    log->push_back(trial_of(command, starts[k], t_s, session));
    log->back().trial = start_kind == StartKind::kAfterOpposite ? 1 : 0;
  }
  return indices;
}

std::string drive_names(const CommandSpec& command, double level, StartKind start_kind,
                        bool many_starts) {
  std::string how = " from any start";
  if (many_starts) how = " from several headings and places";
  if (start_kind == StartKind::kAfterOpposite) how = " straight after driving the opposite way";
  if (start_kind == StartKind::kLate)
    how = " " + plain_number(kLate_s / 60) + " minutes into a session";
  return "Drive " + command.name + " for " + plain_number(command.duration_s) + " s at " +
         (level == 1 ? "full" : "half") + " level" + how;
}

}  // namespace

ExperimentPlan plan_drives(const Problem& problem) {
  ExperimentPlan plan{
      problem, {}, "design of one command", "log paths, or measure one of them directly"};
  plan.problem.genes.clear();
  plan.problem.log = {};
  const std::vector<Pose> starts = starts_like(problem.log);
  for (const CommandSpec& own : problem.commands) {
    for (const double duration : kDurations_s) {
      for (const double level : kLevels) {
        CommandSpec command = own;
        command.left *= level;
        command.right *= level;
        command.duration_s = duration;
        std::uint32_t ordinary = 0;
        for (const StartKind start_kind :
             {StartKind::kManyStarts, StartKind::kAfterOpposite, StartKind::kLate}) {
          Design design;
          design.group = command.name;
          design.trials = add_trials(starts, command, start_kind, &plan.problem.log.trials);
          design.cost = duration + (start_kind == StartKind::kManyStarts ? 0 : kTrouble_s);
          if (start_kind == StartKind::kManyStarts) ordinary = design.trials.front();
          if (start_kind != StartKind::kManyStarts) design.ordinary = ordinary;
          design.action = [command, level, start_kind](bool many_starts) {
            return drive_names(command, level, start_kind, many_starts);
          };
          plan.designs.push_back(std::move(design));
        }
      }
    }
  }
  return plan;
}

}  // namespace gapfarm
