#include <algorithm>
#include <cmath>
#include <utility>

#include "common/random/stream.h"
#include "master/experiments/plan/drive_knowledge.h"
#include "master/experiments/plan/visibility.h"

namespace gapfarm::plan {
namespace {

constexpr double kSlopeStep = 0.1;  // of a tolerance
constexpr double kMemory_s = 5;     // for which a command before a move still shows in it
constexpr double kStands = 0.1;     // of a usual rate
constexpr double kRest_s = 1;       // at the end
constexpr double kPoseEvery_s = 0.1;
// Off the grid of windows and of poses: commands that change where a window begins hardly show how
// late they act.
constexpr double kMoves_s[] = {0.53, 1.07, 2.13, 3.97};
constexpr double kLevels[] = {-1, -0.5, 0, 0.5, 1};

// The marker's steps between times, and how they change with the rows.  What slows down by its size
// (lags, drags) stands at least its tolerance above 0: a lag of 0 looks like a delay, and a drag of
// 0 like none.  REQUIRES: times that ascend, at least two.
class Steps {
 public:
  // Both outlive it.
  Steps(const GroundRobot& robot, const std::vector<KinematicRow>& rows)
      : robot_(robot), rows_(rows) {
    for (const KinematicRow& row : rows) {
      const double least = is_magnitude(row.name) ? row.tolerance : row.nominal;
      nominal_.add(row.name, std::max(row.nominal, least));
    }
  }

  std::vector<Pose> between(const CommandedRun& run, const std::vector<double>& times_s) const {
    return steps(run, times_s, nominal_);
  }

  // Of all steps `at`, 3 by rows, in the axes of their ends.
  std::vector<Eigen::MatrixXd> slopes(const CommandedRun& run, const std::vector<double>& times_s,
                                      const std::vector<Pose>& at) const {
    const auto n = static_cast<Eigen::Index>(rows_.size());
    std::vector<Eigen::MatrixXd> slopes(at.size(), Eigen::MatrixXd::Zero(3, n));
    for (Eigen::Index k = 0; k < n; ++k) {
      const double h = kSlopeStep * rows_[static_cast<std::size_t>(k)].tolerance;
      Kinematics moved = nominal_;
      moved.values[k] += h;
      const std::vector<Pose> there = steps(run, times_s, moved);
      for (std::size_t i = 0; i < at.size(); ++i) {
        slopes[i].col(k) = local_difference(at[i], there[i]) / h;
      }
    }
    return slopes;
  }

 private:
  std::vector<Pose> steps(const CommandedRun& run, const std::vector<double>& times_s,
                          const Kinematics& kinematics) const {
    std::vector<Trial> trials(times_s.size() - 1);
    for (std::size_t i = 0; i < trials.size(); ++i) {
      trials[i].run = 0;
      trials[i].t_s = times_s[i];
      trials[i].duration_s = times_s[i + 1] - times_s[i];
    }
    return kinematic_ends(robot_, {&run, 1}, trials, kinematics);
  }

  const GroundRobot& robot_;
  const std::vector<KinematicRow>& rows_;
  Kinematics nominal_;
};

struct Move {
  std::vector<double> command;
  double seconds = 0;
};

class Planner {
 public:
  Planner(const GroundRobot& robot, const DriveNoise& noise, const DriveSettings& settings)
      : settings_(settings),
        rows_(kinematic_rows(robot)),
        steps_(robot, rows_),
        known_(robot, rows_, noise),
        stream_({settings.seed, Purpose::kSimulation, 0, 0, 0}) {
    still_.assign(settings.limits.size(), 0);
    for (std::size_t c = 0; c < still_.size(); ++c) {
      still_[c] = std::clamp(0.0, settings.limits[c].lower, settings.limits[c].upper);
    }
  }

  Result<DrivePlan> plan() {
    find_wanted();
    DrivePlan plan;
    plan.rows = rows_;
    plan.widths.push_back({0, known_.widths()});
    put_down(&plan);
    while (left_s() > 1e-9 && !enough()) {
      const std::optional<Chosen> next = choose(left_s());
      if (!next && t_s_ > 0) {
        take(learned({{still_, kRest_s}}), &plan);
        if (left_s() < kMoves_s[0]) return judged(std::move(plan));
        put_down(&plan);
        continue;
      }
      if (!next) {
        return Error{
            "no move of half a second or more keeps the robot on this floor; give it a "
            "larger --place, or lower --limit"};
      }
      take(*next, &plan);
    }
    take(learned({{still_, kRest_s}}), &plan);
    return judged(std::move(plan));
  }

 private:
  struct Chosen {
    std::vector<Move> moves;
    std::vector<Pose> ends;  // of the moves, world
    Knowledge known;
  };

  double left_s() const { return settings_.seconds - kRest_s - before_s_ - t_s_; }

  // In the middle of the floor, for another run.
  void put_down(DrivePlan* plan) {
    before_s_ += t_s_;
    t_s_ = 0;
    X_WM_ = {};
    commands_.clear();
    known_.put_down();
    LoggedRun& run = plan->drive.runs.emplace_back();
    run.run = std::to_string(plan->drive.runs.size());
    run.poses.push_back({0, {}});
  }

  void find_wanted() {
    wanted_ = settings_.wanted;
    if (wanted_.empty()) {
      wanted_ = mapped(rows_, [](const KinematicRow& row) { return Wanted{row.name, 0}; });
    }
    for (const Wanted& wanted : wanted_) {
      index_.push_back(std::ranges::find(rows_, wanted.name, &KinematicRow::name) - rows_.begin());
    }
  }

  bool enough() const {
    const Eigen::VectorXd widths = known_.widths();
    for (std::size_t k = 0; k < wanted_.size(); ++k) {
      if (widths[index_[k]] > wanted_[k].width) return false;
    }
    return true;
  }

  // The sum of the logarithms of what is still too wide.
  double spread(const Eigen::VectorXd& widths) const {
    double sum = 0;
    for (std::size_t k = 0; k < wanted_.size(); ++k) {
      sum += std::log(std::max({widths[index_[k]], wanted_[k].width, 1e-12}));
    }
    return sum;
  }

  Move draw(double most_s) {
    Move move{still_, 0};
    for (std::size_t c = 0; c < move.command.size(); ++c) {
      const double level = kLevels[stream_.below(std::size(kLevels))];
      const Interval& limit = settings_.limits[c];
      move.command[c] = std::clamp(level < 0 ? -level * limit.lower : level * limit.upper,
                                   limit.lower, limit.upper);
    }
    move.seconds = std::min(kMoves_s[stream_.below(std::size(kMoves_s))], most_s);
    return move;
  }

  // Of the marker from now on.
  struct Path {
    CommandedRun run;
    std::vector<double> times_s;
    std::vector<Pose> at;  // the steps between them
  };

  Path path_of(const std::vector<Move>& moves) const {
    Path path;
    path.run.start_s = t_s_ - kMemory_s;
    if (path.run.start_s <= 0) {  // it stood before
      path.run.start_s = -kMemory_s;
      path.run.commands.push_back({-kMemory_s, still_});
    }
    // The command that holds where the memory begins, and those after it.
    for (std::size_t i = 0; i < commands_.size(); ++i) {
      const bool over = i + 1 < commands_.size() && commands_[i + 1].t_s <= path.run.start_s;
      if (!over) path.run.commands.push_back(commands_[i]);
    }
    double t = t_s_;
    for (const Move& move : moves) {
      path.run.commands.push_back({t, move.command});
      t += move.seconds;
    }
    const auto count =
        static_cast<std::size_t>(std::max(1.0, std::round((t - t_s_) / kPoseEvery_s)));
    for (std::size_t i = 0; i <= count; ++i) {
      path.times_s.push_back(t_s_ +
                             (t - t_s_) * static_cast<double>(i) / static_cast<double>(count));
    }
    path.at = steps_.between(path.run, path.times_s);
    return path;
  }

  bool stays_on_floor(const Path& path) const {
    Pose X = X_WM_;
    return std::ranges::all_of(path.at, [&](const Pose& step) {
      X = X * step;
      return std::abs(X.x) <= settings_.length_m / 2 && std::abs(X.y) <= settings_.width_m / 2;
    });
  }

  Chosen learned(const std::vector<Move>& moves) const {
    const Path path = path_of(moves);
    const std::vector<Eigen::MatrixXd> slopes = steps_.slopes(path.run, path.times_s, path.at);
    Chosen chosen{moves, {}, known_};
    Pose X = X_WM_;
    double end = t_s_ + moves.front().seconds;
    for (std::size_t i = 0; i < path.at.size(); ++i) {
      const Pose& step = path.at[i];
      const double from_s = path.times_s[i], to_s = path.times_s[i + 1];
      chosen.known.learn(step, slopes[i]);
      while (chosen.ends.size() < moves.size() && to_s >= end - 1e-9) {
        const double share = std::min(1.0, (end - from_s) / (to_s - from_s));
        chosen.ends.push_back(X * Pose{share * step.x, share * step.y, share * step.theta});
        if (chosen.ends.size() < moves.size()) end += moves[chosen.ends.size()].seconds;
      }
      X = X * step;
    }
    chosen.ends.resize(moves.size(), X);
    return chosen;
  }

  std::optional<Chosen> choose(double most_s) {
    std::optional<Chosen> best;
    // Widths that shrink with the root of the time lose half a nat in all of it so far: who learns
    // far less stands, before a wall that it cannot back away from.
    const double usual_rate = 0.5 * static_cast<double>(wanted_.size()) / (before_s_ + t_s_);
    double best_rate = t_s_ > 0 ? kStands * usual_rate : 0;
    const double before = spread(known_.widths());
    for (unsigned i = 0, tried = 0; i < settings_.pool && tried < 20 * settings_.pool; ++tried) {
      std::vector<Move> moves = {draw(most_s)};
      if (most_s - moves[0].seconds > 0.1) moves.push_back(draw(most_s - moves[0].seconds));
      // It has to be able to stop there, too.
      moves.push_back({still_, kRest_s});
      if (!stays_on_floor(path_of(moves))) continue;
      moves.pop_back();
      Chosen candidate = learned(moves);
      ++i;
      if (settings_.random) return candidate;
      const double rate =
          (before - spread(candidate.known.widths())) / sum_of(moves, &Move::seconds);
      if (rate <= best_rate) continue;
      best_rate = rate;
      best = std::move(candidate);
    }
    return best;
  }

  // A root of what these moves would tell a second from here on.
  Rows rate_of(const std::vector<Move>& moves) const {
    const Path path = path_of(moves);
    const double seconds = path.times_s.back() - path.times_s.front();
    return known_.most_of(path.at, steps_.slopes(path.run, path.times_s, path.at)) /
           std::sqrt(seconds);
  }

  // By the moves that were taken and others, each behind moves of its own.
  DrivePlan judged(DrivePlan plan) {
    if (settings_.random) return plan;
    const double seconds = before_s_ + t_s_;
    for (unsigned i = 0; i < settings_.pool; ++i) {
      commands_.clear();
      for (t_s_ = 0; t_s_ < kMemory_s;) {
        const Move before = draw(kMemory_s);
        commands_.push_back({t_s_, before.command});
        t_s_ += before.seconds;
      }
      rates_.push_back(rate_of({draw(kMemory_s), draw(kMemory_s)}));
    }
    plan.best_share = best_over_drive(rates_, seconds, index_, known_.remaining());
    return plan;
  }

  void take(const Chosen& chosen, DrivePlan* plan) {
    if (!settings_.random) rates_.push_back(rate_of(chosen.moves));
    LoggedRun& run = plan->drive.runs.back();
    for (std::size_t i = 0; i < chosen.moves.size(); ++i) {
      const Move& move = chosen.moves[i];
      if (commands_.empty() || commands_.back().values != move.command) {
        commands_.push_back({t_s_, move.command});
        run.commands.push_back(commands_.back());
      }
      t_s_ += move.seconds;
      run.poses.push_back({t_s_, chosen.ends[i]});
    }
    X_WM_ = chosen.ends.back();
    known_ = chosen.known;
    plan->widths.push_back({before_s_ + t_s_, known_.widths()});
  }

  const DriveSettings& settings_;
  std::vector<KinematicRow> rows_;
  Steps steps_;
  std::vector<Wanted> wanted_;
  std::vector<std::ptrdiff_t> index_;  // of each wanted among the rows
  Knowledge known_;
  Stream stream_;
  std::vector<double> still_;
  std::vector<Rows> rates_;
  std::vector<CommandRow> commands_;
  Pose X_WM_;
  double before_s_ = 0;  // of driving, in runs before
  double t_s_ = 0;       // of this run
};

}  // namespace

Result<DrivePlan> plan_drive(const GroundRobot& robot, const DriveNoise& noise,
                             const DriveSettings& settings) {
  return Planner(robot, noise, settings).plan();
}

std::vector<WidthsAt> widths_of(const GroundRobot& robot, const DriveNoise& noise,
                                const RunLog& log, double every_s) {
  const std::vector<KinematicRow> rows = kinematic_rows(robot);
  const Steps steps(robot, rows);
  Knowledge known(robot, rows, noise);
  std::vector<WidthsAt> widths = {{0, known.widths()}};
  double driven_s = 0;
  for (const LoggedRun& logged : log.runs) {
    known.put_down();
    CommandedRun run;
    run.commands = logged.commands;
    run.start_s = logged.poses.front().t_s;
    std::vector<double> times = {run.start_s};
    for (const PoseRow& pose : logged.poses) {
      if (pose.t_s > times.back()) times.push_back(pose.t_s);
    }
    const std::vector<Pose> at = steps.between(run, times);
    const std::vector<Eigen::MatrixXd> slopes = steps.slopes(run, times, at);
    for (std::size_t i = 0; i < at.size(); ++i) {
      known.learn(at[i], slopes[i]);
      driven_s += times[i + 1] - times[i];
      if (driven_s < widths.back().t_s + every_s && i + 1 < at.size()) continue;
      widths.push_back({driven_s, known.widths()});
    }
  }
  return widths;
}

std::optional<double> seconds_until(const DrivePlan& plan, const std::vector<Wanted>& wanted,
                                    const Eigen::VectorXd& asked) {
  const auto spread = [&](const Eigen::VectorXd& widths) {
    double sum = 0;
    for (std::size_t k = 0; k < plan.rows.size(); ++k) {
      const bool of_it = wanted.empty() || contains(wanted, plan.rows[k].name, &Wanted::name);
      if (of_it) sum += std::log(std::max(widths[static_cast<Eigen::Index>(k)], 1e-12));
    }
    return sum;
  };
  for (const WidthsAt& at : plan.widths) {
    if (spread(at.widths) <= spread(asked)) return at.t_s;
  }
  return std::nullopt;
}

}  // namespace gapfarm::plan
