#include "master/diagnose/correction/shapes.h"

#include <algorithm>
#include <initializer_list>
#include <string_view>

namespace gapfarm {
namespace {

std::vector<std::size_t> rows_of_covariates(std::initializer_list<std::string_view> names) {
  std::vector<std::size_t> rows;
  const auto known = residual_covariates();
  for (const std::string_view name : names) {
    const auto at = std::find_if(known.begin(), known.end(),
                                 [&](const ResidualCovariate& c) { return c.name == name; });
    rows.push_back(static_cast<std::size_t>(at - known.begin()));
  }
  return rows;
}

using Lengths = std::vector<std::vector<double>>;

// One and the same for so many covariates.
Lengths alike(std::size_t count, std::initializer_list<double> lengths) {
  Lengths all;
  for (const double length : lengths) all.emplace_back(count, length);
  return all;
}

}  // namespace

std::vector<ResidualShape> residual_shapes(bool free_commands) {
  using F = ResidualFrame;
  using Names = std::initializer_list<std::string_view>;
  std::vector<ResidualShape> shapes;
  const auto add = [&](F frame, bool by_drive, Names names, Lengths lengths) {
    const bool own = frame == F::kRobot || frame == F::kWorld;
    std::vector<std::size_t> rows = rows_of_covariates(names);
    if (free_commands && own) {
      std::erase(rows, rows_of_covariates({"level"}).front());
      for (const std::size_t duty : rows_of_covariates({"left", "right"})) rows.push_back(duty);
      for (std::vector<double>& length : lengths) length.resize(rows.size(), length.back());
    }
    shapes.push_back(
        {frame, by_drive, own && !free_commands, false, std::move(rows), std::move(lengths)});
    return &shapes.back();
  };
  add(F::kRobot, true, {"duration", "level"}, alike(2, {0.35, 1}));
  add(F::kWorld, true, {"duration", "level"}, alike(2, {0.35, 1}));
  add(F::kRobot, true, {"heading"}, alike(1, {0.6, 1.2}));
  add(F::kRobot, true, {"x", "y"}, alike(2, {0.35, 1}));
  add(F::kRobot, true, {"time"}, alike(1, {0.35, 1}));
  add(F::kRobot, false, {"left_reversed", "right_reversed"}, alike(2, {0.5}));
  add(F::kRobot, true, {"moved"}, alike(1, {0.5}));
  add(F::kMotion, false, {"x", "y"}, alike(2, {0.35, 1}));
  add(F::kMotion, false, {"time"}, alike(1, {0.35, 1}));
  add(F::kReadings, false, {"x"}, alike(1, {0.1, 0.35, 1}));
  add(F::kReadings, false, {"y"}, alike(1, {0.1, 0.35, 1}));
  add(F::kReadings, false, {"x", "y"}, alike(2, {0.35, 1}));
  add(F::kReadings, false, {"heading"}, alike(1, {0.6, 1.2}));
  for (const Names axis : {Names{"x"}, Names{"y"}}) {
    add(F::kReadings, false, axis, alike(1, {0.003}))->edge = true;
  }
  return shapes;
}

}  // namespace gapfarm
