#include "master/diagnose/next_experiment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <set>
#include <utility>

#include "common/score/fitness.h"
#include "master/diagnose/findings.h"

namespace gapfarm {
namespace {

enum class Way { kManyStarts, kAfterOpposite, kLate };

constexpr int kStarts = 5;  // no harmonic of the heading up to the fourth repeats on five
constexpr double kFirstHeading = 0.3;  // rad
constexpr double kEarly_s = 30;
constexpr double kLate_s = 1200;
constexpr std::uint64_t kFewestTrials = 3;
constexpr double kAlikeFromAnywhere = 0.7;  // least over mean divergence of the starts
constexpr double kWorthTheTrouble = 1.5;    // divergence of a special way over the ordinary one's

struct Design {
  CommandSpec command;
  double level = 1;
  Way way = Way::kManyStarts;
  std::vector<std::uint32_t> trials;  // of the synthetic log, to be predicted
  std::uint32_t ordinary = 0;         // trial from the same start, early and after nothing
};

struct Experiment {
  Problem problem;  // with the synthetic log
  std::vector<Design> designs;
};

std::string level_words(double level) {
  if (level == 1) return "full level";
  if (level == 0.5) return "half level";
  return plain_number(100 * level) + " % of the level";
}

// Places over the box around the log's own starts; the origin alone without a log.
std::vector<Pose> starts_like(const TrialLog& log) {
  double x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    const Pose& X = log.trials[i].X_WS;
    if (i == 0) x0 = x1 = X.x, y0 = y1 = X.y;
    x0 = std::min(x0, X.x), x1 = std::max(x1, X.x);
    y0 = std::min(y0, X.y), y1 = std::max(y1, X.y);
  }
  std::vector<Pose> starts;
  for (int k = 0; k < kStarts; ++k) {
    // Steps of 2/5 in y against 1/5 in x: no two on a line with a side of the box.
    const double across = (k + 0.5) / kStarts;
    const double along = ((2 * k) % kStarts + 0.5) / kStarts;
    starts.push_back({x0 + across * (x1 - x0), y0 + along * (y1 - y0),
                      wrap_angle(kFirstHeading + 2 * std::numbers::pi * k / kStarts)});
  }
  return starts;
}

Trial trial_of(const CommandSpec& c, const Pose& start, double t_s, const std::string& session) {
  Trial trial;
  trial.session = session;
  trial.t_s = t_s;
  trial.command = c.name;
  trial.left = c.left;
  trial.right = c.right;
  trial.duration_s = c.duration_s;
  trial.X_WS = start;
  trial.X_WE = start;
  return trial;
}

// Every trial has a session of its own, so that what went before is what the design says.
void add_trials(const std::vector<Pose>& starts, Experiment& experiment, Design& design) {
  std::vector<Trial>& log = experiment.problem.log.trials;
  const std::size_t count = design.way == Way::kManyStarts ? starts.size() : 1;
  for (std::size_t k = 0; k < count; ++k) {
    const std::string session = "d" + std::to_string(log.size());
    double t_s = design.way == Way::kLate ? kLate_s : kEarly_s;
    if (design.way == Way::kAfterOpposite) {
      CommandSpec opposite = design.command;
      opposite.left = -opposite.left;
      opposite.right = -opposite.right;
      log.push_back(trial_of(opposite, starts[k], t_s, session));
      t_s += opposite.duration_s + 4;
    }
    design.trials.push_back(static_cast<std::uint32_t>(log.size()));
    log.push_back(trial_of(design.command, starts[k], t_s, session));
    log.back().trial = design.way == Way::kAfterOpposite ? 1 : 0;
  }
}

Experiment make_experiment(const Problem& problem, const NextExperimentOptions& options) {
  Experiment experiment;
  experiment.problem = problem;
  experiment.problem.genes.clear();
  experiment.problem.log = {};
  const std::vector<Pose> starts = starts_like(problem.log);
  for (const CommandSpec& own : problem.commands) {
    for (const double duration : options.durations_s) {
      for (const double level : options.levels) {
        std::uint32_t ordinary = 0;
        for (const Way way : {Way::kManyStarts, Way::kAfterOpposite, Way::kLate}) {
          Design design{own, level, way, {}, 0};
          design.command.left *= level;
          design.command.right *= level;
          design.command.duration_s = duration;
          add_trials(starts, experiment, design);
          if (way == Way::kManyStarts) ordinary = design.trials.front();
          design.ordinary = ordinary;
          experiment.designs.push_back(std::move(design));
        }
      }
    }
  }
  return experiment;
}

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

// One task a rival and command: enough to keep many workers busy.
Result<std::vector<Predictions>> predict(Farm& farm, const Experiment& experiment,
                                         const Rivals& rivals) {
  std::vector<v1::Task> tasks;
  std::vector<std::size_t> of_rival;
  for (std::size_t r = 0; r < rivals.size(); ++r) {
    for (const CommandSpec& command : experiment.problem.commands) {
      v1::Task task;
      v1::PredictTask& to = *task.mutable_predict();
      for (const v1::Override& o : rivals[r].overrides) *to.mutable_point()->add_overrides() = o;
      for (const Design& design : experiment.designs) {
        if (design.command.name != command.name) continue;
        for (const std::uint32_t i : design.trials) to.add_trials(i);
      }
      if (to.trials_size() == 0) continue;  // an empty list would mean all trials
      tasks.push_back(std::move(task));
      of_rival.push_back(r);
    }
  }
  const std::string hash = farm.add_problem(to_proto(experiment.problem));
  const auto results = farm.run(hash, tasks);
  if (!results) return results.error();
  std::vector<Predictions> all(rivals.size(), Predictions(experiment.problem.log.trials.size()));
  std::vector<bool> survived(rivals.size(), false);
  std::string last;
  for (std::size_t i = 0; i < results->size(); ++i) {
    const v1::TaskResult& result = (*results)[i];
    if (result.outcome() != v1::OK) {
      last = v1::Outcome_Name(result.outcome()) + " (" + result.message() + ")";
      continue;  // that command cannot tell this rival from another
    }
    survived[of_rival[i]] = true;
    keep(result.predict(), all[of_rival[i]]);
  }
  for (std::size_t r = 0; r < rivals.size(); ++r) {
    if (survived[r]) continue;
    return Error{"rival '" + rivals[r].name + "' cannot be simulated with any command: " + last +
                 "; its parameters must keep the robot driving"};
  }
  return all;
}

struct Separation {
  std::uint64_t trials = 0;
  bool many_starts = false;  // one start alone would tell less
};

// None: the design does not part the two within `most` trials.
std::optional<Separation> separation(const Design& design, const Predictions& a,
                                     const Predictions& b, std::uint64_t most) {
  double sum = 0, least = INFINITY;
  for (const std::uint32_t i : design.trials) {
    if (!a[i] || !b[i]) return std::nullopt;
    const double d = divergence(*a[i], *b[i]);
    sum += d;
    least = std::min(least, d);
  }
  const double mean = sum / static_cast<double>(design.trials.size());
  // A special way has one start only; it must tell by what is special about it.
  if (design.way != Way::kManyStarts) {
    const std::uint32_t i = design.ordinary;
    if (!a[i] || !b[i] || mean < kWorthTheTrouble * divergence(*a[i], *b[i])) return std::nullopt;
  }
  const std::uint64_t needed = trials_needed(mean);
  if (needed > most) return std::nullopt;
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
  // The quicker experiment, then the plainer one.
  const Design& p = designs[a.design];
  const Design& q = designs[b.design];
  const double cost_p = p.command.duration_s + (p.way == Way::kManyStarts ? 0 : 10);
  const double cost_q = q.command.duration_s + (q.way == Way::kManyStarts ? 0 : 10);
  return cost_p < cost_q;
}

// The design that parts most of `pairs`, with the fewest trials.
std::optional<Choice> best_design(const Experiment& experiment,
                                  const std::vector<Predictions>& predictions,
                                  const std::vector<Pair>& pairs, std::uint64_t most,
                                  const std::function<bool(const Design&)>& allowed) {
  std::optional<Choice> best;
  for (std::size_t i = 0; i < experiment.designs.size(); ++i) {
    const Design& design = experiment.designs[i];
    if (!allowed(design)) continue;
    Choice choice{i, {}, 0, false};
    for (const Pair& pair : pairs) {
      const auto parted =
          separation(design, predictions[pair.first], predictions[pair.second], most);
      if (!parted) continue;
      choice.pairs.push_back(pair);
      choice.trials = std::max(choice.trials, parted->trials);
      choice.many_starts = choice.many_starts || parted->many_starts;
    }
    if (choice.pairs.empty()) continue;
    if (!best || better(choice, *best, experiment.designs)) best = std::move(choice);
  }
  return best;
}

std::vector<std::string> names_in(const std::vector<Pair>& pairs, const Rivals& rivals) {
  std::set<std::size_t> indices;
  for (const auto& [a, b] : pairs) indices.insert({a, b});
  std::vector<std::string> names;
  for (const std::size_t i : indices) names.push_back(rivals[i].name);
  return names;
}

std::string told_apart(const std::vector<Pair>& pairs, const Rivals& rivals) {
  const std::vector<std::string> names = names_in(pairs, rivals);
  if (names.size() == 2) return names[0] + " from " + names[1];
  if (2 * pairs.size() == names.size() * (names.size() - 1)) return listed(names) + " apart";
  std::vector<std::string> told;
  for (const auto& [a, b] : pairs) told.push_back(rivals[a].name + " from " + rivals[b].name);
  return listed(told);
}

NextExperiment sentence(const Choice& choice, const Experiment& experiment, const Rivals& rivals) {
  const Design& design = experiment.designs[choice.design];
  std::string how = " from any start";
  if (choice.many_starts) how = " from several headings and places";
  if (design.way == Way::kAfterOpposite) how = " straight after driving the opposite way";
  if (design.way == Way::kLate) {
    how = " " + plain_number(kLate_s / 60) + " minutes into a session";
  }
  NextExperiment next;
  next.text = "Drive " + design.command.name + " for " + plain_number(design.command.duration_s) +
              " s at " + level_words(design.level) + how + ": " + std::to_string(choice.trials) +
              " trials tell " + told_apart(choice.pairs, rivals) + ".";
  next.separates = names_in(choice.pairs, rivals);
  next.trials = choice.trials;
  return next;
}

NextExperiment hopeless(const std::vector<Pair>& pairs, const Rivals& rivals, std::uint64_t most) {
  return {"No design of one command tells " + told_apart(pairs, rivals) + " within " +
              std::to_string(most) +
              " trials by end poses; log paths, or measure one of them directly.",
          names_in(pairs, rivals), 0};
}

void erase(const std::vector<Pair>& done, std::vector<Pair>& pairs) {
  std::erase_if(pairs, [&](const Pair& pair) {
    return std::find(done.begin(), done.end(), pair) != done.end();
  });
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
  return std::max(kFewestTrials, static_cast<std::uint64_t>(needed));
}

Result<std::vector<NextExperiment>> next_experiments(Farm& farm, const Problem& problem,
                                                     const Rivals& rivals,
                                                     const NextExperimentOptions& options) {
  std::vector<NextExperiment> next;
  if (rivals.size() < 2 || options.sentences == 0) return next;
  const Experiment experiment = make_experiment(problem, options);
  const auto predictions = predict(farm, experiment, rivals);
  if (!predictions) return predictions.error();
  std::vector<Pair> pairs;
  for (std::size_t a = 0; a < rivals.size(); ++a) {
    for (std::size_t b = a + 1; b < rivals.size(); ++b) pairs.emplace_back(a, b);
  }
  std::vector<Pair> open = pairs;
  std::set<std::string> used;
  const auto anything = [](const Design&) { return true; };
  const auto unused = [&](const Design& d) { return !used.contains(d.command.name); };
  while (next.size() < options.sentences) {
    const bool again = open.empty();  // all are parted: offer another command
    const auto choice =
        again ? best_design(experiment, *predictions, pairs, options.most_trials, unused)
              : best_design(experiment, *predictions, open, options.most_trials, anything);
    if (!choice) {
      if (!again) next.push_back(hopeless(open, rivals, options.most_trials));
      break;
    }
    used.insert(experiment.designs[choice->design].command.name);
    next.push_back(sentence(*choice, experiment, rivals));
    erase(choice->pairs, open);
  }
  return next;
}

}  // namespace gapfarm
