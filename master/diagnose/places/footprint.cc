#include "master/diagnose/places/footprint.h"

#include <cmath>
#include <vector>

#include "common/math/statistics.h"

namespace gapfarm {
namespace {

double value_of(const Problem& problem, const Study& study, const char* key) {
  const std::size_t row = problem.table().row(key);
  const auto tuned = study.base.find(row);
  return tuned != study.base.end() ? tuned->second : problem.values[row];
}

// Of a program's robot, whose parameters mean what its author wants: as wide as it turns, as long,
// and with treads that give way like most.
Footprint footprint_of_turns(const Study& study) {
  constexpr double kUsualGauge_m = 0.15, kUsualCreep = 0.1, kLeastApart = 0.1;
  std::vector<double> gauges;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& trial = study.trials[i];
    const CommandSpec& c = study.cells[trial.cell].command;
    const double turned = std::abs((trial.left + trial.right)[2]);
    const double apart = std::abs(c.right - c.left) * study.speed_m_s * c.duration_s;
    if (std::abs(c.right - c.left) > kLeastApart && turned > 0) gauges.push_back(apart / turned);
  }
  const double gauge_m = gauges.empty() ? kUsualGauge_m : median(gauges);
  return {gauge_m, gauge_m, 1, kUsualCreep};
}

}  // namespace

std::array<Eigen::Vector2d, 4> Footprint::contacts() const {
  const double front = length_m / 2, side = gauge_m / 2;
  return {Eigen::Vector2d(front, side), Eigen::Vector2d(-front, side),
          Eigen::Vector2d(front, -side), Eigen::Vector2d(-front, -side)};
}

Footprint footprint_of(const Problem& problem, const Study& study) {
  if (problem.external) return footprint_of_turns(study);
  return {value_of(problem, study, "contact_length"), value_of(problem, study, "track_gauge"),
          value_of(problem, study, "friction_ratio"), value_of(problem, study, "tread_creep")};
}

}  // namespace gapfarm
