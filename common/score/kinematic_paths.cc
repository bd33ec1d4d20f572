#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "common/score/kinematic_body.h"

namespace gapfarm {
namespace {

constexpr double kStep_s = 0.05;      // the longest
constexpr double kApart_s = 0.01;     // of changes of a command that count from when they came on
constexpr double kMeasured_s = 0.02;  // between places that are straight between

// Where a run's marker was measured, straight on between.
class MeasuredPath {
 public:
  void add(double t_s, const Pose& X_WM) { poses_[t_s] = X_WM; }

  Pose at(double t_s) const {
    const auto after = poses_.lower_bound(t_s);
    if (after == poses_.begin()) return after->second;
    const auto before = std::prev(after);
    if (after == poses_.end()) return before->second;
    const double share = (t_s - before->first) / (after->first - before->first);
    return before->second * exp(Twist(share * log(between(before->second, after->second))));
  }

 private:
  std::map<double, Pose> poses_;
};

Eigen::Vector2d direction(double heading_rad) {
  return {std::cos(heading_rad), std::sin(heading_rad)};
}

// `to` seen from axes that point along `ahead`, both turned back by as much.
Eigen::Vector2d turned(const Eigen::Vector2d& ahead, const Eigen::Vector2d& to) {
  return {ahead[0] * to[0] - ahead[1] * to[1], ahead[1] * to[0] + ahead[0] * to[1]};
}

// A pose and its heading's direction, so that a step needs no sine.
struct Moving {
  Pose X;
  Eigen::Vector2d ahead = Eigen::Vector2d::UnitX();

  // X * exp(xi), by the series of sin(t) / t and (1 - cos(t)) / t where a step turns little: what
  // is left of them below 0.1 rad is less than a double holds.
  void advance(const Twist& xi) {
    const double t = xi[2], t2 = t * t;
    double a, b;
    if (std::abs(t) < 0.1) {
      a = 1 - t2 / 6 * (1 - t2 / 20 * (1 - t2 / 42 * (1 - t2 / 72)));
      b = t / 2 * (1 - t2 / 12 * (1 - t2 / 30 * (1 - t2 / 56 * (1 - t2 / 90))));
    } else {
      a = std::sin(t) / t;
      b = (1 - std::cos(t)) / t;
    }
    const Eigen::Vector2d way = turned(ahead, turned({a, b}, xi.head<2>()));
    X = {X.x + way[0], X.y + way[1], wrap_angle(X.theta + t)};
    ahead = turned(ahead, {1 - b * t, a * t});
  }
};

// Values that change how poses are seen, and no motion unless it matters where the robot is.
bool is_of_view(std::string_view name) {
  return name.starts_with("marker_") || name == "pose_scale" || name == "aspect";
}

}  // namespace

KinematicPaths::KinematicPaths(const GroundRobot& robot, std::span<const CommandedRun> runs,
                               std::span<const Trial> trials)
    : robot_(robot), runs_(runs), trials_(trials), paths_(runs.size()) {
  const auto first = std::ranges::find_if(runs, [](const auto& r) { return !r.commands.empty(); });
  if (first != runs.end()) began_s_ = first->commands.front().t_s;
  for (const Trial& trial : trials) {
    paths_[*trial.run].times.push_back(*trial.t_s);
    paths_[*trial.run].times.push_back(*trial.t_s + *trial.duration_s);
  }
  for (Path& path : paths_) {
    std::ranges::sort(path.times);
    path.times.erase(std::unique(path.times.begin(), path.times.end()), path.times.end());
  }
  for (const Trial& trial : trials) {
    const std::vector<double>& times = paths_[*trial.run].times;
    const auto index = [&](double t_s) {
      return static_cast<std::size_t>(std::ranges::lower_bound(times, t_s) - times.begin());
    };
    ends_.push_back({index(*trial.t_s), index(*trial.t_s + *trial.duration_s)});
  }
}

void KinematicPaths::measure() const {
  std::vector<MeasuredPath> measured(paths_.size());
  for (const Trial& trial : trials_) {
    measured[*trial.run].add(*trial.t_s, trial.X_WS);
    measured[*trial.run].add(*trial.t_s + *trial.duration_s, trial.X_WE);
  }
  for (std::size_t i = 0; i < paths_.size(); ++i) {
    Path& path = paths_[i];
    if (path.times.empty() || !path.markers.empty()) continue;
    const double last_s = path.times.back() + kMeasured_s;
    for (double t = runs_[i].start_s; t <= last_s || path.markers.size() < 2; t += kMeasured_s) {
      const Pose X_WM = measured[i].at(t);
      path.markers.push_back({{X_WM.x, X_WM.y}, direction(X_WM.theta)});
    }
  }
}

RobotPlace KinematicPaths::marker(std::size_t run, double t_s) const {
  const std::vector<RobotPlace>& markers = paths_[run].markers;
  const double at = std::clamp((t_s - runs_[run].start_s) / kMeasured_s, 0.0,
                               static_cast<double>(markers.size()) - 1.001);
  const RobotPlace& before = markers[static_cast<std::size_t>(at)];
  const RobotPlace& after = markers[static_cast<std::size_t>(at) + 1];
  const double share = at - std::floor(at);
  return {before.place_m + share * (after.place_m - before.place_m),
          before.ahead + share * (after.ahead - before.ahead)};
}

std::vector<Pose> KinematicPaths::poses(const KinematicBody& body, std::size_t run) const {
  std::vector<CommandRow> changed;
  RobotDrive drive(body.robot(), body.taken(runs_[run].commands, began_s_, &changed),
                   runs_[run].speed_m_s);
  const Pose X_MR = inverse(body.robot().X_RM);
  const Eigen::Vector2d turn = direction(X_MR.theta);
  std::vector<Pose> poses;
  Moving robot;
  double omega = runs_[run].turn_rad_s, t = runs_[run].start_s, change_s = t - kApart_s;
  for (const double asked : paths_[run].times) {
    // A step ends where a pose is asked for; commands count by how long they lasted before it.
    while (t < asked) {
      double end = std::min(t + kStep_s, asked);
      // What lags or ramps up begins to when it is commanded to, not at a step's start by its mean;
      // nor may a first lag make any other difference.
      const double change = drive.next_change(std::max(t, change_s + kApart_s), end);
      if (change > t && change < end) end = change_s = change;
      const double dt = end - t;
      RobotPlace place;
      if (body.knows_place()) {
        const RobotPlace measured = marker(run, t + dt / 2);
        const Pose X = body.unobserved({measured.place_m[0], measured.place_m[1], 0});
        place.place_m = Eigen::Vector2d(X.x, X.y) + turned(measured.ahead, {X_MR.x, X_MR.y});
        place.ahead = turned(measured.ahead, turn);
      }
      const RobotPlace* there = body.knows_place() ? &place : nullptr;
      const auto wheels = drive.advance_motors(t, dt, omega, body.forces(there));
      const Twist v = body.velocity(wheels, drive, there);
      omega = v[2];
      robot.advance(dt * v);
      t = end;
    }
    poses.push_back(robot.X);
  }
  return poses;
}

std::vector<Pose> KinematicPaths::ends(const Kinematics& kinematics, bool stays) const {
  const KinematicBody body(robot_, kinematics);
  if (body.knows_place()) measure();
  Kinematics driven;
  for (std::size_t k = 0; k < kinematics.names.size(); ++k) {
    const bool moves = body.knows_place() || !is_of_view(kinematics.names[k]);
    if (moves) driven.add(kinematics.names[k], kinematics.values[static_cast<Eigen::Index>(k)]);
  }
  std::vector<std::vector<Pose>> paths;
  if (!poses_.empty() && driven.names == driven_.names && driven.values == driven_.values) {
    paths = poses_;
  } else {
    for (std::size_t i = 0; i < paths_.size(); ++i) paths.push_back(poses(body, i));
    if (stays) {
      poses_ = paths;
      driven_ = std::move(driven);
    }
  }
  const Pose& X_RM = body.robot().X_RM;
  const Pose X_MR = inverse(X_RM);
  std::vector<Pose> ends;
  for (std::size_t i = 0; i < trials_.size(); ++i) {
    const std::vector<Pose>& path = paths[*trials_[i].run];
    const Pose X_SE = between(path[ends_[i].start], path[ends_[i].end]);
    ends.push_back(body.observed(body.unobserved(trials_[i].X_WS) * X_MR * X_SE * X_RM));
  }
  return ends;
}

std::vector<Pose> kinematic_ends(const Problem& problem, const Kinematics& kinematics) {
  return kinematic_ends(problem.ground->robot(), problem.runs, problem.log.trials, kinematics);
}

std::vector<Pose> kinematic_ends(const GroundRobot& robot, std::span<const CommandedRun> runs,
                                 std::span<const Trial> trials, const Kinematics& kinematics) {
  return KinematicPaths(robot, runs, trials).ends(kinematics);
}

}  // namespace gapfarm
