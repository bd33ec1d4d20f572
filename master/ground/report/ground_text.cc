#include "master/ground/report/ground_text.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <cmath>
#include <functional>

#include "common/base/constants.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// The value to paste into the robot's file.
std::string in_file(const GroundRobot& robot, const KinematicRow& row, const Estimate& e) {
  const auto ratio = [&](const std::string& word, double own, const char* unit) {
    return fmt::format(
        "{} {}{}; the file has {:.5g}", word,
        with_interval("%.5g", own * (1 + e.value), own * (1 + e.lo), own * (1 + e.hi)), unit, own);
  };
  const auto& k = robot.controller;
  const double base = row.nominal;
  const RobotWheel* wheel = find_by(robot.wheels, row.name, radius_row);
  if (wheel != nullptr) return ratio(row.name, *wheel->radius_m, " m");
  if (row.name == "left" || row.name == "right") {
    return ratio("wheels." + row.name + ".radius", side_radius_m(robot, row.name), " m");
  }
  if (row.name == "separation" && k.wheel_separation_m) {
    const double own = turning_multiplier(robot);
    return own != 1 || skids(robot) ? ratio("wheel_separation_multiplier", own, "")
                                    : ratio("wheel_separation", *k.wheel_separation_m, " m");
  }
  if (e.key == "ratio" || e.key == "rate") {
    return with_interval("%+.4g", e.value, e.lo, e.hi) + " " +
           (e.unit == "-" ? "of what the file has" : e.unit);
  }
  return fmt::format("{} {} {}; the {} has {:.5g}", row.name,
                     with_interval("%.5g", base + e.value, base + e.lo, base + e.hi), e.unit,
                     robot.wheels.empty() ? "config" : "file", base);
}

std::string capital(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(text[0]));
  return text;
}

// Shares of what the reference has, in per cent, with a word for their sign.
std::string share_text(double value, double lo, double hi) {
  const double sign = value < 0 ? -100 : 100;
  const auto [a, b] = std::minmax({sign * lo, sign * hi});
  return std::string(value < 0 ? "fell" : "rose") + " by " +
         with_interval(std::abs(100 * value) < 10 ? "%.1f" : "%.0f", sign * value, a, b, "%");
}

// The value of the robot's file, or of the floor, that a ratio is of; 0: none.
double own_value(const GroundRobot& robot, const KinematicRow& row) {
  if (row.name == "traction") return 1;
  if (row.name == "separation") {
    return skids(robot) ? turning_multiplier(robot) : turning_separation_m(robot).value_or(0);
  }
  return side_radius_m(robot, row.name);
}

// Of several values of one name: which of them.
const char* spoken(const KinematicRow& row) {
  if (row.name == "travel") return "their travel";
  if (row.name == "separation") return "their separation, as they roll,";
  if (row.name == "slip_angle") return "the rear's slip at the limit";
  return row.name == "grip" ? "" : row.key.c_str();
}

std::string change_text(const GroundRobot& robot, const KinematicRow& row, const Estimate& e) {
  const bool friction = row.key == "log";
  if (friction || row.key == "ratio") {
    // A ratio's change is one of the reference's own.
    const double of = friction ? 1 : row.nominal;
    std::string text = share_text(e.value / of, e.lo / of, e.hi / of);
    const double from =
        friction ? std::exp(row.nominal) / kGravity_m_s2 : own_value(robot, row) * row.nominal;
    if (from > 0) text += fmt::format(", from {:.4g} to {:.4g}", from, from * (1 + e.value / of));
    return text;
  }
  return fmt::format("changed by {} {}, from {:.4g} to {:.4g}",
                     with_interval("%+.4g", e.value, e.lo, e.hi), e.unit, row.nominal,
                     row.nominal + e.value);
}

constexpr double kSensorSure = 0.99;  // outside its interval by far
constexpr std::size_t kMostMoved = 4;

std::string value_move(const FitRow& row, double moved) {
  if (row.row.unit == "-") return fmt::format("{} by {:+.1f} %", row.row.name, 100 * moved);
  return fmt::format("{} by {:+.2g} {}", row.row.name, moved, row.row.unit);
}

constexpr double kLeastShareOfGap = 0.25;

struct ComponentGap {
  double nats = 0;                    // over all windows
  std::vector<double> by_horizon;     // nats
  std::vector<double> half = {0, 0};  // of the log's time
  std::vector<double> missed;         // by the longest windows
};

Where finding_of(const ComponentGap& gap, int component, double all, const WindowSet& windows) {
  static constexpr std::array<const char*, 3> kNames = {"x", "y", "theta"};
  static constexpr std::array<const char*, 3> kSpoken = {"along the way", "across the way",
                                                         "in the heading"};
  Where w;
  w.component = kNames[component];
  const auto longest = std::max_element(gap.by_horizon.begin(), gap.by_horizon.end());
  w.command = windows.length_text(static_cast<int>(longest - gap.by_horizon.begin()));
  const double middle = mean(gap.missed);
  const double square = mean(mapped(gap.missed, [](double m) { return m * m; }));
  const double count = std::max(1.0, static_cast<double>(gap.missed.size()));
  const double error = std::sqrt(std::max(square - middle * middle, 1e-18) / count);
  const bool biased = std::abs(middle) > 2 * error;
  w.kind = biased ? "bias" : "spread";
  w.p = biased ? std::min(1.0, 2 * normal_above(std::abs(middle) / error)) : 1;
  w.size = 1e3 * (biased ? middle : std::sqrt(square));
  w.share = gap.nats / all;
  const double later = gap.half[1] / std::max(gap.half[0] + gap.half[1], 1e-12);
  if (later > 0.75 || later < 0.25) w.covariate = "time";
  w.text = fmt::format(
      "{:.0f} % of what could still be closed lies {}, most over {}{}: {} of {:.3g} {}.",
      100 * w.share, kSpoken[component], w.command,
      w.covariate.empty() ? "" : (later > 0.5 ? ", in the later half" : ", in the earlier half"),
      biased ? "a mean error" : "a scatter", w.size, component < 2 ? "mm" : "mrad");
  return w;
}

}  // namespace

Estimate estimate_of(const KinematicRow& row, double value, double lo, double hi) {
  if (row.key == "log") {
    return {"ratio", std::expm1(value - row.nominal), std::expm1(lo - row.nominal),
            std::expm1(hi - row.nominal), row.unit};
  }
  return {row.key, value - row.nominal, lo - row.nominal, hi - row.nominal, row.unit};
}

const char* source_of(const GroundRobot& robot) {
  return robot.wheels.empty() ? "the program" : "the robot's file";
}

const char* nothing_wrong(const GroundRobot& robot) {
  return robot.wheels.empty()
             ? "Nothing of the commands or readings is wrong by more than well-kept ones are."
             : "Nothing of the robot's file or log is wrong by more than a well-kept file's values "
               "are.";
}

std::string text_of_values(const GroundRobot& robot, const GroundHypothesis& h,
                           const NamedEffect& effect, bool changed) {
  std::vector<std::string> values;
  for (std::size_t k = 0; k < h.freed.size() && k < effect.parameters.size(); ++k) {
    const KinematicRow& row = h.freed[k];
    const Estimate& e = effect.parameters[k];
    if (!changed) values.push_back(in_file(robot, row, e));
    if (!changed || row.name == "grip_shape") continue;  // a word for it is nobody's
    const std::string which = h.freed.size() > 1 ? spoken(row) : "";
    values.push_back(which + (which.empty() ? "" : " ") + change_text(robot, row, e));
  }
  return capital(h.thing + (changed ? " " : " is off: ") + joined(values, "; ") + ".");
}

int report_sensor(const std::vector<SensorValue>& sensor, Diagnosis* diagnosis) {
  NamedEffect offset, yaw;
  offset.name = "marker_offset";
  yaw.name = "marker_yaw";
  yaw.aliases = {"heading_offset"};
  std::string pose;
  for (const SensorValue& v : sensor) {
    const auto& [lo, hi] = v.interval;
    const std::string key = "marker." + v.row.name.substr(v.row.name.find('_') + 1);
    const std::string text =
        v.shown ? fmt::format("{} {} {}; the file has {:.4g}", key,
                              with_interval("%.4g", v.value, lo, hi), v.row.unit, v.had)
                : key + ": this log does not show it";
    pose += " " + text + ".";
    const double off = v.value - v.had;
    if (!v.shown) continue;
    if (std::abs(off) < 2 * v.row.tolerance || (lo <= v.had && v.had <= hi)) continue;
    NamedEffect& effect = v.row.name == "marker_yaw" ? yaw : offset;
    effect.parameters.push_back({v.row.key, off, lo - v.had, hi - v.had, v.row.unit});
    effect.text += (effect.text.empty() ? "The sensor's pose on the robot is off: " : "; ") + text;
  }
  if (pose.empty()) return 0;
  diagnosis->cautions.push_back("The sensor's pose was fitted first, with every value free:" +
                                pose);
  const std::size_t before = diagnosis->effects.size();
  for (NamedEffect* effect : {&yaw, &offset}) {
    if (effect->parameters.empty()) continue;
    effect->text += ".";
    effect->confidence = kSensorSure;
    diagnosis->effects.push_back(std::move(*effect));
  }
  return static_cast<int>(diagnosis->effects.size() - before);
}

bool may_be_named(const HeldOutGain& gain) { return std::isfinite(gain.lo) && gain.lo > 0; }

bool nothing_is_left(const GroundFigures& figures) {
  const HeldOutGain& left = figures.closable;
  return figures.unexplained < kUnexplained && figures.far_runs.empty() &&
         std::isfinite(left.mean) && std::isfinite(left.hi) &&
         std::max(left.mean, left.hi) <= kToleratedGap;
}

bool something_is_left(const GroundFigures& figures) {
  return figures.unexplained >= kUnexplained || !figures.far_runs.empty() ||
         (figures.closable.lo > 0 && figures.closable.mean > kToleratedGap);
}

Verdict ground_verdict(const GroundFigures& figures) {
  assert(std::all_of(figures.named.begin(), figures.named.end(), may_be_named));
  const bool named = figures.faults > 0 || !figures.named.empty();
  if (nothing_is_left(figures)) return named ? Verdict::kEffect : Verdict::kNone;
  return named ? Verdict::kEffectAndUnknown : Verdict::kUnknown;
}

std::string verdict_reason(const GroundFigures& figures) {
  const HeldOutGain& left = figures.closable;
  const std::string closes = with_interval("%.2g", left.mean, left.lo, left.hi) + " nats a window";
  if (nothing_is_left(figures)) {
    return fmt::format(
        "All that was tried would close another {} on stretches that were not fitted: within "
        "{:.2g}, residuals 10 % smaller.",
        closes, kToleratedGap);
  }
  if (figures.unexplained >= kUnexplained) {
    return unexplained_text(figures.unexplained, figures.stood);
  }
  if (!figures.far_runs.empty()) return figures.far_runs;
  if (something_is_left(figures)) {
    const std::string what = figures.best_of_all.empty() ? "" : ", " + figures.best_of_all + ",";
    return fmt::format(
        "The best of what was tried{} closes another {} on stretches that were not fitted, and "
        "{:.2g} (residuals 10 % smaller) is tolerated: {}.",
        what, closes, kToleratedGap,
        figures.best_of_all == kSmallMoves ? "no value need be off by much, but many by a little"
                                           : "something moves the robot that is not named");
  }
  return fmt::format(
      "The best of what was tried would close another {} on stretches that were not fitted: these "
      "runs do not exclude a gap of more than {:.2g} (residuals 10 % smaller); log more runs.",
      closes, kToleratedGap);
}

std::string nearest_of_catalogue(const GroundSearch& search) {
  return fmt::format(
      "Of the catalogue this comes nearest: {}; but a correction by {} foresees as much without "
      "it.",
      joined(search.stand_ins, ", ", [&](std::size_t h) { return search.catalogue[h].name; }),
      search.smooth->depends_on);
}

std::vector<std::string> rows_not_shown(const WindowFitter& fitter, const GroundSearch& search,
                                        std::uint64_t seed) {
  const WindowFit& fit = search.free_fit;
  const Eigen::MatrixXd draws = fitter.draws(fit, seed).colwise() - fit.values;
  const double root = std::sqrt(static_cast<double>(draws.cols()));
  std::vector<std::string> names;
  for (std::size_t k = 0; k < fit.rows.size(); ++k) {
    const std::string& name = fit.rows[k].row.name;
    const Eigen::Index named = row_index(search.fit.rows, name);
    if (named >= 0 && search.fit.rows[named].free) continue;
    // What lies before measured wheel speeds is a caution of its own.
    if (fitter.robot().measured && (name == "lag" || name == "delay")) continue;
    if (draws.row(k).norm() / root >= kUnshown * prior_deviation(fit.rows[k]))
      names.push_back(name);
  }
  return names;
}

std::string values_not_shown(const GroundSearch& search, const std::vector<std::string>& rows) {
  std::vector<std::string> things;
  for (const std::string& name : rows) {
    const GroundHypothesis* of = find_by(search.catalogue, true, [&](const GroundHypothesis& h) {
      return contains(h.freed, name, &KinematicRow::name);
    });
    if (of != nullptr && !contains(things, of->thing)) things.push_back(of->thing);
  }
  if (things.empty()) return "";
  return "These runs do not show whether these are right: " + joined(things) + ".";
}

std::string values_that_would_move(const GroundSearch& search) {
  if (search.unexplained >= kUnexplained) return "";
  std::vector<std::pair<double, std::string>> moved;
  for (std::size_t k = 0; k < search.fit.rows.size(); ++k) {
    const FitRow& row = search.fit.rows[k];
    const double by = search.free_fit.values[k] - row.row.nominal;
    if (row.free || std::abs(by) < kSureGain * row.row.tolerance) continue;
    moved.emplace_back(-std::abs(by) / row.row.tolerance, value_move(row, by));
  }
  std::sort(moved.begin(), moved.end());
  moved.resize(std::min(moved.size(), kMostMoved));
  return joined(moved, ", ", [](const auto& value) { return value.second; });
}

std::string further_values(const GroundSearch& search, const std::vector<ReportedValue>& values) {
  if (search.reference || search.windows.simulated) return "";
  std::vector<std::string> sure;
  for (std::size_t j = 0; j < values.size(); ++j) {
    const ReportedValue& v = values[j];
    if (!v.named || search.fit.rows[j].free) continue;
    if (contains(search.sensor, v.name, [](const SensorValue& s) { return s.row.name; })) continue;
    sure.push_back(
        fmt::format("{} {} in place of {:.4g}", v.name,
                    with_interval("%.4g", v.reported, v.interval.lower, v.interval.upper), v.had));
  }
  return sure.empty() ? ""
                      : "robot.toml has what else these runs are sure of: " + joined(sure) + ".";
}

std::vector<std::string> cautions_of(const GroundRobot& robot, const GroundSearch& search) {
  using Caution = std::pair<bool, std::string>;
  const Caution all[] = {
      {search.reference.has_value(),
       "Against the reference's log: sizes and intervals are of the change, what the reference "
       "leaves unsure is in them."},
      {search.windows.blocks < 8,
       "Few runs: intervals are from runs drawn again, and these are few."},
      {search.log.relative,
       "Poses are relative, each to the one before: nothing with a place or a direction in the "
       "world can show (tilts, patches, edges); lengths are as the sensor's own scale has them."},
      {robot.measured && !search.loop,
       "Wheel speeds were measured: what lies before them (dead time, ramps) cannot show."}};
  return filtered(all, &Caution::first, &Caution::second);
}

std::string what_to_do(const GroundSearch& search, const GroundFigures& figures,
                       const Diagnosis& diagnosis) {
  const auto remedy = [&](const FoundFault& f) { return search.catalogue[f.hypothesis].remedy; };
  if (!search.faults.empty()) return joined(search.faults, " ", remedy);
  if (diagnosis.effects.empty()) {
    if (search.unexplained >= kUnexplained) return "Put the log right: no value is fitted to it.";
    if (diagnosis.verdict == Verdict::kNone) {
      return "Keep what you have; only more runs, or other drives, could show more.";
    }
    const bool far = !figures.far_runs.empty();
    if (!far && search.best_of_all == kSmallMoves && !search.windows.simulated) {
      return "Fit all values at once: gapfarm export ros, of the config, prints them.";
    }
    return search.smooth && !far
               ? "Look at how errors vary with the " + search.smooth->covariate + "."
               : "Look first at the windows that miss most, below.";
  }
  if (search.reference) return "Put right what changed, or fit the robot anew from then on.";
  if (search.windows.simulated) return "Give these values to the program.";
  return "Take robot.toml beside this, which has these values, or gapfarm export ros for your "
         "controller.";
}

std::vector<Where> where_left(const WindowFitter& fitter, const GroundSearch& search) {
  const WindowFit& now = search.chain.back();
  const WindowSet& windows = search.windows;
  const std::vector<Eigen::Vector3d> raw = fitter.raw_residuals(now);
  std::array<ComponentGap, 3> gaps;
  const auto [begin, end] =
      std::ranges::minmax(mapped(windows.trials, [](const Trial& t) { return *t.t_s; }));
  for (int c = 0; c < 3; ++c) {
    ComponentGap& gap = gaps[c];
    gap.by_horizon.assign(windows.horizons, 0.0);
    for (std::size_t i = 0; i < windows.trials.size(); ++i) {
      const auto h = static_cast<std::size_t>(windows.horizon[i]);
      const double gained = window_nats(search.best.residuals[i][c], search.best.scales[h][c]) -
                            window_nats(now.residuals[i][c], now.scales[h][c]);
      gap.nats += gained;
      gap.by_horizon[h] += gained;
      gap.half[2 * *windows.trials[i].t_s > begin + end ? 1 : 0] += std::max(0.0, gained);
      if (windows.horizon[i] + 1 == windows.lengths) gap.missed.push_back(raw[i][c]);
    }
  }
  double all = 0;
  for (const ComponentGap& gap : gaps) all += std::max(0.0, gap.nats);
  std::vector<Where> found;
  for (int c = 0; c < 3 && all > 0; ++c) {
    const ComponentGap& gap = gaps[c];
    if (gap.nats < kLeastShareOfGap * all) continue;
    found.push_back(finding_of(gap, c, all, windows));
  }
  std::ranges::stable_sort(found, std::greater(), &Where::share);
  if (search.smooth && !found.empty()) {
    found.front().covariate = search.smooth->covariate;
    found.front().text += " It varies with this: " + search.smooth->covariate + ".";
  }
  return found;
}

}  // namespace gapfarm
