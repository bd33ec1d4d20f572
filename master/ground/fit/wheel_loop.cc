#include "master/ground/fit/wheel_loop.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/text.h"
#include "common/math/algebra.h"
#include "common/random/stream.h"
#include "common/robot/robot_drive.h"
#include "master/ground/search.h"
#include "master/ground/tolerances.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kStart_s = 1;   // of a run: wheels that stood are still speeding up
constexpr double kWindow_s = 2;  // over which speeds are averaged
constexpr double kLoopStep_s = 0.04;
constexpr int kWindowsABlock = 5;    // where there are few runs
constexpr double kLeastLoss = 0.02;  // of the fastest command: below it losses are in proportion
constexpr double kLooseGain = 1;     // prior s.d. about 1 and 0, so that one speed does
constexpr double kLooseLoss = 0.1;   // of the fastest command

struct LoopWindow {
  std::size_t block;
  double commanded, measured;
};

struct LoopWindows {
  std::vector<LoopWindow> all;
  std::size_t blocks = 0;
  double fastest = 1e-9;
};

void cut_run(const GroundRobot& robot, const RunLog& log, const LoggedRun& run, bool few,
             LoopWindows* to) {
  RobotDrive drive(robot, run.commands);
  CommandTrack measured(run.wheel_speeds, log.wheel_channels.size(), {});
  const double begin = std::max(run.commands.front().t_s, run.wheel_speeds.front().t_s);
  const double end = run.wheel_speeds.back().t_s;
  std::vector<double> commanded(robot.wheels.size(), 0.0), ran(log.wheel_channels.size(), 0.0);
  int windows = 0, steps = 0;
  for (double t = begin; t + kLoopStep_s <= end; t += kLoopStep_s) {
    const auto wheels = drive.advance(t, kLoopStep_s, 0);
    const std::vector<double>& now = measured.mean(t, kLoopStep_s);
    if (t < begin + kStart_s) continue;
    for (std::size_t i = 0; i < wheels.size(); ++i) commanded[i] += wheels[i].speed_m_s;
    for (std::size_t c = 0; c < now.size(); ++c) ran[c] += now[c];
    if (++steps * kLoopStep_s < kWindow_s - kLoopStep_s / 2) continue;
    const std::size_t block =
        to->blocks + (few ? static_cast<std::size_t>(windows / kWindowsABlock) : 0);
    for (std::size_t i = 0; i < wheels.size(); ++i) {
      const RobotWheel& wheel = robot.wheels[i];
      if (!wheel.driven) continue;
      to->all.push_back({block, commanded[i] / steps / *wheel.radius_m,
                         ran[*channel_of(wheel, log.wheel_channels)] / steps});
      to->fastest = std::max(to->fastest, std::abs(to->all.back().commanded));
    }
    std::fill(commanded.begin(), commanded.end(), 0.0);
    std::fill(ran.begin(), ran.end(), 0.0);
    steps = 0;
    ++windows;
  }
  to->blocks += few ? static_cast<std::size_t>((windows + kWindowsABlock - 1) / kWindowsABlock) : 1;
}

LoopWindows loop_windows(const GroundRobot& robot, const RunLog& log) {
  LoopWindows windows;
  for (const LoggedRun& run : log.runs) {
    if (run.commands.empty() || run.wheel_speeds.empty()) continue;
    cut_run(robot, log, run, log.runs.size() < kEnoughToScatter, &windows);
  }
  return windows;
}

// What a loop takes off at a command, per unit of its loss.
double lost(double commanded, double fastest) {
  return std::clamp(commanded / (kLeastLoss * fastest), -1.0, 1.0);
}

// Gain and loss (rad/s) of measured = gain commanded - loss sign(commanded); each block counts
// `times`.
Eigen::Vector2d fit_loop(const LoopWindows& windows, const std::vector<double>& times) {
  const double loose = kLooseLoss * windows.fastest;
  // One speed's error in units of the fastest: priors only keep the equations sound.
  const double weight = 1e4 / (windows.fastest * windows.fastest);
  Eigen::Matrix2d A =
      Eigen::Vector2d(1 / (kLooseGain * kLooseGain), 1 / (loose * loose)).asDiagonal();
  Eigen::Vector2d b(1 / (kLooseGain * kLooseGain), 0);
  for (const LoopWindow& w : windows.all) {
    const Eigen::Vector2d x(w.commanded, -lost(w.commanded, windows.fastest));
    const double use = weight * times[w.block];
    A += use * x * x.transpose();
    b += use * w.measured * x;
  }
  return solve_symmetric(A, b);
}

struct Shares {
  double share, expected;
};

Shares shares_of(const LoopWindows& windows, const std::vector<double>& times,
                 const Eigen::Vector2d& loop, double fastest) {
  double ran = 0, expected = 0, commanded = 0;
  for (const LoopWindow& w : windows.all) {
    const double use = times[w.block];
    const double sign = w.commanded < 0 ? -1 : 1;
    ran += use * sign * w.measured;
    expected += use * sign * (loop[0] * w.commanded - loop[1] * lost(w.commanded, fastest));
    commanded += use * sign * w.commanded;
  }
  return {ran / std::max(commanded, 1e-9), expected / std::max(commanded, 1e-9)};
}

std::vector<double> draw_again(std::size_t blocks, Stream* stream) {
  std::vector<double> times(blocks, 0.0);
  for (std::size_t k = 0; k < blocks; ++k) times[stream->below(blocks)] += 1;
  return times;
}

}  // namespace

bool has_wheel_speeds(const GroundRobot& robot, const RunLog& log) {
  if (is_steered(robot) || robot.measured || log.runs.empty()) return false;
  for (const RobotWheel& wheel : robot.wheels) {
    if (wheel.driven && !channel_of(wheel, log.wheel_channels)) return false;
  }
  return std::all_of(log.runs.begin(), log.runs.end(),
                     [](const LoggedRun& run) { return run.wheel_speeds.size() > 1; });
}

GroundRobot driven_by_wheels(GroundRobot robot, const RunLog& log) {
  robot.command = CommandKind::kWheelSpeeds;
  robot.channels = log.wheel_channels;
  robot.measured = true;
  robot.motors = {};
  return robot;
}

RunLog driven_by_wheels(RunLog log) {
  log.channels = log.wheel_channels;
  for (LoggedRun& run : log.runs) {
    run.commands = run.wheel_speeds;
    const auto driving = std::ranges::find_if(
        run.poses, [&](const PoseRow& p) { return p.t_s >= run.poses.front().t_s + kStart_s; });
    run.poses.erase(run.poses.begin(), driving);
  }
  return log;
}

double wheel_rows_late_s(const GroundRobot& driven, const RunLog& wheels,
                         const WindowSettings& windows) {
  const auto set = window_set(driven, wheels, windows);
  if (!set) return 0;
  std::vector<double> apart;
  for (const LoggedRun& run : wheels.runs) {
    for (std::size_t i = 1; i < run.commands.size(); ++i) {
      apart.push_back(run.commands[i].t_s - run.commands[i - 1].t_s);
    }
  }
  const double row_s = median(std::move(apart));
  const std::optional<GroundReference> none;
  const WindowFitter fitter(driven, *set, none);
  const std::vector<FitRow> rows = held_rows(kinematic_rows(driven));
  Eigen::VectorXd values = nominals(rows);
  double best = fitter.hold(rows, values).objective + kFaultGain, late_s = 0;
  for (const double late : {0.5, 1.0}) {
    values[row_index(rows, "delay")] = -late * row_s;
    const double objective = fitter.hold(rows, values).objective;
    if (objective <= best) continue;
    best = objective;
    late_s = late * row_s;
  }
  return late_s;
}

WheelLoop measure_wheel_loop(const GroundRobot& robot, const RunLog& log, const RunLog* reference,
                             std::uint64_t seed) {
  const LoopWindows here = loop_windows(robot, log);
  WheelLoop result;
  if (here.all.empty()) return result;
  LoopWindows there;
  if (reference != nullptr) there = loop_windows(robot, *reference);
  const bool compare = !there.all.empty();
  const auto loop_of = [&](const std::vector<double>& times) {
    return compare ? fit_loop(there, times) : Eigen::Vector2d(1, 0);
  };
  const double fastest = compare ? there.fastest : here.fastest;
  const auto once = [](const LoopWindows& of) { return std::vector<double>(of.blocks, 1.0); };
  const auto [share, expected] = shares_of(here, once(here), loop_of(once(there)), fastest);
  Stream stream({seed, Purpose::kStatistics, 3, 0, 0});
  double sum = 0, squares = 0;
  for (int d = 0; d < kDraws; ++d) {
    const Eigen::Vector2d loop = loop_of(draw_again(there.blocks, &stream));
    const Shares drawn = shares_of(here, draw_again(here.blocks, &stream), loop, fastest);
    const double change = drawn.share / drawn.expected - 1;
    sum += change;
    squares += change * change;
  }
  const double mean = sum / kDraws;
  const double variance = std::max(0.0, squares / kDraws - mean * mean);
  const double change = share / expected - 1, wide = 1.645 * std::sqrt(variance);
  result.share = share;
  result.expected = expected;
  result.change = {"wheel_speed", change, change - wide, change + wide, "-"};
  result.gain = change * change / 2 / (variance + kLoopShare * kLoopShare);
  return result;
}

void report_wheel_loop(const WheelLoop& loop, bool against_reference, Diagnosis* diagnosis) {
  const Estimate& c = loop.change;
  const std::string speeds =
      against_reference
          ? fmt::format(
                "the wheels run at {:.0f} % of their set speed, where the reference's loop would "
                "at {:.0f} % ({})",
                100 * loop.share, 100 * loop.expected,
                with_interval("%+.0f", 100 * c.value, 100 * c.lo, 100 * c.hi, "%"))
          : "the wheels run at " +
                with_interval("%.0f", 100 * loop.share, 100 * (1 + c.lo), 100 * (1 + c.hi), "%") +
                " of their set speed";
  if (loop.gain < kLeastChangeGain) {
    diagnosis->cautions.push_back(
        "From command to wheel no more speed is lost than a loop loses by itself: " + speeds + ".");
    return;
  }
  static const std::set<std::string> kFloors = {"floor", "wheel_slip", "friction_across"};
  for (NamedEffect& effect : diagnosis->effects) {
    if (!against_reference || kFloors.count(effect.name) == 0) continue;
    effect.parameters.push_back(c);
    if (!effect.text.empty() && effect.text.back() == '.') effect.text.pop_back();
    effect.text += "; under its load " + speeds + ".";
    return;
  }
  NamedEffect effect;
  effect.name = "wheel_loop";
  effect.aliases = {"payload", "battery_voltage", "motor_deadband"};
  effect.alias_reason = "Each makes the motors run short of what they are commanded to.";
  effect.confidence = std::min(0.99, 1 - 0.5 * std::exp((kLeastChangeGain - loop.gain) / 2));
  effect.parameters = {c};
  effect.text = "From command to wheel " + speeds + ".";
  diagnosis->effects.push_back(std::move(effect));
}

}  // namespace gapfarm
