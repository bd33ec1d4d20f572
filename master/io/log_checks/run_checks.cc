#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "common/pose/pose.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

// Nine tenths of a run's poses lie within it of their middle: a tracker's noise.
constexpr double kNoMove_m = 0.2;
// No robot that drives is slower than both, a hundredth of its steps aside.
constexpr double kSlow_m_s = 5e-3, kSlow_rad_s = 5e-3;
constexpr std::size_t kFewestSteps = 10;
constexpr double kLeastWay_s = 1;     // what is compared of a run at once
constexpr double kUnexplained = 0.5;  // of the squared ways
constexpr double kLeastGap_s = 10;    // twice the longest windows
constexpr double kTimesUsualGap = 50;
constexpr double kManyStale = 0.1;  // of the time that a robot is commanded to drive
// Of a step, over what four in five are and over those about it: no robot gathers speed so fast.
constexpr double kTimesUsualStep = 20;
constexpr double kLeastJump_m = 0.1;
constexpr double kLeastGridSteps = 3;  // coarse grids step by one and aside, with none in between
constexpr double kLeastTurn_rad = 0.5, kMostTurn_rad = 1.57;
constexpr double kTimesAStep = 3;       // where half a turn is no more than a few of them
constexpr std::size_t kNeighbours = 4;  // either way
constexpr double kUsualShare = 0.8;     // of the steps are shorter: a tracker may lose some
constexpr double kMostLost = 0.1;       // of a run or one pose, before the tracker found the robot

std::string name_of(const LoggedRun& run) { return "run " + run.run; }

bool is_drive(const CommandRow& row) {
  return std::ranges::any_of(row.values, [](double v) { return v != 0; });
}

bool is_commanded(const LoggedRun& run) { return std::ranges::any_of(run.commands, is_drive); }

bool never_moves(const LoggedRun& run) {
  return run.poses.size() > 1 && std::ranges::all_of(run.poses, [&](const PoseRow& row) {
           return row.X_WM == run.poses.front().X_WM;
         });
}

// Headings that are one number although the robot turns: where it does not, how far it goes each
// way is its commands times a constant.
bool never_turns_but_does(const LoggedRun& run) {
  if (run.poses.size() < 2 || run.commands.empty()) return false;
  const double heading = run.poses.front().X_WM.theta;
  const auto turns = [&](const PoseRow& row) { return row.X_WM.theta != heading; };
  if (std::ranges::any_of(run.poses, turns)) return false;
  const auto channels = static_cast<Eigen::Index>(run.commands.front().values.size());
  std::vector<Eigen::VectorXd> commanded;
  std::vector<Eigen::Vector2d> ways;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(channels);
  auto from = run.poses.begin();
  for (std::size_t i = 1; i < run.commands.size(); ++i) {
    const CommandRow &held = run.commands[i - 1], &next = run.commands[i];
    sum += (next.t_s - held.t_s) * Eigen::Map<const Eigen::VectorXd>(held.values.data(), channels);
    const auto to = std::ranges::lower_bound(run.poses, next.t_s, {}, &PoseRow::t_s);
    if (to == run.poses.end()) break;
    if (to->t_s - from->t_s < kLeastWay_s) continue;
    commanded.push_back(std::exchange(sum, Eigen::VectorXd::Zero(channels)));
    ways.emplace_back(to->X_WM.x - from->X_WM.x, to->X_WM.y - from->X_WM.y);
    from = to;
  }
  if (ways.size() < kFewestSteps) return false;
  Eigen::MatrixXd A(ways.size(), channels), B(ways.size(), 2);
  for (std::size_t i = 0; i < ways.size(); ++i) {
    A.row(static_cast<Eigen::Index>(i)) = commanded[i];
    B.row(static_cast<Eigen::Index>(i)) = ways[i];
  }
  const Eigen::MatrixXd left = B - A * A.colPivHouseholderQr().solve(B);
  return left.squaredNorm() > kUnexplained * B.squaredNorm();
}

bool travels(const LoggedRun& run) {
  if (run.poses.empty()) return false;
  return quantile(from_middle(mapped(run.poses, &PoseRow::X_WM)), 0.9) > kNoMove_m;
}

bool is_slow(const LoggedRun& run) {
  std::vector<double> speeds;  // 1 at either limit
  for (std::size_t i = 1; i < run.poses.size(); ++i) {
    const PoseRow &a = run.poses[i - 1], &b = run.poses[i];
    const Pose X_AB = between(a.X_WM, b.X_WM);
    const double way = std::hypot(X_AB.x, X_AB.y) / kSlow_m_s;
    speeds.push_back(std::max(way, std::abs(X_AB.theta) / kSlow_rad_s) / (b.t_s - a.t_s));
  }
  return speeds.size() >= kFewestSteps && quantile(speeds, 0.99) < 1;
}

bool same_poses(const LoggedRun& a, const LoggedRun& b) {
  return std::ranges::equal(a.poses, b.poses, {}, &PoseRow::X_WM, &PoseRow::X_WM);
}

// Where something is odd: the first place, and how many.
struct Places {
  std::string first;
  std::size_t count = 0;

  void add(const std::function<std::string()>& text) {
    if (count++ == 0) first = text();
  }
  std::string text() const {
    return first + (count > 1 ? " and " + std::to_string(count - 1) + " more" : "");
  }
};

void add_useless_runs(const RunLog& log, RunChecks* checks) {
  Places still, unturned, driverless, slow, copies;
  for (std::size_t r = 0; r < log.runs.size(); ++r) {
    const LoggedRun& run = log.runs[r];
    const auto is_copied = [&](std::size_t other) { return same_poses(run, log.runs[other]); };
    std::size_t first = 0;
    while (first < r && !is_copied(first)) ++first;
    Places* of = nullptr;
    if (never_moves(run) && is_commanded(run)) of = &still;
    if (of == nullptr && travels(run) && never_turns_but_does(run)) of = &unturned;
    if (!is_commanded(run) && travels(run)) of = &driverless;
    if (of == nullptr && is_commanded(run) && is_slow(run)) of = &slow;
    if (first < r && run.poses.size() > 1 && of == nullptr) of = &copies;
    if (of == nullptr) continue;
    of->add([&] {
      return name_of(run) + (of == &copies ? " (" + name_of(log.runs[first]) + " again)" : "");
    });
    checks->useless.push_back(r);
  }
  const Severity severity = checks->none_is_left(log) ? Severity::kUnusable : Severity::kNote;
  const auto report = [&](const Places& of, const char* name, const std::string& what,
                          const char* remedy) {
    if (of.count > 0) checks->findings.push_back({name, what + of.text() + ".", remedy, severity});
  };
  report(still, "still_runs", "The poses never change, though the robot is commanded to drive: ",
         "Log these runs again: the tracker stood still, or the robot. They are omitted.");
  report(unturned, "still_headings", "The headings never change, though the robot turns: ",
         "Look where headings come from: qx, qy, qz, qw in another order make one. These runs are "
         "omitted.");
  report(driverless, "uncommanded_runs", "Every command is 0, though the robot travels: ",
         "Log the commands that it was driven by. These runs are omitted.");
  report(slow, "slow_runs",
         "The robot is slower than 5 mm/s and 5 mrad/s all the time, as if times were in ms: ",
         "Write times in s. These runs are omitted.");
  report(copies, "repeated_runs",
         "Every pose is another run's: ", "Name each run once. The copies are omitted.");
}

struct Step {
  double length = 0;  // a usual time between poses
  std::size_t run = 0, to = 0;
};

using Length = std::function<double(const Pose&, const Pose&)>;

// Of each pose but the first, s since the one before.
std::vector<double> times_between(const LoggedRun& run) {
  std::vector<double> apart_s;
  for (std::size_t i = 1; i < run.poses.size(); ++i) {
    apart_s.push_back(run.poses[i].t_s - run.poses[i - 1].t_s);
  }
  return apart_s;
}

// Of each pose, how many usual times it comes after the one before; one at least.
std::vector<double> usual_times(const LoggedRun& run) {
  const std::vector<double> apart_s = times_between(run);
  const double usual_s = apart_s.empty() ? 1 : std::max(median(apart_s), 1e-9);
  std::vector<double> times = {1};
  for (const double s : apart_s) times.push_back(std::max(1.0, s / usual_s));
  return times;
}

struct Jumps {
  std::vector<Step> steps;
  std::vector<Step> lone;  // of these, to a pose that the next step leads back from
  double usual = 0;        // what no other step is longer than
};

// Steps that are far longer than most, and than those about them; of two there and back a few times
// as long are.
Jumps jumps_of(const RunLog& log, double least, double most, const Length& length) {
  std::vector<Step> steps;
  std::vector<double> all;
  for (std::size_t r = 0; r < log.runs.size(); ++r) {
    const std::vector<PoseRow>& poses = log.runs[r].poses;
    const std::vector<double> times = usual_times(log.runs[r]);
    for (std::size_t i = 1; i < poses.size(); ++i) {
      steps.push_back({length(poses[i - 1].X_WM, poses[i].X_WM) / times[i], r, i});
      all.push_back(steps.back().length);
    }
  }
  Jumps jumps;
  if (all.empty()) return jumps;
  const auto limit = [&](double about) {
    return std::min(kTimesUsualStep * about, std::max(most, kTimesAStep * about));
  };
  const double most_are = quantile(all, kUsualShare);
  jumps.usual = std::max(least, limit(most_are));
  const auto returns = [&](const Step& there, const Step& back, double about) {
    const double shorter = std::min(there.length, back.length);
    if (there.run != back.run || shorter < std::max(least, kTimesAStep * about)) return false;
    const std::vector<PoseRow>& poses = log.runs[there.run].poses;
    return length(poses[there.to - 1].X_WM, poses[back.to].X_WM) < shorter / 2;
  };
  for (std::size_t k = 0; k < steps.size(); ++k) {
    if (!(steps[k].length > std::max(least, kTimesAStep * most_are))) continue;
    std::vector<double> about;
    const std::size_t end = std::min(steps.size(), k + kNeighbours + 1);
    for (std::size_t j = k - std::min(k, kNeighbours); j < end; ++j) {
      if (j != k && steps[j].run == steps[k].run) about.push_back(steps[j].length);
    }
    if (about.empty()) continue;
    const double near = std::max(most_are, median(about));
    const bool there = k + 1 < steps.size() && returns(steps[k], steps[k + 1], near);
    const bool back = k > 0 && returns(steps[k - 1], steps[k], near);
    const bool far = steps[k].length > jumps.usual && steps[k].length > limit(median(about));
    if (there) jumps.lone.push_back(steps[k]);
    if (there || back || far) jumps.steps.push_back(steps[k]);
  }
  return jumps;
}

// The middle of the longest stretch between these steps of a run.
std::size_t surest_pose(const std::vector<std::size_t>& cuts, std::size_t poses) {
  std::size_t from = 0, longest = 0, middle = 0;
  const auto end_at = [&](std::size_t end) {
    if (end - from > longest) {
      longest = end - from;
      middle = from + longest / 2;
    }
    from = end;
  };
  for (const std::size_t cut : cuts) end_at(cut);
  end_at(poses);
  return middle;
}

// From a sure pose to one end of a run: poses that no usual step leads to from where the robot was
// last; where they are too many, it is there from then on.
std::vector<std::size_t> lost_poses(const LoggedRun& run, std::size_t start, int way, double usual,
                                    const Length& length) {
  const std::vector<PoseRow>& poses = run.poses;
  const std::vector<double> times = usual_times(run);
  const auto share = static_cast<std::size_t>(kMostLost * static_cast<double>(poses.size()));
  const std::size_t most = std::max<std::size_t>(1, share);
  std::vector<std::size_t> all, lost;
  std::size_t last = start;
  for (std::size_t i = start + way; i < poses.size(); i += way) {  // below 0 it is large
    const auto leads = [&](std::size_t from, double longer) {
      return length(poses[from].X_WM, poses[i].X_WM) <= usual * longer;
    };
    // It went on while it was lost, a usual step at a time.
    const double time = times[way > 0 ? i : i + 1];
    const double more = static_cast<double>(lost.size()) / kTimesUsualStep;
    const bool is_back = leads(last, time + more);
    if (!is_back) lost.push_back(i);
    if (!is_back && lost.size() <= most) continue;
    // Back without a jump it had only gone on.
    const bool was_lost = is_back && !lost.empty() && !leads(lost.back(), time);
    if (was_lost) append(all, lost);
    lost.clear();
    last = i;
  }
  append(all, lost);
  return all;
}

void omit_jumps(const RunLog& log, const Jumps& jumps, const Length& length, RunChecks* checks) {
  for (const Step& step : jumps.lone) checks->false_poses.insert({step.run, step.to});
  for (std::size_t r = 0; r < log.runs.size(); ++r) {
    std::vector<std::size_t> cuts;
    for (const Step& step : jumps.steps) {
      if (step.run == r) cuts.push_back(step.to);
    }
    if (cuts.empty()) continue;
    const std::size_t start = surest_pose(cuts, log.runs[r].poses.size());
    for (const int way : {1, -1}) {
      for (const std::size_t i : lost_poses(log.runs[r], start, way, jumps.usual, length)) {
        checks->false_poses.insert({r, i});
      }
    }
  }
}

void add_gaps(const RunLog& log, RunChecks* checks) {
  Places gaps;
  for (const LoggedRun& run : log.runs) {
    const std::vector<double> apart_s = times_between(run);
    if (apart_s.empty()) continue;
    const double most_s = std::max(kLeastGap_s, kTimesUsualGap * median(apart_s));
    for (std::size_t i = 0; i < apart_s.size(); ++i) {
      if (!(apart_s[i] > most_s)) continue;
      gaps.add([&] {
        return "for " + few_digits(apart_s[i]) + " s from t " + few_digits(run.poses[i].t_s) +
               " s of " + name_of(run);
      });
    }
  }
  if (gaps.count == 0) return;
  checks->findings.push_back({"pose_gaps", "There is no pose " + gaps.text() + ".",
                              "Number what follows a gap as another run.", Severity::kNote});
}

void add_stale_commands(const RunLog& log, double timeout_s, RunChecks* checks) {
  double all_s = 0, stale_s = 0;
  for (const LoggedRun& run : log.runs) {
    for (std::size_t i = 1; i < run.commands.size(); ++i) {
      const CommandRow& row = run.commands[i - 1];
      if (!is_drive(row)) continue;
      const double held_s = run.commands[i].t_s - row.t_s;
      all_s += held_s;
      stale_s += std::max(0.0, held_s - timeout_s);
    }
  }
  if (!(stale_s > kManyStale * all_s)) return;
  checks->findings.push_back(
      {"stale_commands",
       "For " + few_digits(100 * stale_s / all_s) +
           " % of the time that it is commanded to drive the last command is older than the "
           "robot's cmd_vel_timeout (" +
           few_digits(timeout_s) + " s), when a robot stops.",
       "If it drove on, log all commands; or, where the log keeps changes alone, remove "
       "cmd_vel_timeout from the robot's file.",
       Severity::kNote});
}

}  // namespace

RunChecks check_runs(const RunLog& log, std::optional<double> timeout_s) {
  RunChecks checks;
  add_useless_runs(log, &checks);
  add_gaps(log, &checks);
  check_gyro(log, &checks);
  check_standing(log, &checks);
  if (timeout_s) add_stale_commands(log, *timeout_s, &checks);
  return checks;
}

PoseGrid grid_of(const RunLog& log) {
  if (log.relative) return {};
  return pose_grid(mapped(flattened(log.runs, &LoggedRun::poses), &PoseRow::X_WM));
}

RunChecks check_jumps(const RunLog& log) {
  RunChecks checks;
  if (log.relative) return checks;
  const double least_m = std::max(kLeastJump_m, kLeastGridSteps * grid_of(log).step_m);
  const auto report = [&](double least, double most, const char* name, const char* what,
                          const char* unit, const Length& length) {
    const Jumps jumps = jumps_of(log, least, most, length);
    if (jumps.steps.empty()) return;
    const std::size_t before = checks.false_poses.size();
    omit_jumps(log, jumps, length, &checks);
    const auto far = std::ranges::max_element(jumps.steps, {}, &Step::length);
    const LoggedRun& run = log.runs[far->run];
    checks.findings.push_back(
        {name,
         std::string(what) + " jump " + std::to_string(jumps.steps.size()) +
             " times, the farthest by " + few_digits(far->length) + " " + unit + " at t " +
             few_digits(run.poses[far->to].t_s) + " s of " + name_of(run) + "; " +
             std::to_string(checks.false_poses.size() - before) +
             " poses that no step leads to are omitted.",
         "Remove poses that the tracker took from elsewhere, and number what follows a lasting "
         "jump as another run.",
         Severity::kNote});
  };
  report(least_m, INFINITY, "pose_jumps", "Positions", "m",
         [](const Pose& a, const Pose& b) { return std::hypot(b.x - a.x, b.y - a.y); });
  report(kLeastTurn_rad, kMostTurn_rad, "heading_jumps", "Headings", "rad",
         [](const Pose& a, const Pose& b) { return std::abs(wrap_angle(b.theta - a.theta)); });
  return checks;
}

RunLog without(RunLog log, const RunChecks& checks) {
  for (auto pose = checks.false_poses.rbegin(); pose != checks.false_poses.rend(); ++pose) {
    std::vector<PoseRow>& poses = log.runs[pose->first].poses;
    poses.erase(poses.begin() + static_cast<std::ptrdiff_t>(pose->second));
  }
  for (LoggedRun& run : log.runs) {
    if (checks.gyro_is_wrong) run.yaw_rates.clear();
  }
  for (auto r = checks.useless.rbegin(); r != checks.useless.rend(); ++r) {
    log.runs.erase(log.runs.begin() + static_cast<std::ptrdiff_t>(*r));
  }
  return log;
}

}  // namespace gapfarm
