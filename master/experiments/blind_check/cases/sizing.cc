#include "master/experiments/blind_check/cases/sizing.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "common/problem/problem.h"
#include "master/report/prediction_table.h"

namespace gapfarm {
namespace {

constexpr double kLeastStrength = 1e-6;  // of the bound: nothing smaller is an effect
constexpr unsigned kMostSteps = 40;
constexpr double kTolerance = 0.01;  // of the excess

double middle(double lower, double upper, Stream& stream) {
  return stream.uniform(lower + 0.25 * (upper - lower), lower + 0.75 * (upper - lower));
}

double draw_rest(const Parameter& p, const std::string& key, const Arena& arena, Stream& stream) {
  if (p.kind == ParameterKind::kChoice) return static_cast<double>(stream.below(p.choices.size()));
  if (p.unit == "rad") return stream.uniform(p.lower, p.upper);
  const double width = std::max(arena.x_upper - arena.x_lower, arena.y_upper - arena.y_lower);
  double value = p.nominal;
  if (p.unit == "m" && p.lower >= 0) {
    value = width * stream.uniform(0.07, 0.15);
  } else if (p.unit == "m" && key == "x") {
    value = middle(arena.x_lower, arena.x_upper, stream);
  } else if (p.unit == "m" && key == "y") {
    value = middle(arena.y_lower, arena.y_upper, stream);
  } else if (p.unit == "m") {  // on an axis that is drawn too: where both have trials
    value = middle(std::max(arena.x_lower, arena.y_lower), std::min(arena.x_upper, arena.y_upper),
                   stream);
  } else {
    value = p.nominal * stream.uniform(0.5, 2);
  }
  return std::clamp(value, p.lower, p.upper);
}

}  // namespace

Result<std::vector<std::size_t>> effects_named(const ParameterTable& table,
                                               const std::vector<std::string>& names) {
  const std::vector<std::string> known = mapped(table.effects(), &Effect::name);
  std::vector<std::size_t> places;
  for (std::size_t e = 0; names.empty() && e < known.size(); ++e) {
    if (table.effects()[e].repeats.empty()) places.push_back(e);
  }
  for (const std::string& name : names) {
    const auto found = std::ranges::find(known, name);
    if (found == known.end())
      return Error{"unknown effect '" + name + "'" + suggestion(name, known)};
    places.push_back(static_cast<std::size_t>(found - known.begin()));
  }
  return places;
}

Arena arena_of(const TrialLog& log, double share) {
  const auto x = mapped(log.trials, [](const Trial& trial) { return trial.X_WS.x; });
  const auto y = mapped(log.trials, [](const Trial& trial) { return trial.X_WS.y; });
  return {quantile(x, share), quantile(x, 1 - share), quantile(y, share), quantile(y, 1 - share)};
}

EffectDraw draw_effect(const ParameterTable& table, std::size_t effect, const Arena& arena,
                       Stream& stream) {
  const Effect& entry = table.effects()[effect];
  const std::size_t first = table.effect_row(effect);
  EffectDraw draw;
  draw.effect = effect;
  double norm = 0;
  for (std::size_t i = 0; i < entry.strengths; ++i) {
    const Parameter& p = table[first + i];
    double share = entry.strengths == 1 ? 1 : std::max(0.1, std::abs(stream.normal()));
    if (p.lower < p.nominal && (p.upper <= p.nominal || stream.bernoulli(0.5))) share = -share;
    draw.towards.push_back(share);
    norm = std::max(norm, std::abs(share));
  }
  for (double& share : draw.towards) share /= norm;
  for (std::size_t i = entry.strengths; i < entry.parameters.size(); ++i) {
    draw.rest.push_back(draw_rest(table[first + i], entry.parameters[i].key, arena, stream));
  }
  return draw;
}

std::vector<double> effect_values(const ParameterTable& table, const EffectDraw& draw,
                                  double strength) {
  std::vector<double> values;
  const std::size_t first = table.effect_row(draw.effect);
  for (std::size_t i = 0; i < draw.towards.size(); ++i) {
    const Parameter& p = table[first + i];
    const double share = strength * std::abs(draw.towards[i]);
    const double bound = draw.towards[i] < 0 ? p.lower : p.upper;
    const bool ratio = p.lower > 0 && p.nominal > p.lower;
    const double value = ratio ? p.nominal * std::pow(bound / p.nominal, share)
                               : p.nominal + share * (bound - p.nominal);
    values.push_back(strength == 0 ? p.nominal : std::clamp(value, p.lower, p.upper));
  }
  values.insert(values.end(), draw.rest.begin(), draw.rest.end());
  return values;
}

std::optional<double> size_of(const v1::PredictResult& base, const v1::PredictResult& effect,
                              bool by_spread) {
  double sum = 0;
  for (int i = 0; i < base.predictions_size(); ++i) {
    const v1::Predicted& b = base.predictions(i);
    const v1::Predicted& e = effect.predictions(i);
    const Eigen::Matrix3d s = local_covariance(b);
    const Eigen::FullPivLU<Eigen::Matrix3d> lu(s);
    if (!lu.isInvertible()) return std::nullopt;
    const Pose X_WB = from_proto(b.end());
    const Pose X_WE = from_proto(e.end());
    const Eigen::Vector3d d = local_difference(X_WB, X_WE);
    if (by_spread) {
      const Eigen::Matrix3d moment =
          rotate_covariance(local_covariance(e), d[2]) + d * d.transpose();
      sum += lu.solve(moment).trace() / 3;
    } else {
      sum += 1 + d.dot(lu.solve(d)) / 3;
    }
  }
  return sum / std::max(1, base.predictions_size());
}

StrengthSearch::StrengthSearch(double target) : target_(target) {}

void StrengthSearch::tell(std::optional<double> size) {
  ++evaluated_;
  const double log_strength = std::log(strength_);
  if (!size || !std::isfinite(*size)) {
    above_ = Point{log_strength, std::nullopt};
  } else {
    size_ = *size;
    const double share = (*size - 1) / (target_ - 1);
    if (std::abs(share - 1) <= kTolerance) {
      state_ = State::kFound;
      return;
    }
    const Point point{log_strength, share > 1e-12 ? std::optional(std::log(share)) : std::nullopt};
    (share < 1 ? below_ : above_) = point;
  }
  if (evaluated_ >= kMostSteps || (below_ && !above_ && strength_ >= 1) ||
      (above_ && !below_ && strength_ <= kLeastStrength)) {
    state_ = State::kOutOfReach;
    return;
  }
  propose();
}

void StrengthSearch::propose() {
  constexpr double kPower = 2;     // a shift in proportion to the strength, squared
  constexpr double kStride = 2.3;  // a factor of ten
  double next = 0;
  if (below_ && above_) {
    const double width = above_->log_strength - below_->log_strength;
    next = below_->log_strength + width / 2;
    // Every third step halves, so that a kink cannot hold the secants up.
    if (below_->log_excess && above_->log_excess && evaluated_ % 3 != 0) {
      const double lower = *below_->log_excess;
      next = below_->log_strength - lower * width / (*above_->log_excess - lower);
      next = std::clamp(next, below_->log_strength + 0.02 * width,
                        above_->log_strength - 0.02 * width);
    }
  } else if (below_) {
    const double step = below_->log_excess ? -*below_->log_excess / kPower : kStride;
    next = below_->log_strength + std::clamp(step, 0.01, kStride);
  } else {
    const double step = above_->log_excess ? *above_->log_excess / kPower : kStride;
    next = above_->log_strength - std::clamp(step, 0.01, kStride);
  }
  strength_ = std::clamp(std::exp(next), kLeastStrength, 1.0);
}

}  // namespace gapfarm
