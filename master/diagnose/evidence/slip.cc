#include "master/diagnose/evidence/slip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <utility>

#include "common/base/text.h"
#include "common/pose/pose.h"
#include "common/score/density.h"
#include "master/infer/climb.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr int kNodes = 6;             // midpoints of equal shares of (0, loss)
constexpr double kLeastDrive = 1e-4;  // its logarithm is searched

struct Event {
  double weight;
  double left, right;  // change of each side's gain
};

std::vector<Event> events_of(double probability, double loss) {
  const double p = probability, q = 1 - probability;
  std::vector<Event> all = {{q * q, 0, 0}};
  if (p == 0) return all;
  for (int i = 0; i < kNodes; ++i) {
    const double u = -loss * (i + 0.5) / kNodes;
    all.push_back({p * q / kNodes, u, 0});
    all.push_back({p * q / kNodes, 0, u});
  }
  for (int i = 0; i < kNodes; i += 2) {
    for (int j = 0; j < kNodes; j += 2) {
      all.push_back({p * p / 9, -loss * (i + 1.0) / kNodes, -loss * (j + 1.0) / kNodes});
    }
  }
  return all;
}

constexpr double kPlaceStep_m = 0.1;
constexpr std::array<double, 6> kPlaceRadii_m = {0.1, 0.15, 0.2, 0.3, 0.4, 0.55};
constexpr double kLineStep_m = 0.05;
constexpr double kAbout_m = 0.03;   // of a line: readings near it count as across
constexpr double kMostPlaces = 40;  // along an axis

struct DrivenLine {
  Eigen::Vector2d from, to;
};

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

std::string metres(double value) { return formatted("%.2f", value); }

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

SlipFit fit_slip(std::span<const ResidualTrial> trials, std::span<const Eigen::Vector3d> residuals,
                 const std::vector<bool>& mask, const NoiseEstimate& start) {
  std::vector<ResidualTrial> seen;
  std::vector<Eigen::Vector3d> left;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (!mask[i]) continue;
    seen.push_back(trials[i]);
    left.push_back(residuals[i]);
  }
  // The mean loss was taken out with the rest by the fit.
  const auto nats = [&](const SlipFit& fit) {
    double sum = 0;
    for (const SlipTrial& t :
         trials_with_slips(seen, left, fit, fit.probability * fit.loss / 2, 0)) {
      sum += t.score;
    }
    return sum;
  };
  NoiseEstimate noise = start;
  noise.drive_common = std::max(noise.drive_common, kLeastDrive);
  noise.drive_side = std::max(noise.drive_side, kLeastDrive);
  // Logarithms of the drive's noise, then of the odds of a slip and of its greatest loss.
  const auto at = [&](const std::vector<double>& x) {
    SlipFit fit{0, 0, 0, noise};
    fit.noise.drive_common = std::exp(x[0]);
    fit.noise.drive_side = std::exp(x[1]);
    if (x.size() == 2) return fit;
    fit.probability = std::min(0.5, 1 / (1 + std::exp(-x[2])));
    fit.loss = std::min(1.0, std::exp(x[3]));
    return fit;
  };
  const auto maximise = [&](int most, std::vector<double>* x) {
    return infer::climb([&](const std::vector<double>& tried) { return nats(at(tried)); },
                        {.step = std::vector<double>(x->size(), 0.2),
                         .x_tolerance = 0.02,
                         .tolerance = 0.1,
                         .evaluations = most},
                        x);
  };
  std::vector<double> plain = {std::log(noise.drive_common), std::log(noise.drive_side)};
  const double base = maximise(40, &plain);
  SlipFit fit{0, 0, 0, noise};
  for (double probability : {0.04, 0.1, 0.2, 0.4}) {
    for (double loss : {0.06, 0.12, 0.25, 0.5}) {
      for (double less : {1.0, 0.85}) {
        SlipFit tried{0, probability, loss, noise};
        tried.noise.drive_common *= less;
        tried.noise.drive_side *= less;
        const double gain = nats(tried) - base;
        if (gain > fit.gain) fit = {gain, probability, loss, noise};
      }
    }
  }
  if (fit.gain < kLeastPromise) return fit;
  std::vector<double> x = {plain[0], plain[1], std::log(fit.probability / (1 - fit.probability)),
                           std::log(fit.loss)};
  const double gain = std::max(fit.gain, maximise(120, &x) - base);
  fit = at(x);
  fit.gain = gain;
  return fit;
}

std::vector<SlipTrial> trials_with_slips(std::span<const ResidualTrial> trials,
                                         std::span<const Eigen::Vector3d> residuals,
                                         const SlipFit& fit, double mean_loss,
                                         double outlier_share) {
  const std::vector<Event> events = events_of(fit.probability, fit.loss);
  std::vector<SlipTrial> judged;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const ResidualTrial& t = trials[i];
    const auto cov = Covariance3::factorise(trial_covariance(t, fit.noise));
    if (!cov) {
      judged.push_back({-1e3, 0, 0, 0});
      continue;
    }
    const Eigen::Vector3d centred = residuals[i] - mean_loss * (t.left + t.right);
    std::vector<double> logs;
    const double squared = cov->squared_distance(centred);
    double nearest = squared;
    for (const Event& e : events) {
      const Eigen::Vector3d r = centred - e.left * t.left - e.right * t.right;
      const bool one_side = e.left == 0 || e.right == 0;  // both at once are rare
      if (one_side) nearest = std::min(nearest, cov->squared_distance(r));
      logs.push_back(std::log(e.weight) + log_predictive_density(r, *cov, outlier_share));
    }
    const double score = log_sum_exp(logs);
    judged.push_back({score, 1 - std::exp(logs.front() - score), squared, nearest});
  }
  return judged;
}

double residual_kurtosis(const Eigen::VectorXd& whitened) {
  const double second = whitened.size() > 0 ? whitened.array().square().mean() : 0;
  if (second <= 0) return 3;
  return whitened.array().pow(4).mean() / (second * second);
}

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
    if (here < kFewestAlike || here <= expected_here || expected_here <= 0) continue;
    const double gain = here * std::log(here / expected_here) +
                        (rest > 0 ? rest * std::log(rest / expected_rest) : 0);
    if (gain > best.gain) best = {gain, place.description, std::move(passed)};
  }
  return best;
}

}  // namespace gapfarm
