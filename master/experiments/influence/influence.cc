#include "master/experiments/influence/influence.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/text.h"
#include "common/math/rank_tests.h"
#include "common/random/stream.h"

namespace gapfarm {
namespace {

constexpr int kHorizons = 20;
constexpr double kMorrisStep = 2.0 / 3;  // of four levels, as usual
constexpr unsigned kBootstrap = 1000;
// A run that did not end well is further away than anything in the scene.
constexpr double kFailed_m = 1e6;
// Differences below are rounding.
constexpr double kLeast_m = 1e-9;
// Repeats of different uses must not share noise.
constexpr std::uint64_t kLevelNoise = 1u << 20, kMorrisNoise = 1u << 24;

class InfluenceStudy {
 public:
  InfluenceStudy(Farm& farm, const Problem& problem, const std::vector<Gene>& genes,
                 const InfluenceSettings& settings, const StageHooks& hooks)
      : farm_(farm),
        problem_(problem),
        genes_(genes),
        settings_(settings),
        distance_(kPathDistances[settings.distance].distance),
        hooks_(hooks) {}

  Result<InfluenceReport> run() {
    for (const Gene& gene : genes_) report_.factors.push_back({gene});
    plan();
    RETURN_IF_ERROR(standard());
    RETURN_IF_ERROR(one_at_a_time());
    RETURN_IF_ERROR(morris());
    std::ranges::stable_sort(report_.factors,
                             [](const FactorInfluence& a, const FactorInfluence& b) {
                               if (a.alone.influential != b.alone.influential)
                                 return a.alone.influential;
                               return a.alone.distance > b.alone.distance;
                             });
    return report_;
  }

 private:
  double apart(const PathSet& a, const PathSet& b) const {
    return a.ok && b.ok ? set_distance(a, b, distance_, samples_) : kFailed_m;
  }

  std::vector<double> repeat_distances() const {
    return mapped(indices(settings_.repeats),
                  [&](std::size_t r) { return apart(repeats_[r], others_[r]); });
  }

  // Later stages trace only to the horizon.
  void plan() const {
    const std::uint64_t traces = traces_of_a_set(problem_, settings_.trace);
    std::uint64_t levels = 0;
    for (const Gene& gene : genes_) levels += levels_of(gene).size();
    const std::uint64_t standard = traces * (1 + 2 * settings_.repeats);
    const std::uint64_t alone = traces * levels * settings_.repeats;
    const std::uint64_t walks = traces * settings_.trajectories * (genes_.size() + 3);
    hooks_.planned({{"repeat the standard", double(standard), standard},
                    {"move one parameter at a time", double(alone), alone},
                    {"walk through the box (Morris)", double(walks), walks}});
  }

  Status standard() {
    hooks_.began(0);
    std::vector<TraceRequest> requests = {{{}, std::nullopt}};
    for (unsigned r = 0; r < 2 * settings_.repeats; ++r) requests.push_back({{}, r});
    ASSIGN_OR_RETURN(auto sets, trace_paths(farm_, problem_, settings_.trace, requests));
    for (const PathSet& set : sets) {
      if (!set.ok) return Error{"the standard itself does not end well; change its [parameters]"};
    }
    nominal_ = sets.front();
    repeats_.assign(sets.begin() + 1, sets.begin() + 1 + settings_.repeats);
    others_.assign(sets.begin() + 1 + settings_.repeats, sets.end());
    choose_horizon();
    noise_ = repeat_distances();
    report_.repeat_distance = median(noise_);
    report_.repeat_95 = {quantile(noise_, 0.025), quantile(noise_, 0.975)};
    return {};
  }

  void choose_horizon() {
    const double interval_s = settings_.trace.interval_s;
    double longest_s = 0;  // of the paths: a robot moves on for a while after its command
    for (const std::vector<PathPoint>& path : nominal_.paths) {
      longest_s = std::max(longest_s, static_cast<double>(path.size() - 1) * interval_s);
    }
    const auto samples_of = [&](double horizon_s) {
      return static_cast<std::size_t>(std::floor(horizon_s / interval_s + 1e-9)) + 1;
    };
    double least_share = std::numeric_limits<double>::infinity();
    for (int i = 1; i <= kHorizons; ++i) {
      HorizonPoint point{longest_s * i / kHorizons, 0, 0};
      samples_ = samples_of(point.horizon_s);
      point.repeat_distance = median(repeat_distances());
      point.extent = set_extent(nominal_, samples_);
      // Before a finger touches its piece the noise of the start is all there is.
      const double share = point.repeat_distance / std::max(point.extent, kLeast_m);
      if (share <= std::max(settings_.chaos_share, least_share))
        report_.horizon_s = point.horizon_s;
      least_share = std::min(least_share, share);
      report_.horizons.push_back(point);
    }
    if (settings_.horizon_s) report_.horizon_s = std::min(*settings_.horizon_s, longest_s);
    samples_ = samples_of(report_.horizon_s);
    // What comes after the horizon need not be driven.
    for (CommandSpec& command : settings_.trace.commands) {
      command.duration_s = std::min(command.duration_s, report_.horizon_s);
    }
  }

  // Different values of the gene over its range, without the standard's.
  std::vector<double> levels_of(const Gene& gene) const {
    const Parameter& row = problem_.table()[gene.row];
    const auto all = static_cast<std::size_t>(gene.upper - gene.lower) + 1;  // of whole numbers
    const std::size_t count = row.kind == ParameterKind::kChoice ? all
                              : row.kind == ParameterKind::kReal
                                  ? settings_.levels
                                  : std::min<std::size_t>(settings_.levels, all);
    std::vector<double> levels;
    for (std::size_t k = 0; k < count; ++k) {
      const double g = count == 1 ? 0 : static_cast<double>(k) / static_cast<double>(count - 1);
      const double value = decode_gene(problem_.table(), gene, g);
      const bool known = contains(levels, value);
      if (!known && value != problem_.values[gene.row]) levels.push_back(value);
    }
    return levels;
  }

  Status one_at_a_time() {
    hooks_.began(1);
    std::vector<double> p;
    for (std::size_t f = 0; f < report_.factors.size(); ++f) {
      FactorInfluence& factor = report_.factors[f];
      const std::vector<double> levels = levels_of(factor.gene);
      std::vector<TraceRequest> requests;
      for (std::size_t l = 0; l < levels.size(); ++l) {
        for (unsigned r = 0; r < settings_.repeats; ++r) {
          requests.push_back({{override_of(factor.gene.row, levels[l])},
                              kLevelNoise + (f * 64 + l) * settings_.repeats + r});
        }
      }
      ASSIGN_OR_RETURN(const auto sets, trace_paths(farm_, problem_, settings_.trace, requests));
      p.push_back(judge_levels(levels, sets, factor));
    }
    adjust(p, &FactorInfluence::alone);
    return {};
  }

  void adjust(const std::vector<double>& p, Influence FactorInfluence::*of) {
    const std::vector<double> adjusted = holm(p);
    for (std::size_t f = 0; f < p.size(); ++f) {
      Influence& to = report_.factors[f].*of;
      to.p = adjusted[f];
      to.influential = to.p < settings_.alpha;
    }
  }

  // Fills in the level that moves furthest; returns the p of the best level times their number.
  double judge_levels(const std::vector<double>& levels, const std::vector<PathSet>& sets,
                      FactorInfluence& factor) const {
    double least_p = 1;
    Influence& alone = factor.alone;
    alone.distance = -1;
    for (std::size_t l = 0; l < levels.size(); ++l) {
      std::vector<double> distances;
      for (unsigned r = 0; r < settings_.repeats; ++r) {
        const PathSet& set = sets[l * settings_.repeats + r];
        alone.failures += set.ok ? 0 : 1;
        distances.push_back(apart(set, repeats_[r]));
      }
      const double middle = median(distances);
      if (middle > median(noise_) + kLeast_m) {
        least_p = std::min(least_p, mann_whitney(distances, noise_).p);
      }
      if (middle <= alone.distance) continue;
      alone.distance = middle;
      alone.distance_95 = median_interval(distances, 0.95);
      factor.level = levels[l];
    }
    alone.distance = std::max(alone.distance, 0.0);
    return std::min(1.0, least_p * static_cast<double>(std::max<std::size_t>(levels.size(), 1)));
  }

  Status morris() {
    hooks_.began(2);
    const std::size_t k = genes_.size();
    std::vector<TraceRequest> requests;
    std::vector<std::vector<std::size_t>> orders;
    for (unsigned t = 0; t < settings_.trajectories; ++t) {
      Stream stream({settings_.trace.seed, Purpose::kStatistics, 1, t});
      Genome genome(k);
      for (double& g : genome) g = stream.bernoulli(0.5) ? 0 : 1.0 / 3;
      std::vector<bool> down(k);
      for (std::size_t i = 0; i < k; ++i) {
        down[i] = stream.bernoulli(0.5);
        if (down[i]) genome[i] += kMorrisStep;
      }
      orders.push_back(stream.permutation(k));
      for (std::uint64_t side = 0; side < 2; ++side) {
        requests.push_back(
            {overrides_of(problem_.table(), genes_, genome), kMorrisNoise + 2 * t + side});
      }
      requests.push_back({overrides_of(problem_.table(), genes_, genome), std::nullopt});
      for (const std::size_t i : orders.back()) {
        genome[i] += down[i] ? -kMorrisStep : kMorrisStep;
        requests.push_back({overrides_of(problem_.table(), genes_, genome), std::nullopt});
      }
    }
    ASSIGN_OR_RETURN(const auto sets, trace_paths(farm_, problem_, settings_.trace, requests));
    judge_walks(sets, orders);
    return {};
  }

  void judge_walks(const std::vector<PathSet>& sets,
                   const std::vector<std::vector<std::size_t>>& orders) {
    const std::size_t k = genes_.size(), length = k + 3;
    std::vector<double> noise;
    std::vector<std::vector<double>> steps(k);
    for (std::size_t t = 0; t < orders.size(); ++t) {
      const auto at = [&](std::size_t i) -> const PathSet& { return sets[t * length + i]; };
      if (at(0).ok && at(1).ok) noise.push_back(apart(at(0), at(1)));
      for (std::size_t s = 0; s < k; ++s) {
        const PathSet& from = at(2 + s);
        const PathSet& to = at(3 + s);
        if (from.ok && to.ok) {
          steps[orders[t][s]].push_back(apart(from, to));
        } else {
          ++report_.factors[orders[t][s]].morris.failures;
        }
      }
    }
    if (noise.empty()) return;
    std::vector<double> p;
    for (std::size_t f = 0; f < k; ++f) {
      const bool further = !steps[f].empty() && median(steps[f]) > median(noise) + kLeast_m;
      p.push_back(further ? mann_whitney(steps[f], noise).p : 1);
      summarise_steps(steps[f], f, report_.factors[f]);
    }
    adjust(p, &FactorInfluence::morris);
  }

  void summarise_steps(const std::vector<double>& steps, std::size_t f, FactorInfluence& to) const {
    if (steps.empty()) return;
    const auto mean_of = [&](std::span<const std::size_t> members) {
      return mean(mapped(members, [&](std::size_t i) { return steps[i]; }));
    };
    const double middle = to.morris.distance = mean(steps);
    to.sigma = std::sqrt(
        mean(mapped(steps, [&](double step) { return (step - middle) * (step - middle); })));
    const auto blocks =
        mapped(indices(steps.size()), [](std::size_t i) { return std::vector<std::size_t>{i}; });
    Stream stream({settings_.trace.seed, Purpose::kStatistics, 2, f});
    to.morris.distance_95 = bootstrap_interval(blocks, mean_of, 0.95, kBootstrap, stream);
  }

  Farm& farm_;
  const Problem& problem_;
  const std::vector<Gene>& genes_;
  InfluenceSettings settings_;
  PathDistance distance_;
  const StageHooks& hooks_;
  InfluenceReport report_;
  PathSet nominal_;
  std::vector<PathSet> repeats_, others_;
  std::vector<double> noise_;
  std::size_t samples_ = 0;
};

std::string distance_text(double distance_m) {
  return distance_m >= 1e5 ? std::string("fails") : fmt::format("{:.3g}", distance_m);
}

std::string interval_text(const Interval& interval) {
  if (std::isnan(interval.lower)) return "-";
  return distance_text(interval.lower) + " to " + distance_text(interval.upper);
}

// The value without its unit, as TOML has it.
std::string toml_value(const ParameterTable& table, std::size_t row, double value) {
  const std::string text = table.text_of(row, value);
  return table[row].kind == ParameterKind::kChoice ? '"' + text + '"' : text;
}

}  // namespace

Result<InfluenceReport> find_influence(Farm& farm, const Problem& problem,
                                       const std::vector<Gene>& genes,
                                       const InfluenceSettings& settings, const StageHooks& hooks) {
  if (genes.empty()) return Error{"there are no parameters to look at"};
  return InfluenceStudy(farm, problem, genes, settings, hooks).run();
}

std::vector<Gene> all_base_genes(const ParameterTable& table) {
  std::vector<Gene> genes;
  for (std::size_t row = 0; row < table.size(); ++row) {
    if (!table[row].effect.empty()) continue;
    genes.push_back({row, table[row].lower, table[row].upper, table[row].scale});
  }
  return genes;
}

std::string influence_text(const InfluenceReport& report, const ParameterTable& table) {
  std::string text = fmt::format(
      "paths are compared over the first {:.3g} s, where repeats of the standard are {:.3g} m "
      "apart (95 %: {})\n\n{:<24} {:>9} {:>20} {:>9} {:>8}   {:>9} {:>20} {:>9} {:>8}\n",
      report.horizon_s, report.repeat_distance, interval_text(report.repeat_95), "alone: m further",
      "median", "95 %", "at", "p", "Morris", "95 %", "sigma", "p");
  for (const FactorInfluence& f : report.factors) {
    text += fmt::format("{:<24} {:>9} {:>20} {:>9.3g} {:>8.1g} {} {:>9} {:>20} {:>9} {:>8.1g} {}\n",
                        table[f.gene.row].key, distance_text(f.alone.distance),
                        interval_text(f.alone.distance_95), f.level, f.alone.p,
                        f.alone.influential ? '*' : ' ', distance_text(f.morris.distance),
                        interval_text(f.morris.distance_95), distance_text(f.sigma), f.morris.p,
                        f.morris.influential ? '*' : ' ');
  }
  if (std::ranges::none_of(report.factors, &FactorInfluence::influential)) {
    return text +
           "\nnone is shown to move the path further than repeats do (5 % over all "
           "parameters), so genes.toml is empty; more --repeats and --trajectories show more\n";
  }
  return text + "\n* moves the path further than repeats do, at 5 % over all parameters\n";
}

std::string influence_csv(const InfluenceReport& report, const ParameterTable& table) {
  std::string text =
      "parameter,lower,upper,alone_value,alone_distance_m,alone_low_95,alone_high_95,alone_p,alone_"
      "influential,alone_failures,morris_mean_m,morris_low_95,morris_high_95,morris_sigma_m,morris_"
      "p,morris_influential,morris_failures,repeat_distance_m,horizon_s\n";
  for (const FactorInfluence& f : report.factors) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
                        table[f.gene.row].key, f.gene.lower, f.gene.upper, f.level,
                        f.alone.distance, f.alone.distance_95.lower, f.alone.distance_95.upper,
                        f.alone.p, f.alone.influential ? 1 : 0, f.alone.failures, f.morris.distance,
                        f.morris.distance_95.lower, f.morris.distance_95.upper, f.sigma, f.morris.p,
                        f.morris.influential ? 1 : 0, f.morris.failures, report.repeat_distance,
                        report.horizon_s);
  }
  return text;
}

std::string influential_genes(const InfluenceReport& report, const ParameterTable& table) {
  std::string text =
      "# Parameters that move the path further than repeats do, most influential first.\n[genes]\n";
  for (const FactorInfluence& f : report.factors) {
    if (!f.influential()) continue;
    const Parameter& parameter = table[f.gene.row];
    std::vector<double> listed = {f.gene.lower, f.gene.upper};
    if (parameter.kind == ParameterKind::kChoice) {
      listed.clear();
      for (double choice = f.gene.lower; choice <= f.gene.upper; ++choice) listed.push_back(choice);
    }
    const auto toml = [&](double value) { return toml_value(table, f.gene.row, value); };
    text += parameter.key + " = [" + joined(listed, ", ", toml) + "]";
    if (parameter.unit != "-") text += "  # " + parameter.unit;
    text += "\n";
  }
  return text;
}

}  // namespace gapfarm
