// A gyro of another sign, unit or clock than the headings.
#include <cmath>
#include <numbers>
#include <string>

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

}  // namespace

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
