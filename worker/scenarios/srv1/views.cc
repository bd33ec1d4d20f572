#include "worker/scenarios/srv1/views.h"

#include <cmath>

namespace gapfarm {
namespace {

constexpr double kLeastWeight = 1e-3;

double normal_distribution(double z) { return std::erfc(-z / std::sqrt(2.0)) / 2; }

std::vector<View> normalised(std::vector<View> views) {
  double sum = 0;
  for (const View& view : views) sum += view.weight;
  for (View& view : views) view.weight /= sum;
  return views;
}

}  // namespace

Views::Views(const ActiveEffects& effects) : effects_(effects) {
  const std::size_t lines = effects.beyond_lines({}, 0).size();
  for (unsigned sides = 0; lines > 0 && sides < 1u << lines; ++sides) {
    from_.push_back(effects.seen_from(sides));
  }
}

double Views::likelihood(unsigned sides, const Pose& X_WR, const Eigen::Vector2d& sd_m) const {
  // A line across an axis is as far away as the distance grows along it.
  constexpr double kStep_m = 1e-3;
  const auto beyond_at = [&](double x, double y) {
    return effects_.beyond_lines({x, y, X_WR.theta}, sides);
  };
  const std::vector<double> here = beyond_at(X_WR.x, X_WR.y);
  const std::vector<double> along_x = beyond_at(X_WR.x + kStep_m, X_WR.y);
  const std::vector<double> along_y = beyond_at(X_WR.x, X_WR.y + kStep_m);
  double product = 1;
  for (std::size_t k = 0; k < here.size(); ++k) {
    const double sd = std::hypot(sd_m.x() * (along_x[k] - here[k]) / kStep_m,
                                 sd_m.y() * (along_y[k] - here[k]) / kStep_m);
    const double far = sd > 0 ? normal_distribution(here[k] / sd) : here[k] > 0 ? 1 : 0;
    product *= sides >> k & 1 ? far : 1 - far;
  }
  return product;
}

std::vector<View> Views::observed(const Pose& X_WR, const Eigen::Vector2d& sd_m) const {
  if (from_.empty()) return {{1, effects_.observe(X_WR)}};
  std::vector<View> views;
  for (unsigned sides = 0; sides < from_.size(); ++sides) {
    const double weight = likelihood(sides, X_WR, sd_m);
    if (weight >= kLeastWeight) views.push_back({weight, from_[sides].observe(X_WR)});
  }
  return normalised(std::move(views));
}

std::vector<View> Views::recovered(const Pose& X_WM, double sd_m) const {
  if (from_.empty()) return {{1, effects_.recover(X_WM)}};
  std::vector<View> views;
  for (unsigned sides = 0; sides < from_.size(); ++sides) {
    const Pose X_WR = from_[sides].recover(X_WM);
    const double weight = likelihood(sides, X_WR, {sd_m, sd_m});
    if (weight >= kLeastWeight) views.push_back({weight, X_WR});
  }
  // Between two shifted views lies floor that neither side reports.
  if (views.empty()) return {{1, effects_.recover(X_WM)}};
  return normalised(std::move(views));
}

Pose Views::logged_end(const Pose& X_WS, const Pose& X_SE, const Pose& logged, double sd_m) const {
  if (from_.empty()) return effects_.observe(effects_.recover(X_WS) * X_SE);
  std::vector<const ActiveEffects*> views;
  for (const ActiveEffects& view : from_) {
    const auto sides = static_cast<unsigned>(&view - from_.data());
    const Pose X_WR = view.recover(logged);
    if (likelihood(sides, X_WR, {sd_m, sd_m}) >= kLeastWeight) views.push_back(&view);
  }
  if (views.empty()) views = {&effects_};
  Pose nearest;
  double least = INFINITY;
  for (const View& start : recovered(X_WS, sd_m)) {
    for (const ActiveEffects* view : views) {
      const Pose end = view->observe(start.pose * X_SE);
      const double miss = std::hypot(end.x - logged.x, end.y - logged.y);
      if (miss >= least) continue;
      least = miss;
      nearest = end;
    }
  }
  return nearest;
}

}  // namespace gapfarm
