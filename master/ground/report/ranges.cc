#include "master/ground/report/ranges.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/text_table.h"
#include "common/json/json.h"
#include "common/json/matrix.h"
#include "common/math/algebra.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "common/random/stream.h"
#include "common/score/kinematic.h"
#include "master/diagnose/result/diagnosis.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/report/simulator_model.h"

namespace gapfarm {
namespace {

constexpr double kBeginAt = 10;      // times the values' covariance, where they may vary
constexpr double kFarthest = 4;      // standard deviations that no draw lies beyond
constexpr double kHeldError = 1e-6;  // less than any log shows
constexpr int kMostAttempts = 1000;  // at a draw within the bounds; then it is moved onto them

// Sizes in m in place of ratios to them, of a robot with two sides.
void put_size(const GroundRobot& robot, ValueRange* range) {
  if (!has_simulator_model(robot)) return;
  if (range->kinematic == "left" || range->kinematic == "right") {
    range->name = range->kinematic + "_wheel_radius";
    range->factor = side_radius_m(robot, range->kinematic);
  } else if (range->kinematic == "separation") {
    range->name = "wheel_separation";
    range->factor = *turning_separation_m(robot);
  } else {
    return;
  }
  range->unit = "m";
}

void scale(ValueRange* range) {
  range->sd = std::hypot(range->error, range->varies);
  for (double* value : {&range->mean, &range->sd, &range->error, &range->varies}) {
    *value *= range->factor;
  }
  *range->had *= range->factor;
  range->interval = {range->mean - kNormal90 * range->sd, range->mean + kNormal90 * range->sd};
  range->lower = range->mean - kFarthest * range->sd;
  range->upper = range->mean + kFarthest * range->sd;
  if (range->factor != 1 || is_magnitude(range->kinematic)) {
    range->lower = std::max(0.0, range->lower);
  }
}

Eigen::VectorXd deviations_of(const Ranges& ranges) {
  return ranges.covariance.diagonal().cwiseMax(0).cwiseSqrt();
}

// 0 where one of two does not vary at all.
Eigen::MatrixXd correlation_of(const Ranges& ranges) {
  const Eigen::VectorXd sd = deviations_of(ranges);
  Eigen::MatrixXd r = Eigen::MatrixXd::Identity(sd.size(), sd.size());
  for (Eigen::Index i = 0; i < sd.size(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      if (sd[i] > 0 && sd[j] > 0) r(i, j) = r(j, i) = ranges.covariance(i, j) / sd[i] / sd[j];
    }
  }
  return r;
}

Json held_json(const GroundRobot& robot) {
  Json held = Json::array();
  const auto add = [&](const char* name, const char* unit, std::optional<double> value) {
    if (value) held.push_back({{"name", name}, {"unit", unit}, {"value", *value}});
  };
  add("friction", "-", robot.friction);
  add("mass", "kg", robot.mass_kg);
  add("yaw_inertia", "kg m^2", robot.yaw_inertia_kg_m2);
  return held;
}

bool is_table(const Json& value) {
  return value.is_array() && !value.empty() && value[0].is_object();
}

}  // namespace

Interval interval_of(const GroundReference& fit, Eigen::Index k) {
  return interval_about(fit.values[k],
                        mapped(fit.draws.row(k), [&](double off) { return fit.values[k] + off; }));
}

Ranges ranges_of(const GroundRobot& robot, const GroundReference& fit) {
  Ranges ranges;
  ranges.robot = robot;
  const Variation variation = variation_of(fit.windows, kBeginAt * fit.covariance);
  ranges.scatter = variation.scatter;
  Eigen::VectorXd factors(fit.values.size());
  for (Eigen::Index k = 0; k < fit.values.size(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    ValueRange range;
    range.kinematic = range.name = fit.names[i];
    range.unit = fit.units[i];
    range.mean = fit.values[k] + variation.shift[k];
    range.error = std::sqrt(fit.covariance(k, k));
    range.varies = std::sqrt(std::max(0.0, variation.covariance(k, k)));
    range.had = value_in_file(robot, range.kinematic);
    range.shown = fit.shown[i] != 0;
    put_size(robot, &range);
    scale(&range);
    factors[k] = range.factor;
    ranges.values.push_back(std::move(range));
  }
  ranges.covariance =
      factors.asDiagonal() * (fit.covariance + variation.covariance) * factors.asDiagonal();
  return ranges;
}

Result<Ranges> ranges_of(const Diagnosis& diagnosis) {
  Ranges ranges;
  for (const ParameterRow& row : diagnosis.parameters) {
    if (!row.lo || !row.hi || !(*row.hi > *row.lo)) continue;
    const double sd = (*row.hi - *row.lo) / 2 / kNormal90;
    const Interval interval = {*row.lo, *row.hi};
    ranges.values.push_back(
        {row.key, row.unit, row.after, sd, interval, row.lower, row.upper, row.before});
  }
  if (ranges.values.empty()) {
    return Error{"the diagnosis has no parameter with an interval; tune some ([genes])"};
  }
  const auto n = static_cast<Eigen::Index>(ranges.values.size());
  Eigen::MatrixXd r = Eigen::MatrixXd::Identity(n, n);
  const auto index = [&](const std::string& key) {
    return std::ranges::find(ranges.values, key, &ValueRange::name) - ranges.values.begin();
  };
  for (const ParameterCorrelation& c : diagnosis.correlations) {
    const auto a = index(c.a), b = index(c.b);
    if (a < n && b < n && a != b) r(a, b) = r(b, a) = c.r;
  }
  const Eigen::VectorXd sd = vector_of(ranges.values, &ValueRange::sd);
  ranges.covariance = sd.asDiagonal() * r * sd.asDiagonal();
  return ranges;
}

Eigen::VectorXd means_of(const Ranges& ranges) {
  return vector_of(ranges.values, &ValueRange::mean);
}

Eigen::MatrixXd draw_values(const Ranges& ranges, int count, std::uint64_t seed) {
  const Eigen::VectorXd means = means_of(ranges), sd = deviations_of(ranges);
  const SymmetricAxes axes = axes_of_symmetric(correlation_of(ranges));
  const Eigen::MatrixXd root =
      sd.asDiagonal() * axes.vectors * axes.values.cwiseMax(0).cwiseSqrt().asDiagonal();
  const Eigen::VectorXd lower = vector_of(ranges.values, &ValueRange::lower);
  const Eigen::VectorXd upper = vector_of(ranges.values, &ValueRange::upper);
  Eigen::MatrixXd draws(means.size(), count);
  for (int d = 0; d < count; ++d) {
    Stream stream({seed, Purpose::kStatistics, 5, static_cast<std::uint64_t>(d), 0});
    Eigen::VectorXd drawn;
    for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
      drawn = means + root * Eigen::VectorXd::NullaryExpr(
                                 means.size(), [&](Eigen::Index) { return stream.normal(); });
      if ((drawn.array() >= lower.array()).all() && (drawn.array() <= upper.array()).all()) break;
    }
    draws.col(d) = drawn.cwiseMax(lower).cwiseMin(upper);
  }
  return draws;
}

GroundRobot robot_at(const Ranges& ranges, const Eigen::VectorXd& values) {
  Kinematics at;
  for (std::size_t k = 0; k < ranges.values.size(); ++k) {
    const ValueRange& range = ranges.values[k];
    at.add(range.kinematic, values[k] / range.factor);
  }
  return robot_with(*ranges.robot, at);
}

Json ranges_json(const Ranges& ranges) {
  const bool models = ranges.robot && has_simulator_model(*ranges.robot);
  std::vector<std::string> names, not_in_mujoco, not_in_sdf;
  const auto placed = [&](Json row) {
    const std::string name = row["name"];
    const auto put = [&](const char* tool, std::string_view place, std::vector<std::string>* none) {
      if (models && !place.empty()) row[tool] = place;
      if (!models || place.empty()) none->push_back(name);
    };
    put("mujoco", simulator_place(name).mujoco, &not_in_mujoco);
    put("sdf", simulator_place(name).sdf, &not_in_sdf);
    return row;
  };
  Json values = Json::array(), held = Json::array(), scatter = Json::array();
  for (const ValueRange& v : ranges.values) {
    names.push_back(v.name);
    Json row = {{"name", v.name},         {"unit", v.unit},   {"distribution", "normal"},
                {"mean", v.mean},         {"sd", v.sd},       {"lo", v.interval.lower},
                {"hi", v.interval.upper}, {"lower", v.lower}, {"upper", v.upper},
                {"shown", v.shown}};
    if (v.had) row["had"] = *v.had;
    if (ranges.robot) row["error"] = v.error, row["varies"] = v.varies;
    values.push_back(placed(std::move(row)));
  }
  for (const Json& row : ranges.robot ? held_json(*ranges.robot) : Json::array()) {
    held.push_back(placed(row));
  }
  for (const WindowScatter& s : ranges.scatter) {
    scatter.push_back({{"window_s", s.window_s},
                       {"along_m", s.sd[0]},
                       {"across_m", s.sd[1]},
                       {"heading_rad", s.sd[2]}});
  }
  return {{"source", ranges.source},
          {"logs", ranges.logs},
          {"level", 0.9},
          {"not_in_mujoco", not_in_mujoco},
          {"not_in_sdf", not_in_sdf},
          {"names", names},
          {"covariance", ranges.covariance},
          {"correlation", correlation_of(ranges)},
          {"values", values},
          {"held", held},
          {"scatter", scatter}};
}

// JSON's numbers, texts and arrays are TOML's, and its objects YAML's flow mappings.
std::string ranges_toml(const Json& ranges) {
  std::string text, tables;
  for (const auto& [key, value] : ranges.items()) {
    const bool says_none = key == "logs" || key.starts_with("not_in");
    if (value.is_array() && value.empty() && !says_none) continue;
    if (!is_table(value)) {
      text += key + " = " + json_text(value) + "\n";
      continue;
    }
    for (const Json& row : value) {
      tables += "\n[[" + key + "]]\n";
      for (const auto& [name, field] : row.items()) {
        tables += name + " = " + json_text(field) + "\n";
      }
    }
  }
  return text + tables;
}

std::string ranges_yaml(const Json& ranges) {
  std::string text;
  for (const auto& [key, value] : ranges.items()) {
    text += key + ":";
    const bool rows = is_table(value) || key == "covariance" || key == "correlation";
    if (!rows) text += " " + json_text(value);
    text += "\n";
    if (!rows) continue;
    for (const Json& row : value) text += "  - " + json_text(row) + "\n";
  }
  return text;
}

std::string ranges_table(const Ranges& ranges) {
  const bool models = ranges.robot && has_simulator_model(*ranges.robot);
  TextTable table{{"value", "unit", "mean", "sd", "error", "varies", "90 %", "MuJoCo / SDF"}};
  const auto place = [&](std::string_view in) {
    return models && !in.empty() ? std::string(in) : std::string("-");
  };
  const auto number = [](double x, int digits) { return fmt::format("{:.{}g}", x, digits); };
  for (const ValueRange& v : ranges.values) {
    const auto [value, mujoco, sdf] = simulator_place(v.name);
    table.rows.push_back(
        {v.name, v.unit, number(v.mean, 4), number(v.sd, 2),
         ranges.robot ? number(v.error, 2) : "-", ranges.robot ? number(v.varies, 2) : "-",
         fmt::format("[{:.4g}, {:.4g}]", v.interval.lower, v.interval.upper),
         place(mujoco) + " / " + place(sdf) +
             (v.shown                ? ""
              : v.error < kHeldError ? "; held: this log cannot show it"
                                     : "; this log does not show it: as wide as is plausible")});
  }
  std::string text = table.text("<<>>>><");
  for (const WindowScatter& s : ranges.scatter) {
    text += fmt::format(
        "what no value explains of {:.3g} s: {:.2g} m along, {:.2g} m across, {:.2g} rad (sd)\n",
        s.window_s, s.sd[0], s.sd[1], s.sd[2]);
  }
  return text;
}

std::string samples_csv(const Ranges& ranges, const Eigen::MatrixXd& draws) {
  std::string text = "sample";
  for (const ValueRange& v : ranges.values) text += "," + v.name;
  for (Eigen::Index d = 0; d < draws.cols(); ++d) {
    text += fmt::format("\n{}", d + 1);
    for (const double value : draws.col(d)) text += fmt::format(",{}", value);
  }
  return text + "\n";
}

}  // namespace gapfarm
