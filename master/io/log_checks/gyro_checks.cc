// A gyro of another sign, unit or clock than the headings, and headings that drift.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "common/pose/pose.h"
#include "common/recordings/windows.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

// A gyro's slope over headings that are in degrees, and how much of both has to be the same.
constexpr double kDegrees = 180 / std::numbers::pi, kAlike = 0.9, kMostRatio = 1.5;
constexpr double kClockStep_s = 0.02, kMostClock_s = 0.5, kLateClock_s = 0.06;
// What another clock has to leave of what the headings do not explain.
constexpr double kLeftByClock = 0.5;

// How a gyro's turns go with those of the headings, its clock set back by `late_s`.
struct GyroFit {
  double slope = 0;  // of the gyro's over theirs
  double alike = 0;  // their correlation
};

GyroFit fit_gyro(const RunLog& log, double late_s) {
  double gg = 0, gh = 0, hh = 0;
  for (const LoggedRun& run : log.runs) {
    for (std::size_t i = 1; i < run.poses.size(); ++i) {
      const PoseRow &a = run.poses[i - 1], &b = run.poses[i];
      const auto g = turned_between(run.yaw_rates, a.t_s + late_s, b.t_s + late_s);
      if (!g) continue;
      const double h = wrap_angle(b.X_WM.theta - a.X_WM.theta);
      gg += *g * *g, gh += *g * h, hh += h * h;
    }
  }
  return gg > 0 && hh > 0 ? GyroFit{gh / hh, gh / std::sqrt(gg * hh)} : GyroFit{};
}

// While a robot stands: after its commands ended, and for so long.
constexpr double kSettles_s = 0.5, kLeastStand_s = 0.5;
constexpr std::size_t kFewestStands = 5, kFewestPoses = 5;
constexpr double kLeastDrift_rad_s = 3e-3, kSureDrift = 4;  // standard errors
constexpr double kSameWay = 0.9;                            // of the stretches turn

// How fast the heading turns over some poses, rad/s, by least squares.
double rate_of(std::span<const PoseRow> poses) {
  double t0 = 0, turned = 0, tt = 0, th = 0;
  std::vector<double> headings = {0};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    turned += wrap_angle(poses[i].X_WM.theta - poses[i - 1].X_WM.theta);
    headings.push_back(turned);
  }
  for (const PoseRow& pose : poses) t0 += pose.t_s / static_cast<double>(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double t = poses[i].t_s - t0;
    tt += t * t, th += t * headings[i];
  }
  return tt > 0 ? th / tt : 0;
}

// Of every stretch in which the robot stands.
std::vector<double> standing_rates(const RunLog& log) {
  std::vector<double> rates;
  for (const LoggedRun& run : log.runs) {
    if (run.commands.empty() || run.poses.empty()) continue;
    for (std::size_t i = 0; i < run.commands.size(); ++i) {
      const auto is_still = [](const CommandRow& row) {
        return std::ranges::all_of(row.values, [](double v) { return v == 0; });
      };
      if (!is_still(run.commands[i])) continue;
      const double from_s = run.commands[i].t_s + kSettles_s;
      while (i + 1 < run.commands.size() && is_still(run.commands[i + 1])) ++i;
      const double to_s =
          i + 1 < run.commands.size() ? run.commands[i + 1].t_s : run.poses.back().t_s;
      const auto first = std::ranges::lower_bound(run.poses, from_s, {}, &PoseRow::t_s);
      const auto last = std::ranges::upper_bound(run.poses, to_s, {}, &PoseRow::t_s);
      if (to_s - from_s < kLeastStand_s ||
          last - first < static_cast<std::ptrdiff_t>(kFewestPoses)) {
        continue;
      }
      rates.push_back(rate_of({first, last}));
    }
  }
  return rates;
}

}  // namespace

void check_standing(const RunLog& log, RunChecks* checks) {
  if (log.relative) return;
  const std::vector<double> rates = standing_rates(log);
  if (rates.size() < kFewestStands) return;
  const double rate = median(rates), n = static_cast<double>(rates.size());
  // Of a median, by the median of what they differ from it by.
  const double scatter = median(mapped(rates, [&](double r) { return std::abs(r - rate); }));
  const auto same = std::ranges::count_if(rates, [&](double r) { return r * rate > 0; });
  if (std::abs(rate) < std::max(kLeastDrift_rad_s, kSureDrift * 1.86 * scatter / std::sqrt(n)) ||
      static_cast<double>(same) < kSameWay * n) {
    return;
  }
  checks->findings.push_back(
      {"headings_drift",
       "While the robot is commanded to stand its heading turns by " + few_digits(rate) +
           " rad/s, the median of " + std::to_string(rates.size()) + " stretches.",
       "Look where headings come from: a gyro's bias, or a frame that turns. What is named beside "
       "it may stand for that.",
       Severity::kNote});
}

void check_gyro(const RunLog& log, RunChecks* checks) {
  double late_s = 0;
  GyroFit best = fit_gyro(log, 0);
  const double left = 1 - best.alike * best.alike;
  for (double s = -kMostClock_s; s <= kMostClock_s; s += kClockStep_s) {
    const GyroFit fit = fit_gyro(log, s);
    if (std::abs(fit.alike) <= std::abs(best.alike)) continue;
    best = fit;
    late_s = s;
  }
  const auto report = [&](const char* name, const std::string& text, const std::string& remedy) {
    checks->gyro_is_wrong = true;
    checks->findings.push_back({name, "The gyro's turns go with those of the headings " + text,
                                remedy + " Its rates are omitted.", Severity::kWarning});
  };
  if (std::abs(best.alike) < kAlike) return;
  if (best.slope < 0) report("gyro_sign", "the other way.", "Turn the sign of yaw_rate.");
  const double degrees = std::abs(best.slope) / kDegrees;
  if (degrees > 1 / kMostRatio && degrees < kMostRatio) {
    report("gyro_unit", few_digits(std::abs(best.slope)) + " times, as degrees a second do.",
           "Multiply yaw_rate by pi / 180.");
  }
  const bool explains = 1 - best.alike * best.alike < kLeftByClock * left;
  if (std::abs(late_s) >= kLateClock_s && explains) {
    report("gyro_clock", few_digits(late_s) + " s later.", "Take that from the gyro's times.");
  }
}

}  // namespace gapfarm
