#include "master/diagnose/places/slip_places.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <utility>

#include "common/pose/segment.h"

namespace gapfarm {
namespace {

constexpr double kPlaceStep_m = 0.1;
constexpr std::array<double, 6> kPlaceRadii_m = {0.1, 0.15, 0.2, 0.3, 0.4, 0.55};
constexpr double kLineStep_m = 0.05;
constexpr double kAbout_m = 0.03;   // of a line: readings near it count as across
constexpr double kMostPlaces = 40;  // along an axis
constexpr double kPriorTrials = 5;  // with the log's own rate, in every group of drives
constexpr double kFewestSlips = 3;  // in a place

struct DrivenLine {
  Eigen::Vector2d from, to;
};

// Where drives may pass through.
struct Place {
  std::function<bool(const DrivenLine&)> passed;
  std::string description;
};

// Expected slips of every trial if they fell anywhere.
std::vector<double> expected(const Study& study, std::span<const double> slipped,
                             const std::vector<bool>& informative) {
  std::map<std::pair<MotionKind, double>, std::pair<double, double>> groups;  // slips, trials
  const auto group_of = [&](std::size_t i) {
    const Cell& cell = study.cells[study.trials[i].cell];
    return std::pair(cell.kind, cell.path);
  };
  double slips = 0, trials = 0;
  for (std::size_t i = 0; i < study.size(); ++i) {
    if (!informative[i]) continue;
    auto& [own_slips, own_trials] = groups[group_of(i)];
    own_slips += slipped[i];
    own_trials += 1;
    slips += slipped[i];
    trials += 1;
  }
  const double rate = slips / std::max(trials, 1.0);
  std::vector<double> all;
  double sum = 0;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const auto [own_slips, own_trials] = groups[group_of(i)];
    all.push_back(informative[i] ? (own_slips + kPriorTrials * rate) / (own_trials + kPriorTrials)
                                 : 0);
    sum += all.back();
  }
  for (double& e : all) e *= slips / std::max(sum, 1e-12);
  return all;
}

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

Place disc(const Eigen::Vector2d& centre, double radius_m) {
  return {[=](const DrivenLine& driven) {
            return nearest_on_segment(centre, driven.from, driven.to).distance < radius_m;
          },
          "within " + metres(radius_m) + " m of (" + metres(centre.x()) + ", " +
              metres(centre.y()) + ")"};
}

Place line(int axis, double at_m) {
  return {[=](const DrivenLine& driven) {
            return std::min(driven.from[axis], driven.to[axis]) < at_m + kAbout_m &&
                   std::max(driven.from[axis], driven.to[axis]) > at_m - kAbout_m;
          },
          std::string("across ") + (axis == 0 ? "x" : "y") + " = " + metres(at_m) + " m"};
}

// Discs and lines all over the box of the ways' starts.
std::vector<Place> places(const std::vector<DrivenLine>& driven_lines) {
  Eigen::Vector2d low(INFINITY, INFINITY), high = -low;
  for (const DrivenLine& driven : driven_lines) {
    low = low.cwiseMin(driven.from);
    high = high.cwiseMax(driven.from);
  }
  const Eigen::Vector2d extent = high - low;
  std::vector<Place> all;
  const double grid = std::max(kPlaceStep_m, extent.maxCoeff() / kMostPlaces);
  for (double x = low.x(); x <= high.x(); x += grid) {
    for (double y = low.y(); y <= high.y(); y += grid) {
      for (double radius : kPlaceRadii_m) all.push_back(disc({x, y}, radius));
    }
  }
  for (int axis : {0, 1}) {
    const double step = std::max(kLineStep_m, extent[axis] / kMostPlaces);
    for (double at = low[axis]; at <= high[axis]; at += step) all.push_back(line(axis, at));
  }
  return all;
}

}  // namespace

Gathering gathering_of_slips(const Study& study, std::span<const double> slipped,
                             const std::vector<bool>& informative) {
  const std::vector<double> chance = expected(study, slipped, informative);
  std::vector<DrivenLine> driven_lines;
  double slips = 0;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& t = study.trials[i];
    driven_lines.push_back({{t.X_WS.x, t.X_WS.y}, {t.X_WP.x, t.X_WP.y}});
    if (informative[i]) slips += slipped[i];
  }
  Gathering best;
  for (const Place& place : places(driven_lines)) {
    double here = 0, expected_here = 0;
    std::vector<bool> passed(study.size());
    for (std::size_t i = 0; i < study.size(); ++i) {
      passed[i] = place.passed(driven_lines[i]);
      if (!informative[i] || !passed[i]) continue;
      here += slipped[i];
      expected_here += chance[i];
    }
    const double rest = slips - here, expected_rest = slips - expected_here;
    if (here < kFewestSlips || here <= expected_here || expected_here <= 0) continue;
    const double gain = here * std::log(here / expected_here) +
                        (rest > 0 ? rest * std::log(rest / expected_rest) : 0);
    if (gain > best.gain) best = {gain, place.description, std::move(passed)};
  }
  return best;
}

}  // namespace gapfarm
