#include "master/infer/compete.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "master/infer/settings.h"

namespace gapfarm::infer {
namespace {

struct Runner {
  std::size_t hypothesis = 0;
  Space space;
  Fit fit;
};

Eigen::VectorXd joined(const Eigen::VectorXd& base, const Eigen::VectorXd& own) {
  Eigen::VectorXd u(base.size() + own.size());
  u << base, own;
  return u;
}

// What the simulation is asked of: all observations, or some of them.
struct Scope {
  Forward forward;
  Observations observations;
  std::vector<std::uint32_t> index;  // of each in the whole
};

Scope thinned(const Forward& forward, const Observations& all, std::uint32_t every) {
  Scope some;
  for (std::uint32_t i = 0; i < all.size(); i += every) {
    some.index.push_back(i);
    some.observations.measured.push_back(all.measured[i]);
    some.observations.whitener.push_back(all.whitener[i]);
    some.observations.fold.push_back(all.fold[i]);
  }
  if (every == 1) {
    some.forward = forward;
    return some;
  }
  some.forward = [&forward, index = some.index](const std::vector<PredictionRequest>& points) {
    std::vector<PredictionRequest> whole = points;
    for (PredictionRequest& request : whole) {
      if (request.trials.empty())
        request.trials = index;
      else
        for (std::uint32_t& trial : request.trials) trial = index[trial];
    }
    return forward(whole);
  };
  return some;
}

// Those of the whole that are in the scope, as it counts them.
std::vector<std::uint32_t> within(const Scope& scope, const std::vector<std::uint32_t>& reach) {
  std::vector<std::uint32_t> some;
  for (std::uint32_t k = 0; k < scope.index.size(); ++k) {
    if (std::binary_search(reach.begin(), reach.end(), scope.index[k])) some.push_back(k);
  }
  return some;
}

using Anchor = Fit;  // of the base, with its slopes: runners start there

class Search {
 public:
  Search(const Scope& scope, const Space& base, const std::vector<Hypothesis>& hypotheses)
      : scope_(scope), base_(base), hypotheses_(hypotheses) {}

  Result<std::vector<Anchor>> anchors(const Eigen::VectorXd& base,
                                      const std::vector<Overrides>& others) const;
  Result<std::vector<Runner>> line_up(const std::vector<Anchor>& anchors, const Terms& terms) const;
  // At these points, without slopes.
  Result<std::vector<Runner>> from(const std::vector<Runner>& others) const;
  Status run(int steps, std::vector<Runner>* runners) const;

 private:
  Fitter fitter(const Space& space) const {
    return Fitter(scope_.forward, scope_.observations, space);
  }
  Result<std::vector<Fit>> at_starts(const Hypothesis& h, const Fitter& fitter,
                                     const Anchor& anchor) const;
  Result<Fit> from_neutral(const Hypothesis& h, const Fitter& fitter, const Anchor& anchor) const;

  const Scope& scope_;
  const Space& base_;
  const std::vector<Hypothesis>& hypotheses_;
};

Result<std::vector<Anchor>> Search::anchors(const Eigen::VectorXd& base,
                                            const std::vector<Overrides>& others) const {
  const Fitter fits = fitter(base_);
  std::vector<Eigen::VectorXd> points = {base};
  for (const Overrides& other : others) points.push_back(base_.from(other));
  auto at = fits.starts(points);
  if (!at) return at.error();
  std::vector<Anchor> anchors;
  for (Fit& fit : *at) {
    if (!std::isfinite(fit.score)) continue;
    if (Status s = fits.differentiate(&fit); !s) return s.error();
    anchors.push_back(std::move(fit));
  }
  return anchors;
}

// The best few; where a start reaches a part of the observations, the others are the anchor's.
Result<std::vector<Fit>> Search::at_starts(const Hypothesis& h, const Fitter& fitter,
                                           const Anchor& anchor) const {
  const Space own = base_.only(h.coordinates);
  std::vector<std::vector<std::uint32_t>> reach;
  std::vector<Eigen::VectorXd> points;
  for (const Start& start : h.starts) {
    std::vector<std::uint32_t> some = within(scope_, start.reach);
    if (some.empty() && !start.reach.empty()) continue;
    points.push_back(joined(anchor.u, own.from(start.at)));
    reach.push_back(std::move(some));
  }
  auto fits = fitter.starts(points, reach, anchor.z);
  if (!fits) return fits;
  std::erase_if(*fits, [](const Fit& fit) { return !std::isfinite(fit.score); });
  std::stable_sort(fits->begin(), fits->end(),
                   [](const Fit& a, const Fit& b) { return a.score > b.score; });
  if (fits->size() > kStartsKept) fits->resize(kStartsKept);
  for (Fit& fit : *fits) {
    // Of the base's parameters the anchor's slopes will do until a step shows that they do not.
    fit.slopes = anchor.slopes;
    fit.differences = anchor.differences;
    if (Status s = fitter.differentiate(&fit, anchor.u.size()); !s) return s.error();
    fit.fresh = false;
  }
  return fits;
}

Result<Fit> Search::from_neutral(const Hypothesis& h, const Fitter& fitter,
                                 const Anchor& anchor) const {
  Fit fit = anchor;
  fit.u = joined(anchor.u, base_.only(h.coordinates).from({}));
  fit.settled = false;
  fit.damping = 0;
  if (Status s = fitter.differentiate(&fit, anchor.u.size()); !s) return s.error();
  return fit;
}

const Anchor& best_of(const std::vector<Anchor>& anchors) {
  return *std::max_element(anchors.begin(), anchors.end(),
                           [](const Anchor& a, const Anchor& b) { return a.score < b.score; });
}

Result<std::vector<Runner>> Search::line_up(const std::vector<Anchor>& anchors,
                                            const Terms& terms) const {
  std::vector<Runner> runners;
  const bool everywhere = terms.effort == Effort::kGlobal;
  for (std::size_t k = 0; k < hypotheses_.size(); ++k) {
    const Hypothesis& h = hypotheses_[k];
    const Space space = base_.with(h.coordinates);
    const Fitter fits = fitter(space);
    for (const Anchor& anchor : anchors) {
      // Of many places only from where the base alone does best.
      const bool best = &anchor == &best_of(anchors);
      if (!h.starts.empty() && (best || h.starts.size() <= kFewStarts) &&
          (everywhere || !h.from_neutral)) {
        auto at = at_starts(h, fits, anchor);
        if (!at) return at.error();
        for (Fit& fit : *at) runners.push_back({k, space, std::move(fit)});
      }
      if (!h.from_neutral) continue;
      auto neutral = from_neutral(h, fits, anchor);
      if (!neutral) return neutral.error();
      if (everywhere || fits.promise(*neutral) > terms.least_gain) {
        runners.push_back({k, space, std::move(*neutral)});
      }
    }
  }
  return runners;
}

Result<std::vector<Runner>> Search::from(const std::vector<Runner>& others) const {
  std::vector<Runner> runners;
  for (const Runner& other : others) {
    auto fit = fitter(other.space).start(other.fit.u);
    if (!fit) return fit.error();
    if (!std::isfinite(fit->score)) continue;
    runners.push_back({other.hypothesis, other.space, std::move(*fit)});
  }
  return runners;
}

Status Search::run(int steps, std::vector<Runner>* runners) const {
  for (Runner& runner : *runners) {
    if (Status s = fitter(runner.space).improve(&runner.fit, steps); !s) return s;
  }
  std::stable_sort(runners->begin(), runners->end(),
                   [](const Runner& a, const Runner& b) { return a.fit.score > b.fit.score; });
  return {};
}

// The base alone begins once more where the best has it: what a hypothesis gains is not to be that
// its search found a better base.
Result<Model> refitted_base(const Forward& forward, const Observations& observations, Model base,
                            const Runner& best) {
  const Fitter fitter(forward, observations, base.space);
  auto fit = fitter.start(best.fit.u.head(base.fit.u.size()));
  if (!fit) return fit.error();
  if (Status s = fitter.improve(&*fit, kLongSearch); !s) return s.error();
  if (!(fit->score > base.fit.score)) return base;
  return model_of(forward, observations, base.space, std::move(*fit));
}

// The best runners, so many of each hypothesis; `runners` are sorted.
std::vector<Runner> best_of_each(std::vector<Runner> runners, std::size_t most,
                                 std::ptrdiff_t of_each) {
  std::vector<Runner> best;
  for (Runner& runner : runners) {
    const auto there = std::count_if(best.begin(), best.end(), [&](const Runner& b) {
      return b.hypothesis == runner.hypothesis;
    });
    if (there < of_each && best.size() < most) best.push_back(std::move(runner));
  }
  return best;
}

}  // namespace

PairedGain paired_gain(const std::vector<double>& with, const std::vector<double>& without) {
  PairedGain gain;
  const auto n = static_cast<double>(with.size());
  for (std::size_t i = 0; i < with.size(); ++i) gain.sum += with[i] - without[i];
  double squares = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    squares += std::pow(with[i] - without[i] - gain.sum / n, 2);
  }
  gain.se = std::sqrt(squares);
  return gain;
}

Result<Model> model_of(const Forward& forward, const Observations& observations, Space space,
                       Fit fit) {
  const Fitter fitter(forward, observations, space);
  if (!fit.fresh || fit.slopes.size() == 0) {
    if (Status s = fitter.differentiate(&fit); !s) return s.error();
  }
  std::vector<double> held_out = fitter.held_out(fit);
  return Model{std::move(space), std::move(fit), std::move(held_out)};
}

Result<Contest> compete(const Forward& forward, const Observations& observations, Model base,
                        const std::vector<Hypothesis>& hypotheses, const Terms& terms,
                        const OnStandings& on_standings) {
  const auto report = [&](const std::vector<Runner>& runners) {
    std::vector<Standing> standings;
    for (const Runner& r : best_of_each(runners, kLeaders, 1)) {
      standings.push_back({hypotheses[r.hypothesis].name, r.fit.score - base.fit.score});
    }
    if (on_standings) on_standings(standings);
  };
  const std::uint32_t every =
      terms.effort == Effort::kGlobal && observations.size() >= kManyObservations ? 2 : 1;
  const Scope some = thinned(forward, observations, every);
  const Scope all = thinned(forward, observations, 1);
  const Search first(some, base.space, hypotheses), whole(all, base.space, hypotheses);
  const auto anchors = first.anchors(base.fit.u, terms.bases);
  if (!anchors) return anchors.error();
  auto runners = first.line_up(*anchors, terms);
  if (!runners) return runners.error();
  const std::size_t most = terms.effort == Effort::kGlobal ? kLeaders : kFinalists;
  for (;;) {
    if (Status s = first.run(1, &*runners); !s) return s.error();
    const std::size_t many = runners->size();
    *runners = best_of_each(std::move(*runners), std::max(most, many / 2), many > 2 * most ? 2 : 1);
    if (runners->size() <= most) break;
  }
  auto best = every == 1 ? std::move(runners) : whole.from(*runners);
  if (!best) return best.error();
  if (Status s = whole.run(kMiddleSearch, &*best); !s) return s.error();
  report(*best);
  const double worth = base.fit.score + terms.least_gain;
  std::erase_if(*best, [&](const Runner& r) { return r.fit.score < worth; });
  std::vector<Runner> leaders = best_of_each(std::move(*best), kFinalists, 1);
  if (Status s = whole.run(kLongSearch, &leaders); !s) return s.error();
  report(leaders);
  if (leaders.empty()) return Contest{std::move(base), {}};
  auto refitted = refitted_base(forward, observations, std::move(base), leaders.front());
  if (!refitted) return refitted.error();
  Contest contest{std::move(*refitted), {}};
  for (const Runner& leader : leaders) {
    auto model = model_of(forward, observations, leader.space, leader.fit);
    if (!model) return model.error();
    const PairedGain gain = paired_gain(model->held_out, contest.base.held_out);
    contest.contenders.push_back({leader.hypothesis, std::move(*model), gain.sum, gain.se});
  }
  std::stable_sort(contest.contenders.begin(), contest.contenders.end(),
                   [](const Contender& a, const Contender& b) { return a.gain > b.gain; });
  return contest;
}

}  // namespace gapfarm::infer
