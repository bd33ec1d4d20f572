#include "master/experiments/crossfit/crossfit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "common/base/clock.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "common/trials/trial.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

std::vector<std::string> values_in(const TrialLog& log, const TrialColumnReader& column) {
  std::vector<std::string> values;
  for (const Trial& trial : log.trials) {
    const std::string word = column(trial);
    if (!contains(values, word)) values.push_back(word);
  }
  return values;
}

// The mean end of each trial's condition, over its repeats as seen from their own starts.
std::vector<Pose> mean_of_repeats(const TrialLog& log,
                                  const std::vector<TrialColumnReader>& columns) {
  std::map<std::vector<std::string>, Eigen::Vector4d> sums;  // x, y, cos, sin
  std::vector<std::vector<std::string>> keys;
  for (const Trial& trial : log.trials) {
    auto key = mapped(columns, [&](const TrialColumnReader& column) { return column(trial); });
    const Pose& X = trial.X_WE;
    const auto [entry, fresh] = sums.try_emplace(key, Eigen::Vector4d::Zero());
    entry->second += Eigen::Vector4d(X.x, X.y, std::cos(X.theta), std::sin(X.theta));
    keys.push_back(std::move(key));
  }
  std::vector<Pose> ends;
  for (const auto& key : keys) {
    const auto n = static_cast<double>(std::ranges::count(keys, key));
    const Eigen::Vector4d mean = sums.at(key) / n;
    ends.push_back({mean[0], mean[1], std::atan2(mean[3], mean[2])});
  }
  return ends;
}

// Whether there is something to tune on and to try on, and all that is named.
Status check_log(const Problem& problem, const CrossfitPlan& plan, const TrialLog& log) {
  RETURN_IF_ERROR(select_trials(log, plan.train));
  for (const std::vector<std::string>& filters : plan.tests) {
    RETURN_IF_ERROR(select_trials(log, filters));
  }
  std::vector<std::string> columns = plan.repeats;
  if (!plan.per.empty()) columns.push_back(plan.per);
  for (const std::string& column : columns) RETURN_IF_ERROR(trial_column_reader(log, column));
  for (const std::string& key : plan.sweeps) {
    if (!problem.table().find(key)) return Error{"--sweep " + key + ": there is no such parameter"};
  }
  return {};
}

// A fit's trials: those of a value of the plan's `by`, or all.
struct Part {
  std::string value;
  TrialLog log;
};

Error named(const CrossfitPlan& plan, const std::string& value, const Error& error) {
  return plan.by.empty() ? error : Error{plan.by + "=" + value + ": " + error.message, error.code};
}

Result<std::vector<Part>> parts_of(const Problem& problem, const CrossfitPlan& plan) {
  std::vector<std::string> values = {""};
  if (!plan.by.empty()) {
    ASSIGN_OR_RETURN(const auto by, trial_column_reader(problem.log, plan.by));
    values = values_in(problem.log, by);
  }
  std::vector<Part> parts;
  for (const std::string& value : values) {
    std::vector<std::string> filters;
    if (!plan.by.empty()) filters.push_back(plan.by + "=" + value);
    ASSIGN_OR_RETURN(auto log, select_trials(problem.log, filters));
    if (Status s = check_log(problem, plan, log); !s) return named(plan, value, s.error());
    parts.push_back({value, std::move(log)});
  }
  return parts;
}

// Mean corner distance where the trial's command is a piece, else the distance of the positions, m.
double end_error(const Problem& problem, const Trial& trial, const Pose& X_WE) {
  if (problem.pieces.empty()) return std::hypot(X_WE.x - trial.X_WE.x, X_WE.y - trial.X_WE.y);
  return corner_distance(problem.piece(trial.command), X_WE, trial.X_WE);
}

// One end a trial.
EndErrors end_errors(const Problem& problem, std::span<const Trial> trials,
                     std::span<const Pose> ends) {
  EndErrors errors;
  if (trials.empty()) return errors;
  std::vector<double> whole, position, heading;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    whole.push_back(end_error(problem, trials[i], ends[i]));
    const Pose& X = trials[i].X_WE;
    position.push_back(std::hypot(ends[i].x - X.x, ends[i].y - X.y));
    heading.push_back(std::abs(wrap_angle(ends[i].theta - X.theta)));
  }
  errors.trials = trials.size();
  errors.mean_m = mean(whole);
  errors.median_m = median(whole);
  errors.median_position_m = median(position);
  errors.median_heading_rad = median(heading);
  return errors;
}

ScoreCandidates scores_by(Farm& farm, const Problem& problem, std::uint64_t seed) {
  const std::string hash = farm.add_problem(to_proto(problem));
  return [&farm, hash, seed, fitness = problem.fitness](const std::vector<Candidate>& candidates,
                                                        const TakeScore& take) {
    const auto tasks_of = [&](const std::vector<Candidate>& of) {
      return mapped(of, [&](const Candidate& c) { return evaluation_task(c, seed); });
    };
    const auto on_answer = [&](std::size_t place,
                               const v1::TaskResult& result) -> Result<std::vector<v1::Task>> {
      ASSIGN_OR_RETURN(const Score score, score_of(result, fitness));
      ASSIGN_OR_RETURN(const auto more, take(place, score));
      return tasks_of(more);
    };
    return farm.stream(hash, tasks_of(candidates), on_answer);
  };
}

Result<Tuned> tune(const Problem& problem, Farm& farm, const CrossfitPlan& plan) {
  OptimiserSetup setup = optimiser_setup(plan.evolution, problem, plan.seed);
  setup.nominal = problem.genome_of(problem.values);
  ASSIGN_OR_RETURN(auto optimiser, make_optimiser(setup));
  EvolveOptions options;
  options.settings = plan.evolution;
  options.fitness = problem.fitness.kind;
  const auto keep_none = [](const GenerationRecord&) { return Status(); };
  ASSIGN_OR_RETURN(const auto summary, evolve(*optimiser, scores_by(farm, problem, plan.seed),
                                              keep_none, monotonic_seconds, options));
  if (!summary.best || summary.best->standing.outcome != v1::OK) {
    return Error{"every genome failed; widen or move the genes' ranges"};
  }
  return Tuned{problem.values_of(summary.best->genome),
               fitness_of_cost(problem.fitness.kind, summary.best->standing.cost),
               summary.evaluations};
}

class Crossfit {
 public:
  Crossfit(const Problem& problem, const CrossfitPlan& plan, Farm& farm)
      : problem_(problem), plan_(plan), farm_(farm) {}

  Result<CrossfitGroup> group(const std::string& name, const TrialLog& log) {
    CrossfitGroup group;
    group.name = name;
    ASSIGN_OR_RETURN(const TrialLog train, select_trials(log, plan_.train));
    ASSIGN_OR_RETURN(group.tuned, tune(with(train), farm_, plan_));
    RETURN_IF_ERROR(add_set("train", train, group));
    TrialLog tests;
    for (const std::vector<std::string>& filters : plan_.tests) {
      ASSIGN_OR_RETURN(const TrialLog test, select_trials(log, filters));
      const std::string name_of_set = joined(filters, " ");
      RETURN_IF_ERROR(add_set(name_of_set, test, group));
      const auto seen = std::ranges::count_if(test.trials, [&](const Trial& trial) {
        return std::ranges::any_of(train.trials, [&](const Trial& tuned_on) {
          return std::tie(tuned_on.session, tuned_on.trial) == std::tie(trial.session, trial.trial);
        });
      });
      if (seen > 0) {
        group.warnings.push_back(
            name_of_set + ": " + std::to_string(seen) + " of " +
            std::to_string(test.trials.size()) +
            " trials were tuned on and say nothing of others; name what to tune "
            "on with --train");
      }
      append(tests.trials, test.trials);
    }
    for (const std::string& key : plan_.sweeps) {
      ASSIGN_OR_RETURN(auto swept, sweep(key, train, tests, group.tuned.values));
      group.sweeps.push_back(std::move(swept));
    }
    return group;
  }

 private:
  Problem with(const TrialLog& log) const {
    Problem problem = problem_;
    problem.log = log;
    return problem;
  }

  Status add_set(const std::string& name, const TrialLog& log, CrossfitGroup& group) {
    ASSIGN_OR_RETURN(const auto ends,
                     predict_ends(with(log), {problem_.values, group.tuned.values}, farm_));
    for (std::size_t k = 0; k < 2; ++k) {
      if (ends[k].failure.empty()) continue;
      return Error{"the simulation of " + name + " at the " + (k == 1 ? "tuned" : "config's own") +
                   " parameters ended with " + ends[k].failure};
    }
    const std::vector<Pose> starts = mapped(log.trials, &Trial::X_WS);
    std::vector<Pose> repeats;
    std::vector<TrialColumnReader> condition;
    for (const std::string& column : plan_.repeats) {
      ASSIGN_OR_RETURN(const auto reader, trial_column_reader(log, column));
      condition.push_back(reader);
    }
    if (!condition.empty()) repeats = mean_of_repeats(log, condition);
    std::vector<std::string> parts = {""};
    TrialColumnReader per;
    if (!plan_.per.empty()) {
      ASSIGN_OR_RETURN(per, trial_column_reader(log, plan_.per));
      const auto values = values_in(log, per);
      if (values.size() > 1) append(parts, values);
    }
    for (const std::string& part : parts) {
      const auto members = filtered(indices(log.trials.size()), [&](std::size_t i) {
        return part.empty() || per(log.trials[i]) == part;
      });
      const auto errors = [&](const std::vector<Pose>& all) {
        std::vector<Trial> trials;
        std::vector<Pose> chosen;
        for (const std::size_t i : members) {
          if (i >= all.size()) return EndErrors{};
          trials.push_back(log.trials[i]);
          chosen.push_back(all[i]);
        }
        return end_errors(problem_, trials, chosen);
      };
      group.sets.push_back({name, part, errors(ends[0].ends), errors(ends[1].ends), errors(starts),
                            errors(repeats)});
    }
    return {};
  }

  Result<Sweep> sweep(const std::string& key, const TrialLog& train, const TrialLog& test,
                      const ParameterValues& around) {
    const ParameterTable& table = problem_.table();
    const auto row = table.find(key);  // check() found it
    // Over the gene's range where it is one, else over the row's.
    const Gene whole{*row, table[*row].lower, table[*row].upper, table[*row].scale};
    const Gene* searched = find_by(problem_.genes, *row, &Gene::row);
    const Gene gene = searched ? *searched : whole;
    Sweep sweep{key, {}};
    std::vector<ParameterValues> points;
    for (unsigned i = 0; i < plan_.sweep_points; ++i) {
      const double g = plan_.sweep_points < 2 ? 0.5 : double(i) / (plan_.sweep_points - 1);
      points.push_back(around);
      points.back()[*row] = decode_gene(table, gene, g);
      sweep.points.push_back({points.back()[*row], 0, 0});
    }
    for (const auto& [log, member] :
         {std::pair{&train, &SweepPoint::train_m}, std::pair{&test, &SweepPoint::test_m}}) {
      if (log->trials.empty()) continue;
      ASSIGN_OR_RETURN(const auto ends, predict_ends(with(*log), points, farm_));
      for (std::size_t i = 0; i < points.size(); ++i) {
        const PredictedEnds& predicted = ends[i];
        sweep.points[i].*member = predicted.failure.empty()
                                      ? end_errors(problem_, log->trials, predicted.ends).mean_m
                                      : std::numeric_limits<double>::quiet_NaN();
      }
    }
    return sweep;
  }

  const Problem& problem_;
  const CrossfitPlan& plan_;
  Farm& farm_;
};

// A stage each group: its evaluations, its sets, its sweeps.
std::vector<ProgressStage> stages_of(const std::vector<std::string>& groups,
                                     const CrossfitPlan& plan, std::size_t genes) {
  const std::uint64_t tasks = most_evaluations(plan.evolution, genes) +
                              2 * (1 + plan.tests.size()) +
                              2 * plan.sweeps.size() * plan.sweep_points;
  return mapped(groups, [&](const std::string& group) {
    return ProgressStage{group.empty() ? "fit" : "fit " + plan.by + "=" + group, 1, tasks};
  });
}

}  // namespace

Status check_crossfit(const Problem& problem, const CrossfitPlan& plan) {
  RETURN_IF_ERROR(parts_of(problem, plan));
  return {};
}

Result<std::vector<CrossfitGroup>> crossfit(const Problem& problem, const CrossfitPlan& plan,
                                            Farm& farm) {
  ASSIGN_OR_RETURN(const std::vector<Part> parts, parts_of(problem, plan));
  plan.hooks.planned(stages_of(mapped(parts, &Part::value), plan, problem.genes.size()));
  Crossfit fit(problem, plan, farm);
  std::vector<CrossfitGroup> groups;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    plan.hooks.began(k);
    auto group = fit.group(parts[k].value, parts[k].log);
    if (!group) return named(plan, parts[k].value, group.error());
    groups.push_back(std::move(*group));
  }
  return groups;
}

Result<std::vector<PredictedEnds>> predict_ends(const Problem& problem,
                                                const std::vector<ParameterValues>& points,
                                                Farm& farm, bool log_scores) {
  Problem plain = problem;
  plain.genes.clear();
  // Any fitness will do; this one asks nothing of the log.
  plain.fitness.kind = FitnessKind::kLogScore;
  const auto tasks = mapped(points, [&](const ParameterValues& values) {
    return prediction_task(overrides_of(plain.values, values), !log_scores);
  });
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(plain)), tasks));
  std::vector<PredictedEnds> all;
  for (const v1::TaskResult& result : results) {
    PredictedEnds& predicted = all.emplace_back();
    if (result.outcome() != v1::OK) {
      predicted.failure = v1::Outcome_Name(result.outcome()) + " (" + result.message() + ")";
      continue;
    }
    for (const v1::Predicted& p : result.predict().predictions()) {
      predicted.ends.push_back(from_proto(p.end()));
      if (log_scores) predicted.log_scores.push_back(p.log_score());
    }
  }
  return all;
}

}  // namespace gapfarm
