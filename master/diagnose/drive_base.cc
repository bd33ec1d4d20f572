#include "master/diagnose/drive_base.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {
namespace {

constexpr double kSearchedSd = 0.5, kOtherSd = 0.2;  // of a program's parameters, logarithmic
constexpr double kShareOfRange = 1.0 / 6;            // where a logarithm has no meaning

// Gauge and friction stay: turns depend on them as on length and ratio, and rest poses of another
// robot's physics would drag them away from anything real.  So would they the ratio, which trades
// with the length: it is held close.
DriveBase srv1_base() {
  DriveBase base;
  base.tuned = {{row_of(Srv1::kFullSpeed), 1},
                {row_of(Srv1::kContactLength), 0.5},
                {row_of(Srv1::kFrictionRatio), 0.1}};
  base.kept = {row_of(Srv1::kFriction), row_of(Srv1::kTrackGauge), row_of(Srv1::kTreadCreep),
               row_of(Srv1::kMassHeight)};
  base.retuned = {{row_of(Srv1::kContactLength), 0.5}, {row_of(Srv1::kFrictionRatio), 0.5},
                  {row_of(Srv1::kFriction), 0.5},      {row_of(Srv1::kTrackGauge), 0.2},
                  {row_of(Srv1::kTreadCreep), 1},      {row_of(Srv1::kMassHeight), 1}};
  base.speed = row_of(Srv1::kFullSpeed);
  base.mass_height = row_of(Srv1::kMassHeight);
  return base;
}

bool has_logarithm(const Parameter& p, double value) { return p.lower >= 0 && value > 0; }

DriveBase program_base(const Problem& problem, std::span<const Gene> genes) {
  const std::vector<Parameter>& declared = problem.external->table.declaration().parameters;
  const auto searched = [&](std::size_t row) {
    return std::any_of(genes.begin(), genes.end(), [&](const Gene& g) { return g.row == row; });
  };
  bool any = false;
  for (std::size_t row = 0; row < declared.size(); ++row) any |= searched(row);
  DriveBase base;
  for (std::size_t row = 0; row < declared.size(); ++row) {
    const Parameter& p = declared[row];
    if (p.kind != ParameterKind::kReal) {  // nothing slopes along it: it stays as the config has it
      base.kept.push_back(row);
      continue;
    }
    const bool moves = searched(row) || !any;
    if (!has_logarithm(p, problem.values[row])) {
      base.kept.push_back(row);
      base.retuned.push_back({row, kShareOfRange, p.upper - p.lower});
      continue;
    }
    if (moves) {
      base.tuned.push_back({row, 1});
    } else {
      base.kept.push_back(row);
    }
    base.retuned.push_back({row, moves ? kSearchedSd : kOtherSd, 0});
  }
  return base;
}

}  // namespace

DriveBase drive_base(const Problem& problem, std::span<const Gene> genes) {
  return problem.external ? program_base(problem, genes) : srv1_base();
}

}  // namespace gapfarm
