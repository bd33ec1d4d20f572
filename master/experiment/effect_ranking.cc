#include "master/experiment/effect_ranking.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/suggest.h"
#include "common/score/statistics.h"
#include "common/trials/select.h"

namespace gapfarm {
namespace {

using Members = std::vector<std::size_t>;  // indices of trials

TrialLog part_of(const TrialLog& log, const Members& members) {
  TrialLog part;
  part.extra_columns = log.extra_columns;
  for (const std::size_t i : members) part.trials.push_back(log.trials[i]);
  return part;
}

Result<std::vector<Members>> groups_of(const TrialLog& log,
                                       const std::vector<std::string>& together) {
  std::vector<TrialColumnReader> readers;
  for (const std::string& column : together) {
    const auto reader = trial_column_reader(log, column);
    if (!reader) return reader.error();
    readers.push_back(*reader);
  }
  std::vector<Members> groups;
  std::map<std::vector<std::string>, std::size_t> group_of;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    std::vector<std::string> key;
    for (const TrialColumnReader& reader : readers) key.push_back(reader(log.trials[i]));
    if (key.empty()) key.push_back(std::to_string(i));
    const auto [entry, fresh] = group_of.try_emplace(std::move(key), groups.size());
    if (fresh) groups.emplace_back();
    groups[entry->second].push_back(i);
  }
  return groups;
}

// Each trial of a log held out once: where it was said to end, and how well that was said.
struct HeldOut {
  std::vector<Pose> ends;
  std::vector<double> scores;  // higher is better
  std::string failure;         // how the simulation failed; empty: it did not
};

// Fitted to everything, and to everything but one part at a time.
struct Fits {
  ParameterValues whole;
  std::vector<ParameterValues> folds;
};

class Ranking {
 public:
  Ranking(const Problem& problem, const EffectRankingPlan& plan, Farm& farm)
      : problem_(problem),
        plan_(plan),
        farm_(farm),
        nats_(problem.fitness.kind == FitnessKind::kLogScore) {}

  Result<EffectRanking> run() {
    if (Status s = divide(); !s) return s.error();
    const auto effects = chosen_effects();
    if (!effects) return effects.error();
    plan_.hooks.planned(stages(*effects));
    plan_.hooks.began(0);
    if (Status s = fit_base(); !s) return s.error();
    std::vector<std::vector<double>> gains;
    for (const std::size_t e : *effects) {
      plan_.hooks.began(gains.size() + 1);
      auto gain = try_effect(e, gains);
      if (!gain) return gain.error();
      ranking_.effects.push_back(std::move(*gain));
    }
    judge(gains);
    return std::move(ranking_);
  }

 private:
  Status divide() {
    auto groups = groups_of(problem_.log, plan_.together);
    if (!groups) return groups.error();
    groups_ = std::move(*groups);
    ranking_.groups = groups_.size();
    ranking_.nats = nats_;
    if (plan_.folds < 2 || groups_.size() < plan_.folds) {
      return Error{"the log's " + std::to_string(groups_.size()) +
                   " groups of trials cannot be left out in " + std::to_string(plan_.folds) +
                   " parts; there must be two parts at least and a group for each"};
    }
    parts_.resize(plan_.folds);
    rests_.resize(plan_.folds);
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      for (std::size_t k = 0; k < parts_.size(); ++k) {
        Members& to = g % plan_.folds == k ? parts_[k] : rests_[k];
        to.insert(to.end(), groups_[g].begin(), groups_[g].end());
      }
    }
    return {};
  }

  bool in_base(std::size_t e) const {
    const std::size_t first = problem_.table().effect_row(e);
    const std::size_t count = problem_.table().effects()[e].parameters.size();
    return std::any_of(problem_.genes.begin(), problem_.genes.end(), [&](const Gene& gene) {
      return gene.row >= first && gene.row < first + count;
    });
  }

  Result<std::vector<std::size_t>> chosen_effects() const {
    const std::span<const Effect> catalogue = problem_.table().effects();
    std::vector<std::string> known;
    std::vector<std::size_t> chosen;
    for (std::size_t e = 0; e < catalogue.size(); ++e) {
      known.push_back(catalogue[e].name);
      const bool second = !catalogue[e].repeats.empty();
      if (plan_.effects.empty() && !second && !in_base(e)) chosen.push_back(e);
    }
    for (const std::string& name : plan_.effects) {
      const auto found = std::find(known.begin(), known.end(), name);
      if (found == known.end()) {
        return Error{"there is no effect '" + name + "' in scenario " + problem_.scenario +
                     suggestion(name, known)};
      }
      const auto e = static_cast<std::size_t>(found - known.begin());
      if (!in_base(e)) chosen.push_back(e);
    }
    if (chosen.empty()) return Error{"there is no effect to try beside the genes of the base"};
    return chosen;
  }

  std::vector<ProgressStage> stages(const std::vector<std::size_t>& effects) const {
    const std::uint64_t fits = 1 + parts_.size();
    const std::uint64_t each = expected_evaluations(plan_.tuning.evolution);
    const auto stage = [](const std::string& name, std::uint64_t tasks) {
      return ProgressStage{name, static_cast<double>(tasks), tasks};
    };
    std::vector<ProgressStage> all = {stage("fit the base", 2 * fits * each + 2 * parts_.size())};
    for (const std::size_t e : effects) {
      const std::uint64_t more =
          plan_.tuning.evolution.evaluations
              ? each * genes_with(e).size() / std::max<std::size_t>(1, problem_.genes.size())
              : each;
      all.push_back(
          stage("try " + problem_.table().effects()[e].name, fits * more + parts_.size()));
    }
    return all;
  }

  Problem with(const ParameterValues& values, const std::vector<Gene>& genes,
               const TrialLog& log) const {
    Problem problem = problem_;
    problem.values = values;
    problem.genes = genes;
    problem.log = log;
    return problem;
  }

  // From `starts` on, which holds as many points as there are fits.
  Result<Fits> fit(const Fits& starts, const std::vector<Gene>& genes) const {
    TuningSettings settings = plan_.tuning;
    if (settings.evolution.evaluations) {
      *settings.evolution.evaluations =
          *settings.evolution.evaluations * genes.size() / problem_.genes.size();
    }
    Fits fits;
    const auto whole = tune(with(starts.whole, genes, problem_.log), farm_, settings);
    if (!whole) return whole.error();
    fits.whole = whole->values;
    for (std::size_t k = 0; k < rests_.size(); ++k) {
      const TrialLog rest = part_of(problem_.log, rests_[k]);
      const auto tuned = tune(with(starts.folds[k], genes, rest), farm_, settings);
      if (!tuned) return tuned.error();
      fits.folds.push_back(tuned->values);
    }
    return fits;
  }

  Result<HeldOut> held_out(const std::vector<ParameterValues>& points) const {
    HeldOut out;
    out.ends.resize(problem_.log.trials.size());
    out.scores.resize(problem_.log.trials.size());
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      const TrialLog part = part_of(problem_.log, parts_[k]);
      const auto predicted = predict_ends(with(points[k], {}, part), {points[k]}, farm_, nats_);
      if (!predicted) return predicted.error();
      const PredictedEnds& ends = predicted->front();
      if (!ends.failure.empty()) {
        out.failure = ends.failure;
        return out;
      }
      for (std::size_t i = 0; i < parts_[k].size(); ++i) {
        const std::size_t trial = parts_[k][i];
        out.ends[trial] = ends.ends[i];
        out.scores[trial] = nats_ ? ends.log_scores[i]
                                  : -end_error(problem_, problem_.log.trials[trial], ends.ends[i]);
      }
    }
    return out;
  }

  Status fit_base() {
    const Fits own{problem_.values, std::vector<ParameterValues>(parts_.size(), problem_.values)};
    const auto first = fit(own, problem_.genes);
    if (!first) return first.error();
    const auto fits = fit(*first, problem_.genes);
    if (!fits) return fits.error();
    base_ = *fits;
    const auto untuned = held_out(own.folds);
    if (!untuned) return untuned.error();
    auto tuned = held_out(base_.folds);
    if (!tuned) return tuned.error();
    for (const auto& [what, failure] :
         {std::pair{"config's own", untuned->failure}, {"base's tuned", tuned->failure}}) {
      if (failure.empty()) continue;
      return Error{"the simulation at the " + std::string(what) + " parameters ended with " +
                   failure};
    }
    base_scores_ = std::move(tuned->scores);
    std::vector<Pose> starts;
    for (const Trial& trial : problem_.log.trials) starts.push_back(trial.X_WS);
    ranking_.own = end_errors(problem_, problem_.log.trials, untuned->ends);
    ranking_.base = end_errors(problem_, problem_.log.trials, tuned->ends);
    ranking_.stay = end_errors(problem_, problem_.log.trials, starts);
    ranking_.parameters = fitted(base_, problem_.genes);
    return {};
  }

  std::vector<RankedParameter> fitted(const Fits& fits, const std::vector<Gene>& genes) const {
    std::vector<RankedParameter> all;
    for (const Gene& gene : genes) {
      RankedParameter p{gene.row, fits.whole[gene.row], {}};
      p.folds = {fits.folds.front()[gene.row], fits.folds.front()[gene.row]};
      for (const ParameterValues& values : fits.folds) {
        p.folds.lower = std::min(p.folds.lower, values[gene.row]);
        p.folds.upper = std::max(p.folds.upper, values[gene.row]);
      }
      all.push_back(p);
    }
    return all;
  }

  std::vector<Gene> genes_with(std::size_t e) const {
    const ParameterTable& table = problem_.table();
    std::vector<Gene> genes = problem_.genes;
    const std::size_t first = table.effect_row(e);
    for (std::size_t row = first; row < first + table.effects()[e].parameters.size(); ++row) {
      Gene gene{row, table[row].lower, table[row].upper, table[row].scale};
      for (const Gene& range : plan_.ranges) {
        if (range.row == row) gene = range;
      }
      genes.push_back(gene);
    }
    std::sort(genes.begin(), genes.end(),
              [](const Gene& a, const Gene& b) { return a.row < b.row; });
    return genes;
  }

  // Appends what every trial gained to `gains`, nothing for an effect that failed.
  Result<EffectGain> try_effect(std::size_t e, std::vector<std::vector<double>>& gains) const {
    EffectGain gain;
    gain.effect = problem_.table().effects()[e].name;
    const std::vector<Gene> genes = genes_with(e);
    const auto fits = fit(base_, genes);
    if (!fits) return Error{gain.effect + ": " + fits.error().message};
    gain.parameters = fitted(*fits, genes);
    const auto tried = held_out(fits->folds);
    std::vector<double>& gained = gains.emplace_back();
    if (!tried) return tried.error();
    gain.failure = tried->failure;
    if (!gain.failure.empty()) return gain;
    for (std::size_t i = 0; i < base_scores_.size(); ++i) {
      gained.push_back(tried->scores[i] - base_scores_[i]);
    }
    gain.gain = mean_of(gained);
    gain.errors = end_errors(problem_, problem_.log.trials, tried->ends);
    return gain;
  }

  static double mean_of(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  }

  Interval interval_of(const std::vector<double>& values, std::size_t looks,
                       std::uint64_t number) const {
    Stream stream({plan_.tuning.seed, Purpose::kStatistics, 0, number, 0});
    const auto mean = [&](std::span<const std::size_t> sample) {
      double sum = 0;
      for (const std::size_t i : sample) sum += values[i];
      return sum / static_cast<double>(sample.size());
    };
    return bootstrap_interval(groups_, mean, 1 - (1 - plan_.coverage) / static_cast<double>(looks),
                              plan_.bootstraps, stream);
  }

  void judge(const std::vector<std::vector<double>>& gains) {
    std::vector<EffectGain>& effects = ranking_.effects;
    const auto better = [](const EffectGain& a, const EffectGain& b) { return a.gain < b.gain; };
    const auto best = static_cast<std::size_t>(
        std::max_element(effects.begin(), effects.end(), better) - effects.begin());
    for (std::size_t e = 0; e < effects.size(); ++e) {
      if (gains[e].empty()) continue;
      effects[e].interval = interval_of(gains[e], effects.size(), 2 * e);
      effects[e].above_none = effects[e].interval.lower > 0;
      std::vector<double> behind;
      for (std::size_t i = 0; i < gains[e].size(); ++i) {
        behind.push_back(gains[best][i] - gains[e][i]);
      }
      effects[e].behind_best = interval_of(behind, effects.size(), 2 * e + 1);
      effects[e].alike = e != best && effects[e].above_none && effects[e].behind_best.lower <= 0;
    }
    if (effects[best].above_none) ranking_.best = effects[best].effect;
    std::stable_sort(effects.begin(), effects.end(),
                     [](const EffectGain& a, const EffectGain& b) { return a.gain > b.gain; });
  }

  const Problem& problem_;
  const EffectRankingPlan& plan_;
  Farm& farm_;
  const bool nats_;
  std::vector<Members> groups_, parts_, rests_;
  Fits base_;
  std::vector<double> base_scores_;
  EffectRanking ranking_;
};

}  // namespace

Result<EffectRanking> rank_effects(const Problem& problem, const EffectRankingPlan& plan,
                                   Farm& farm) {
  return Ranking(problem, plan, farm).run();
}

}  // namespace gapfarm
