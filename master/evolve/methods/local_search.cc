#include "master/evolve/methods/local_search.h"

#include <algorithm>
#include <array>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "common/base/ranges.h"

namespace gapfarm {
namespace {

constexpr double kPrecision_share = 1e-7;
constexpr std::size_t kEvaluationsPerGene = 100;
constexpr std::array kAlgorithms = {nlopt::LN_NELDERMEAD, nlopt::LN_SBPLX, nlopt::LN_BOBYQA,
                                    nlopt::LN_COBYLA};

}  // namespace

// NLopt at work in a thread of its own.  It and its owner take turns.
class LocalSearch::Run {
 public:
  Run(nlopt::opt search, std::vector<double> start)
      : search_(std::move(search)), x_(std::move(start)) {
    search_.set_min_objective(ask, this);
    thread_ = std::thread([this] { optimise(); });
    std::unique_lock lock(mutex_);
    passed_.wait(lock, [&] { return !its_turn_; });
  }
  ~Run() {
    cancelled_ = true;
    if (!ended_) pass_turn(true);
    thread_.join();
  }

  std::size_t given() const { return given_; }
  bool ended() const { return ended_; }
  const std::vector<double>& point() const { return point_; }  // whose cost is to be given

  // REQUIRES: !ended().
  void give(double cost) {
    cost_ = cost;
    ++given_;
    pass_turn(true);
  }

 private:
  static double ask(const std::vector<double>& x, std::vector<double>&, void* data) {
    Run& run = *static_cast<Run*>(data);
    run.point_ = x;
    if (!run.cancelled_) run.pass_turn(false);
    if (run.cancelled_) throw nlopt::forced_stop();
    return run.cost_;
  }

  void optimise() {
    double least = 0;
    try {
      search_.optimize(x_, least);
    } catch (const std::exception&) {
      // Cancelled, limited by rounding, or NLopt's general failure: the simplex has collapsed, say.
    }
    const std::lock_guard lock(mutex_);
    ended_ = true;
    its_turn_ = false;
    passed_.notify_all();
  }

  void pass_turn(bool to_search) {
    std::unique_lock lock(mutex_);
    its_turn_ = to_search;
    passed_.notify_all();
    passed_.wait(lock, [&] { return its_turn_ != to_search; });
  }

  nlopt::opt search_;
  std::vector<double> x_, point_;
  double cost_ = 0;
  std::size_t given_ = 0;
  bool ended_ = false, cancelled_ = false;
  std::mutex mutex_;
  std::condition_variable passed_;
  bool its_turn_ = true;
  std::thread thread_;
};

LocalSearch::LocalSearch(const MethodSetup& setup, bool restarts)
    : setup_(setup), restarts_(restarts), start_(setup.start) {
  for (std::size_t gene = 0; gene < setup.space.size(); ++gene) {
    if (setup.space[gene].shape == GeneShape::kReal) moving_.push_back(gene);
  }
  if (moving_.empty()) {
    for (std::size_t gene = 0; gene < setup.space.size(); ++gene) moving_.push_back(gene);
  }
}

LocalSearch::~LocalSearch() = default;

nlopt::algorithm LocalSearch::algorithm() const {
  const nlopt::algorithm wanted = kAlgorithms[static_cast<std::size_t>(setup_.settings.local)];
  // BOBYQA's quadratic model needs two dimensions at least.
  return wanted == nlopt::LN_BOBYQA && moving_.size() < 2 ? nlopt::LN_SBPLX : wanted;
}

void LocalSearch::begin(const Genome& start, const Standing& standing) {
  start_ = start;
  best_ = start;
  costs_.clear();
  run_.reset();
  converged_ = false;
  const std::vector<Genome> first = next_points();
  add_cost(standing);
  best_cost_ = costs_.front();
  // BOBYQA begins no closer to a bound than its first step is long: this is the cost of another
  // point.
  for (std::size_t i = 0; i < start.size() && !first.empty(); ++i) {
    if (std::abs(first.front()[i] - start[i]) > kPrecision_share) costs_.clear();
  }
}

std::vector<Genome> LocalSearch::next_points() const {
  if (!run_) run_ = begin_run();
  while (run_->given() < costs_.size() && !run_->ended()) run_->give(costs_[run_->given()]);
  const bool first_model = algorithm() == nlopt::LN_BOBYQA && costs_.size() == 1;
  // Any costs do to see them all.
  const std::unique_ptr<Run> rehearsal = first_model ? begin_run() : nullptr;
  if (rehearsal && !rehearsal->ended()) rehearsal->give(0);
  Run& run = rehearsal ? *rehearsal : *run_;
  std::vector<Genome> points;
  while (points.size() < (first_model ? 2 * moving_.size() : 1) && !run.ended()) {
    points.push_back(start_);
    for (std::size_t i = 0; i < moving_.size(); ++i) points.back()[moving_[i]] = run.point()[i];
    if (first_model) run.give(0);
  }
  return points;
}

std::unique_ptr<LocalSearch::Run> LocalSearch::begin_run() const {
  nlopt::opt search(algorithm(), static_cast<unsigned>(moving_.size()));
  search.set_lower_bounds(0);
  search.set_upper_bounds(1);
  search.set_initial_step(setup_.settings.step);
  search.set_xtol_abs(kPrecision_share);
  const std::size_t limit = setup_.settings.local_evaluations > 0
                                ? setup_.settings.local_evaluations
                                : kEvaluationsPerGene * moving_.size();
  search.set_maxeval(static_cast<int>(limit));
  return std::make_unique<Run>(search, mapped(moving_, [&](auto gene) { return start_[gene]; }));
}

std::vector<Genome> LocalSearch::propose(const StreamOf& stream_of) const {
  if (start_.empty()) {
    Stream stream = stream_of(0);
    return {setup_.space.random(stream)};
  }
  if (best_.empty()) return {start_};
  if (converged_) return {best_};
  const std::vector<Genome> points = next_points();
  return points.empty() ? std::vector<Genome>{best_} : points;
}

void LocalSearch::add_cost(const Standing& standing) {
  if (standing.outcome == v1::OK) {
    costs_.push_back(standing.cost);
    return;
  }
  if (standing.outcome == v1::INFEASIBLE) {
    // Beyond any cost, yet in the order of the violations.
    costs_.push_back(1e30 * (1 + standing.cost / (1 + standing.cost)));
    return;
  }
  const double worst = max_of(costs_, std::identity());
  costs_.push_back(std::min(2 * worst + 1, 1e60));
}

void LocalSearch::learn(std::span<const Genome> proposed, std::span<const Standing> standings) {
  if (converged_) return;
  const bool first = start_.empty() || best_.empty();
  if (first) begin(proposed[0], standings[0]);
  for (std::size_t i = first ? 1 : 0; i < proposed.size(); ++i) {
    add_cost(standings[i]);
    if (costs_.back() >= best_cost_) continue;
    best_ = proposed[i];
    best_cost_ = costs_.back();
  }
  if (next_points().empty()) end_search();
}

void LocalSearch::settle() {
  if (!converged_ && costs_.size() > 2 * moving_.size()) end_search();
}

void LocalSearch::end_search() {
  ++searches_;
  if (!restarts_) {
    converged_ = true;
    return;
  }
  start_.clear();
  costs_.clear();
  run_.reset();
}

std::size_t LocalSearch::improvements(std::size_t span) const {
  std::size_t count = 0;
  double least = HUGE_VAL;
  for (std::size_t i = 0; i < costs_.size(); ++i) {
    if (costs_[i] < least && i + span >= costs_.size()) ++count;
    least = std::min(least, costs_[i]);
  }
  return count;
}

// As many as a quadratic model is made of.
std::vector<Standing> LocalSearch::compared() const {
  const std::size_t last = std::min(costs_.size(), 2 * moving_.size() + 1);
  return mapped(std::span(costs_).last(last), [](double cost) {
    return Standing{v1::OK, cost, 0, 1};
  });
}

std::vector<NamedNumber> LocalSearch::figures() const {
  return {{"searches", static_cast<double>(searches_)}};
}

void LocalSearch::save(v1::MethodState& message) const {
  v1::LocalSearchState& state = *message.mutable_local_search();
  SAVE_STATE(searches, converged, best_cost)
  state.mutable_start()->Add(start_.begin(), start_.end());
  state.mutable_best()->Add(best_.begin(), best_.end());
  state.mutable_costs()->Add(costs_.begin(), costs_.end());
}

Status LocalSearch::restore(const v1::MethodState& message) {
  const v1::LocalSearchState& state = message.local_search();
  const int n = static_cast<int>(setup_.space.size());
  const auto is_size = [&](int size) { return size == 0 || size == n; };
  if (!message.has_local_search() || !is_size(state.start_size()) || !is_size(state.best_size())) {
    return damaged_method_state("local search");
  }
  LOAD_STATE(searches, converged, best_cost)
  start_.assign(state.start().begin(), state.start().end());
  best_.assign(state.best().begin(), state.best().end());
  costs_.assign(state.costs().begin(), state.costs().end());
  return {};
}

GAPFARM_METHOD(LocalSearch)

}  // namespace gapfarm
