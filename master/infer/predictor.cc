#include "master/infer/predictor.h"

#include <algorithm>
#include <memory>
#include <numeric>
#include <set>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/score/motion_model.h"

namespace gapfarm {
namespace {

constexpr std::size_t kTasks = 80;  // of a batch: enough for eight workers to end together
constexpr std::size_t kMostParts = 16;

void fill(const Overrides& at, v1::Point* point) {
  for (const auto& [row, value] : at) *point->add_overrides() = override_of(row, value);
}

v1::Task task_of(const Overrides& at, const std::vector<std::uint32_t>& trials, bool means_only,
                 std::uint32_t headings = 0) {
  v1::Task task;
  task.mutable_predict()->set_means_only(means_only);
  task.mutable_predict()->set_headings(headings);
  task.mutable_predict()->mutable_trials()->Add(trials.begin(), trials.end());
  fill(at, task.mutable_predict()->mutable_point());
  return task;
}

// The point by what differs from the problem's own values, no more than can be read.
std::string point_text(const Problem& problem, const Overrides& at) {
  constexpr std::size_t kMostNamed = 6;
  std::string text;
  std::size_t named = 0, others = 0;
  for (const auto& [row, value] : at) {
    if (value == problem.values[row]) continue;
    if (named == kMostNamed) {
      ++others;
      continue;
    }
    text += (named++ == 0 ? " at " : ", ") + problem.table()[row].key + " = " +
            problem.table().format(row, rounded_to_digits(value, 4));
  }
  return text + (others > 0 ? " and " + std::to_string(others) + " more" : "");
}

std::string bad_point(const Problem& problem, const Overrides& at, const v1::TaskResult& result) {
  const std::string why = result.message().empty() ? "" : " (" + result.message() + ")";
  return "the simulation ended with " + v1::Outcome_Name(result.outcome()) + why +
         point_text(problem, at);
}

Problem slower(Problem problem, double factor) {
  for (Trial& trial : problem.log.trials) {
    const CommandSpec command = resolved_command(trial, problem.commands);
    trial.left = command.left * factor;
    trial.right = command.right * factor;
  }
  return problem;
}

Status within_bounds(const Problem& problem, const Overrides& at) {
  for (const auto& [row, value] : at) {
    if (Status s = problem.table().check(row, value); !s) return s;
  }
  return {};
}

}  // namespace

void set_values(const ParameterTable& table, const std::map<std::string, double>& values,
                Overrides* at) {
  for (const auto& [key, value] : values) (*at)[table.row(key)] = value;
}

double value_at(const Problem& problem, const Overrides& at, std::size_t row) {
  const auto found = at.find(row);
  return found != at.end() ? found->second : problem.values[row];
}

Predictor::Predictor(Farm& farm, const Problem& problem)
    : farm_(farm), problem_(problem), hash_(farm.add_problem(to_proto(problem))) {
  by_condition_.resize(problem.log.trials.size());
  std::iota(by_condition_.begin(), by_condition_.end(), 0);
  std::stable_sort(by_condition_.begin(), by_condition_.end(),
                   [&](auto a, auto b) { return condition(a) < condition(b); });
}

Predictor::Condition Predictor::condition(std::uint32_t trial) const {
  const Trial& t = problem_.log.trials[trial];
  // Windows are parts of one run, which is simulated through.
  if (t.run) return {*t.run, "", {}, {}, {}};
  return {0, t.command, t.left, t.right, t.duration_s};
}

std::vector<std::vector<std::uint32_t>> Predictor::parts_of(const PredictionRequest& request,
                                                            std::size_t parts) const {
  if (parts == 1) return {request.trials};
  std::vector<std::uint32_t> trials = by_condition_;
  if (!request.trials.empty()) {
    const std::set<std::uint32_t> wanted(request.trials.begin(), request.trials.end());
    std::erase_if(trials, [&](std::uint32_t i) { return !wanted.count(i); });
  }
  parts = std::min(parts, std::max<std::size_t>(trials.size(), 1));
  std::vector<std::size_t> begins;  // of conditions
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (i == 0 || condition(trials[i - 1]) != condition(trials[i])) begins.push_back(i);
  }
  std::vector<std::vector<std::uint32_t>> cut;
  std::size_t from = 0;
  for (std::size_t p = 1; p <= parts; ++p) {
    std::size_t to = p * trials.size() / parts;
    // A condition in two tasks may have to be simulated twice, and a run has to be.
    if (p < parts && (begins.size() >= 2 * parts || problem_.windows())) {
      to = *std::lower_bound(begins.begin(), begins.end() - 1, to);
    }
    if (to <= from) continue;
    cut.emplace_back(trials.begin() + static_cast<std::ptrdiff_t>(from),
                     trials.begin() + static_cast<std::ptrdiff_t>(to));
    from = to;
  }
  return cut;
}

std::vector<v1::Task> Predictor::tasks(const Overrides& at) const {
  std::vector<v1::Task> tasks;
  for (const auto& part : parts_of({at, {}}, kMostParts)) tasks.push_back(task_of(at, part, true));
  return tasks;
}

Result<std::vector<std::vector<Pose>>> Predictor::ends(
    const std::vector<PredictionRequest>& requests) {
  ASSIGN_OR_RETURN(auto all, simulate(hash_, requests));
  std::vector<std::vector<Pose>> ends;
  for (std::optional<std::vector<Pose>>& of_one : all) {
    if (!of_one) return Error{last_failure_, ErrorCode::kSimulation};
    ends.push_back(std::move(*of_one));
  }
  return ends;
}

Error Predictor::failed(const std::string& what) const {
  return {what + ": " + last_failure_, ErrorCode::kSimulation};
}

Result<std::vector<std::optional<std::vector<Pose>>>> Predictor::attempt(
    const std::vector<PredictionRequest>& requests) {
  return simulate(hash_, requests);
}

Result<std::optional<std::vector<Pose>>> Predictor::attempt_slower(const Overrides& at,
                                                                   double factor) {
  ASSIGN_OR_RETURN(auto all,
                   simulate(farm_.add_problem(to_proto(slower(problem_, factor))), {{at, {}}}));
  return std::move(all.front());
}

Result<std::vector<std::optional<std::vector<Pose>>>> Predictor::simulate(
    const std::string& problem, const std::vector<PredictionRequest>& requests) {
  std::vector<std::string> failures(requests.size());
  std::vector<v1::Task> tasks;
  std::vector<std::pair<std::size_t, std::vector<std::uint32_t>>> asked;  // request, trials
  for (std::size_t k = 0; k < requests.size(); ++k) {
    if (const Status s = within_bounds(problem_, requests[k].at); !s) {
      failures[k] = s.error().message;
      continue;
    }
    // As many whoever works, so that the answers do not depend on it.
    const std::size_t parts =
        std::clamp<std::size_t>(1 + (kTasks - 1) / requests.size(), 1, kMostParts);
    for (std::vector<std::uint32_t>& part : parts_of(requests[k], parts)) {
      tasks.push_back(task_of(requests[k].at, part, true, requests[k].headings));
      asked.emplace_back(k, std::move(part));
    }
  }
  ASSIGN_OR_RETURN(const auto results, farm_.run(problem, tasks));
  std::vector<std::optional<std::vector<Pose>>> ends(requests.size());
  for (std::size_t k = 0; k < requests.size(); ++k) {
    if (!failures[k].empty()) continue;
    ends[k].emplace(requests[k].trials.empty() ? problem_.log.trials.size()
                                               : requests[k].trials.size());
  }
  for (std::size_t t = 0; t < tasks.size(); ++t) {
    const auto& [k, part] = asked[t];
    const v1::TaskResult& result = results[t];
    if (result.outcome() != v1::OK) {
      const bool broken =
          result.outcome() == v1::WORKER_FAILED || result.outcome() == v1::INVALID_REQUEST;
      if (broken) broken_ = result.message();
      if (failures[k].empty()) failures[k] = bad_point(problem_, requests[k].at, result);
      ends[k].reset();
    }
    if (!ends[k]) continue;
    const std::vector<std::uint32_t>& wanted = requests[k].trials;
    for (int i = 0; i < result.predict().predictions_size(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      std::size_t place = part.empty() ? at : part[at];  // no list: all of the log
      if (!wanted.empty()) {
        place = static_cast<std::size_t>(std::lower_bound(wanted.begin(), wanted.end(), part[at]) -
                                         wanted.begin());
      }
      (*ends[k])[place] = from_proto(result.predict().predictions(i).end());
    }
  }
  const auto failed = [](const std::string& why) { return !why.empty(); };
  const auto first = std::ranges::find_if(failures, failed);
  if (first != failures.end()) last_failure_ = std::move(*first);
  return ends;
}

Result<std::vector<std::vector<PathSample>>> Predictor::paths(
    const Overrides& at, const std::vector<CommandSpec>& commands, double interval_s) {
  std::vector<v1::Task> tasks;
  for (const CommandSpec& command : commands) {
    v1::TraceTask* trace = tasks.emplace_back().mutable_trace();
    fill(at, trace->mutable_point());
    *trace->mutable_command() = to_proto(command);
    trace->set_interval(interval_s);
  }
  ASSIGN_OR_RETURN(const auto results, farm_.run(hash_, tasks));
  std::vector<std::vector<PathSample>> paths;
  for (const v1::TaskResult& result : results) {
    if (result.outcome() != v1::OK) {
      last_failure_ = bad_point(problem_, at, result);
      return failed("a path");
    }
    std::vector<PathSample>& path = paths.emplace_back();
    for (const v1::TraceSample& s : result.trace().samples()) {
      path.push_back({s.t(), from_proto(s.pose())});
    }
  }
  return paths;
}

namespace infer {

Forward remembering(Forward forward, std::size_t most) {
  using Point = std::pair<Overrides, std::vector<std::uint32_t>>;
  using Ends = std::optional<std::vector<Pose>>;
  return [forward = std::move(forward), most, known = std::make_shared<std::map<Point, Ends>>()](
             const std::vector<PredictionRequest>& points) -> Result<std::vector<Ends>> {
    if (known->size() > most) known->clear();
    std::vector<PredictionRequest> unknown;
    for (const PredictionRequest& p : points) {
      if (known->try_emplace({p.at, p.trials}).second) unknown.push_back(p);
    }
    if (!unknown.empty()) {
      auto ends = forward(unknown);
      if (!ends) {
        known->clear();
        return ends.error();
      }
      for (std::size_t k = 0; k < unknown.size(); ++k) {
        (*known)[{unknown[k].at, unknown[k].trials}] = std::move((*ends)[k]);
      }
    }
    return mapped(points, [&](const PredictionRequest& p) { return known->at({p.at, p.trials}); });
  };
}

}  // namespace infer
}  // namespace gapfarm
