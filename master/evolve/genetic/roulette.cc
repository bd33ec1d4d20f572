#include "master/evolve/genetic/roulette.h"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace gapfarm {
namespace {

constexpr double kLearningRate = 0.2;
// Quality that the start probabilities stand for: about what good operators earn early on.
constexpr double kStartQuality = 0.05;

}  // namespace

Roulette::Roulette(std::vector<std::string> names, std::vector<double> start, double floor,
                   bool adaptive)
    : names_(std::move(names)), adaptive_(adaptive), probabilities_(std::move(start)) {
  assert(!names_.empty() && names_.size() == probabilities_.size());
  floor_ = std::clamp(floor, 0.0, 1.0 / static_cast<double>(names_.size()));
  for (double p : probabilities_) qualities_.push_back(kStartQuality * std::max(0.0, p - floor_));
  update_probabilities();
}

void Roulette::update_probabilities() {
  if (!adaptive_) return;
  const auto arms = static_cast<double>(qualities_.size());
  const double sum = std::accumulate(qualities_.begin(), qualities_.end(), 0.0);
  for (std::size_t i = 0; i < qualities_.size(); ++i) {
    const double share = sum > 0 ? qualities_[i] / sum : 1 / arms;
    probabilities_[i] = floor_ + (1 - arms * floor_) * share;
  }
}

std::size_t Roulette::pick(Stream& stream) const { return pick_other(names_.size(), stream); }

std::size_t Roulette::pick_other(std::size_t arm, Stream& stream) const {
  double sum = 0;
  for (std::size_t i = 0; i < probabilities_.size(); ++i) sum += i == arm ? 0 : probabilities_[i];
  double draw = stream.uniform() * sum;
  std::size_t last = arm == 0 ? 1 : 0;
  for (std::size_t i = 0; i < probabilities_.size(); ++i) {
    if (i == arm || probabilities_[i] <= 0) continue;
    last = i;
    draw -= probabilities_[i];
    if (draw < 0) break;
  }
  assert(last < probabilities_.size());
  return last;
}

void Roulette::learn(std::span<const Credit> credits) {
  assert(credits.size() == qualities_.size());
  if (!adaptive_) return;
  std::vector<double> next = qualities_;
  for (std::size_t i = 0; i < credits.size(); ++i) {
    if (credits[i].children == 0) continue;
    const double mean = credits[i].progress / credits[i].children;
    next[i] += kLearningRate * (mean - next[i]);
  }
  qualities_ = std::move(next);
  update_probabilities();
}

void Roulette::restore(std::vector<double> qualities) {
  assert(qualities.size() == qualities_.size());
  qualities_ = std::move(qualities);
  update_probabilities();
}

}  // namespace gapfarm
