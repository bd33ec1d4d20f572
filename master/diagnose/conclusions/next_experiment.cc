#include "master/diagnose/conclusions/next_experiment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "common/base/ranges.h"
#include "common/score/fitness.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr std::uint64_t kMostTrials = 500;  // a design that needs more separates nothing
constexpr std::size_t kMostSentences = 2;
constexpr double kAlikeFromAnywhere = 0.7;  // least over mean divergence of the starts
constexpr double kWorthTheTrouble = 1.5;    // divergence of a special way over the ordinary one's

using Predictions = std::vector<std::optional<PredictedEnd>>;  // one a synthetic trial

void keep(const v1::PredictResult& result, Predictions& to) {
  for (const v1::Predicted& predicted : result.predictions()) {
    if (predicted.trial() >= to.size() || predicted.cov_size() != 6) continue;
    PredictedEnd end;
    end.X_WM = from_proto(predicted.end());
    int k = 0;
    for (const auto& [row, column] : {std::pair{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}) {
      end.covariance(row, column) = end.covariance(column, row) = predicted.cov(k++);
    }
    to[predicted.trial()] = end;
  }
}

// One task an alternative and group: enough to keep many workers busy, and what one of them cannot
// simulate costs no other.
Result<std::vector<Predictions>> predict(Farm& farm, const ExperimentPlan& plan,
                                         const CompetingCauses& alternatives) {
  std::map<std::string, std::vector<std::uint32_t>> groups;
  for (const Design& design : plan.designs) append(groups[design.group], design.trials);
  std::vector<v1::Task> tasks;
  for (const CompetingCause& alternative : alternatives) {
    for (const auto& [group, trials] : groups) {
      tasks.push_back(prediction_task(alternative.overrides, false));
      tasks.back().mutable_predict()->mutable_trials()->Assign(trials.begin(), trials.end());
    }
  }
  const std::string hash = farm.add_problem(to_proto(plan.problem));
  ASSIGN_OR_RETURN(const auto results, farm.run(hash, tasks));
  std::vector<Predictions> all(alternatives.size(), Predictions(plan.problem.log.trials.size()));
  std::vector<bool> survived(alternatives.size(), false);
  std::string last;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const v1::TaskResult& result = results[i];
    if (result.outcome() != v1::OK) {
      last = v1::Outcome_Name(result.outcome()) + " (" + result.message() + ")";
      continue;  // that group cannot distinguish this alternative from another
    }
    survived[i / groups.size()] = true;
    keep(result.predict(), all[i / groups.size()]);
  }
  for (std::size_t r = 0; r < alternatives.size(); ++r) {
    if (survived[r]) continue;
    return Error{"alternative '" + alternatives[r].name + "' cannot be simulated in any design: " +
                 last + "; its parameters must leave something that moves"};
  }
  return all;
}

struct Separation {
  std::uint64_t trials = 0;
  bool many_starts = false;  // one start alone would show less
};

// None: the design does not part the two within kMostTrials.
std::optional<Separation> separation(const Design& design, const Predictions& a,
                                     const Predictions& b) {
  double sum = 0, least = INFINITY;
  for (const std::uint32_t i : design.trials) {
    if (!a[i] || !b[i]) return std::nullopt;
    const double d = divergence(*a[i], *b[i]);
    sum += d;
    least = std::min(least, d);
  }
  const double mean = sum / static_cast<double>(design.trials.size());
  if (design.ordinary) {
    const std::uint32_t i = *design.ordinary;
    if (!a[i] || !b[i] || mean < kWorthTheTrouble * divergence(*a[i], *b[i])) return std::nullopt;
  }
  const std::uint64_t needed = trials_needed(mean);
  if (needed > kMostTrials) return std::nullopt;
  const bool many = design.trials.size() > 1 && least < kAlikeFromAnywhere * mean;
  // The mean over the starts holds only when all of them are driven.
  return Separation{many ? std::max<std::uint64_t>(needed, design.trials.size()) : needed, many};
}

using Pair = std::pair<std::size_t, std::size_t>;

struct Choice {
  std::size_t design = 0;
  std::vector<Pair> pairs;
  std::uint64_t trials = 0;  // for the hardest of them
  bool many_starts = false;
};

bool better(const Choice& a, const Choice& b, const std::vector<Design>& designs) {
  if (a.pairs.size() != b.pairs.size()) return a.pairs.size() > b.pairs.size();
  if (a.trials != b.trials) return a.trials < b.trials;
  return designs[a.design].cost < designs[b.design].cost;
}

// The design that parts most of `pairs`, with the fewest trials.
std::optional<Choice> best_design(const ExperimentPlan& plan,
                                  const std::vector<Predictions>& predictions,
                                  const std::vector<Pair>& pairs,
                                  const std::function<bool(const Design&)>& allowed) {
  std::optional<Choice> best;
  for (std::size_t i = 0; i < plan.designs.size(); ++i) {
    const Design& design = plan.designs[i];
    if (!allowed(design)) continue;
    Choice choice{i, {}, 0, false};
    for (const Pair& pair : pairs) {
      const auto parted = separation(design, predictions[pair.first], predictions[pair.second]);
      if (!parted) continue;
      choice.pairs.push_back(pair);
      choice.trials = std::max(choice.trials, parted->trials);
      choice.many_starts = choice.many_starts || parted->many_starts;
    }
    if (choice.pairs.empty()) continue;
    if (!best || better(choice, *best, plan.designs)) best = std::move(choice);
  }
  return best;
}

std::vector<std::string> names_in(const std::vector<Pair>& pairs,
                                  const CompetingCauses& alternatives) {
  std::set<std::size_t> indices;
  for (const auto& [a, b] : pairs) indices.insert({a, b});
  return mapped(indices, [&](std::size_t i) { return alternatives[i].name; });
}

std::string distinguished(const std::vector<Pair>& pairs, const CompetingCauses& alternatives) {
  const std::vector<std::string> names = names_in(pairs, alternatives);
  if (names.size() == 2) return names[0] + " from " + names[1];
  if (2 * pairs.size() == names.size() * (names.size() - 1)) return listed(names) + " apart";
  std::vector<std::string> pair_texts;
  for (const auto& [a, b] : pairs)
    pair_texts.push_back(alternatives[a].name + " from " + alternatives[b].name);
  return listed(pair_texts);
}

NextExperiment sentence(const Choice& choice, const ExperimentPlan& plan,
                        const CompetingCauses& alternatives) {
  NextExperiment next;
  next.text = plan.designs[choice.design].action(choice.many_starts) + ": " +
              std::to_string(choice.trials) + " trials distinguish " +
              distinguished(choice.pairs, alternatives) + ".";
  next.separates = names_in(choice.pairs, alternatives);
  next.trials = choice.trials;
  return next;
}

NextExperiment hopeless(const std::vector<Pair>& pairs, const ExperimentPlan& plan,
                        const CompetingCauses& alternatives) {
  return {"No " + plan.designs_are + " distinguishes " + distinguished(pairs, alternatives) +
              " within " + std::to_string(kMostTrials) + " trials by end poses; " + plan.instead +
              ".",
          names_in(pairs, alternatives), 0};
}

}  // namespace

double divergence(const PredictedEnd& a, const PredictedEnd& b) {
  const Eigen::Vector3d d = local_difference(a.X_WM, b.X_WM);
  const Eigen::Matrix3d& A = a.covariance;
  const Eigen::Matrix3d B = rotate_covariance(b.covariance, d[2]);
  const Eigen::LLT<Eigen::Matrix3d> of_a(A), of_b(B), of_mean((A + B) / 2);
  if (of_a.info() != Eigen::Success || of_b.info() != Eigen::Success ||
      of_mean.info() != Eigen::Success) {
    return 0;
  }
  const double shift = d.dot(of_mean.solve(d)) / 2;
  const double shape = (of_a.solve(B).trace() + of_b.solve(A).trace() - 6) / 4;
  return shift + std::max(0.0, shape);
}

std::uint64_t trials_needed(double divergence) {
  constexpr double kQuantile = 1.6448536269514722;  // 0.95 of a standard normal
  constexpr double kMost = 1e15;
  if (!(divergence > 0)) return static_cast<std::uint64_t>(kMost);
  const double needed = std::ceil(std::min(kMost, 2 * kQuantile * kQuantile / divergence));
  return std::max(kFewestAlike, static_cast<std::uint64_t>(needed));
}

Result<std::vector<NextExperiment>> next_experiments(Farm& farm, const ExperimentPlan& plan,
                                                     const CompetingCauses& alternatives) {
  std::vector<NextExperiment> next;
  if (alternatives.size() < 2 || plan.designs.empty()) return next;
  ASSIGN_OR_RETURN(const auto predictions, predict(farm, plan, alternatives));
  std::vector<Pair> pairs;
  for (std::size_t a = 0; a < alternatives.size(); ++a) {
    for (std::size_t b = a + 1; b < alternatives.size(); ++b) pairs.emplace_back(a, b);
  }
  std::vector<Pair> open = pairs;
  std::set<std::string> used;
  const auto anything = [](const Design&) { return true; };
  const auto unused = [&](const Design& d) { return !used.contains(d.group); };
  while (next.size() < kMostSentences) {
    const bool again = open.empty();  // all are parted: offer another group
    const auto choice = again ? best_design(plan, predictions, pairs, unused)
                              : best_design(plan, predictions, open, anything);
    if (!choice) {
      if (!again) next.push_back(hopeless(open, plan, alternatives));
      break;
    }
    used.insert(plan.designs[choice->design].group);
    next.push_back(sentence(*choice, plan, alternatives));
    std::erase_if(open, [&](const Pair& pair) { return contains(choice->pairs, pair); });
  }
  return next;
}

}  // namespace gapfarm
