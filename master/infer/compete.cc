#include "master/infer/compete.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "master/infer/climb.h"

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

// The same with every second one alone.
Observations half_of(Observations some) {
  some.weight.resize(some.size(), 1);
  for (std::uint32_t i = 0; i < some.size(); ++i) {
    if (i % 2 == 0) some.asked.push_back(i);
    if (i % 2 != 0) some.weight[i] = 0;
  }
  return some;
}

// Those that are asked for.
std::vector<std::uint32_t> asked_of(const Observations& all, std::vector<std::uint32_t> some) {
  std::erase_if(some, [&](std::uint32_t i) {
    return !all.asked.empty() && !std::ranges::binary_search(all.asked, i);
  });
  return some;
}

using Anchor = Fit;  // of the base, with its slopes: runners start there

class Search {
 public:
  Search(const Forward& forward, const Observations& observations, const Space& base,
         const std::vector<Hypothesis>& hypotheses)
      : forward_(forward), observations_(observations), base_(base), hypotheses_(hypotheses) {}

  Result<std::vector<Anchor>> anchors(const Eigen::VectorXd& base,
                                      const std::vector<Overrides>& others) const;
  Result<std::vector<Runner>> line_up(const std::vector<Anchor>& anchors, const Terms& terms) const;
  // At these points, without slopes.
  Result<std::vector<Runner>> from(const std::vector<Runner>& others) const;
  Status run(int steps, std::vector<Runner>* runners) const;
  // Those that gained less than a part of what they promised beyond `score`, without slopes.
  Status search_blindly(double score, std::vector<Runner>* runners) const;

 private:
  Fitter fitter(const Space& space) const { return Fitter(forward_, observations_, space); }
  Result<std::optional<Runner>> best_start(std::size_t hypothesis, const Anchor& anchor) const;
  Result<Fit> from_neutral(const Hypothesis& h, const Fitter& fitter, const Anchor& anchor) const;
  Status search_blindly(Runner* runner) const;

  const Forward& forward_;
  const Observations& observations_;
  const Space& base_;
  const std::vector<Hypothesis>& hypotheses_;
};

Result<std::vector<Anchor>> Search::anchors(const Eigen::VectorXd& base,
                                            const std::vector<Overrides>& others) const {
  const Fitter fits = fitter(base_);
  std::vector<Eigen::VectorXd> points = {base};
  for (const Overrides& other : others) points.push_back(base_.from(other));
  ASSIGN_OR_RETURN(auto at, fits.starts(points, std::vector<Space>(points.size(), base_)));
  std::vector<Anchor> anchors;
  for (Fit& fit : at) {
    if (!std::isfinite(fit.score)) continue;
    if (Status s = fits.differentiate(&fit); !s) return s.error();
    anchors.push_back(std::move(fit));
  }
  return anchors;
}

// Where a start reaches a part of the observations, the others are the anchor's.
Result<std::optional<Runner>> Search::best_start(std::size_t hypothesis,
                                                 const Anchor& anchor) const {
  const Hypothesis& h = hypotheses_[hypothesis];
  const Space own = base_.only(h.coordinates), space = base_.with(h.coordinates);
  std::vector<std::vector<std::uint32_t>> reach;
  std::vector<Eigen::VectorXd> points;
  std::vector<Space> spaces;
  for (const Start& start : h.starts) {
    std::vector<std::uint32_t> some = asked_of(observations_, start.reach);
    if (some.empty() && !start.reach.empty()) continue;
    points.push_back(joined(anchor.u, own.from(start.at)));
    spaces.push_back(space.holding(start.at));
    reach.push_back(std::move(some));
  }
  ASSIGN_OR_RETURN(auto fits, fitter(space).starts(points, spaces, reach, anchor.z));
  const auto best = std::ranges::max_element(
      fits, {}, [](const Fit& fit) { return std::isfinite(fit.score) ? fit.score : -INFINITY; });
  if (best == fits.end() || !std::isfinite(best->score)) return std::optional<Runner>();
  Runner runner{hypothesis, spaces[static_cast<std::size_t>(best - fits.begin())],
                std::move(*best)};
  // Of the base's parameters the anchor's slopes will do until a step shows that they do not.
  runner.fit.slopes = anchor.slopes;
  runner.fit.differences = anchor.differences;
  RETURN_IF_ERROR(fitter(runner.space).differentiate(&runner.fit, anchor.u.size()));
  runner.fit.fresh = false;
  return std::optional<Runner>(std::move(runner));
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
  return *std::ranges::max_element(anchors, {}, &Anchor::score);
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
        ASSIGN_OR_RETURN(auto at, best_start(k, anchor));
        if (at) runners.push_back(std::move(*at));
      }
      if (!h.from_neutral) continue;
      ASSIGN_OR_RETURN(auto neutral, from_neutral(h, fits, anchor));
      if (everywhere || fits.promise(neutral) > terms.least_gain) {
        runners.push_back({k, space, std::move(neutral)});
      }
    }
  }
  return runners;
}

Result<std::vector<Runner>> Search::from(const std::vector<Runner>& others) const {
  std::vector<Runner> runners;
  for (const Runner& other : others) {
    ASSIGN_OR_RETURN(auto fit, fitter(other.space).start(other.fit.u));
    if (!std::isfinite(fit.score)) continue;
    runners.push_back({other.hypothesis, other.space, std::move(fit)});
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

Status Search::search_blindly(Runner* runner) const {
  const Hypothesis& h = hypotheses_[runner->hypothesis];
  const Fitter fits = fitter(runner->space);
  const Eigen::VectorXd base = runner->fit.u.head(base_.dimensions());
  const Eigen::VectorXd own = runner->fit.u.tail(runner->fit.u.size() - base.size());
  ASSIGN_OR_RETURN(const Fit without, fitter(base_).start(base));
  if (!std::isfinite(without.score)) return {};
  Status predicted;
  const auto score = [&](const std::vector<double>& x) {
    const Eigen::VectorXd u =
        joined(base, Eigen::VectorXd::Map(x.data(), static_cast<Eigen::Index>(x.size())));
    const auto touched = asked_of(observations_, h.touched(runner->space.values(u)));
    if (touched.empty() || !predicted) return without.score;
    const auto fit = fits.starts({u}, {runner->space}, {touched}, without.z);
    if (!fit) predicted = fit.error();
    return fit && std::isfinite(fit->front().score) ? fit->front().score : -1e300;
  };
  const auto listed = [&](const Eigen::VectorXd& bounds) {
    return std::vector<double>(bounds.begin(), bounds.end());
  };
  const Eigen::VectorXd far = Eigen::VectorXd::Constant(own.size(), kLongestStep);
  std::vector<double> best = listed(own);
  climb(score,
        {.subplex = true,
         .lower = listed(runner->space.lower().tail(own.size()).cwiseMax(own - far)),
         .upper = listed(runner->space.upper().tail(own.size()).cwiseMin(own + far)),
         .step = std::vector<double>(best.size(), kBlindStep),
         .tolerance = kSettledGain / 5,
         .evaluations = kBlindSearch * static_cast<int>(own.size())},
        &best);
  if (!predicted) return predicted;
  ASSIGN_OR_RETURN(auto fit,
                   fits.start(joined(base, Eigen::VectorXd::Map(best.data(), own.size()))));
  if (fit.score > runner->fit.score) runner->fit = std::move(fit);
  return {};
}

Status Search::search_blindly(double score, std::vector<Runner>* runners) const {
  for (Runner& runner : *runners) {
    const Hypothesis& h = hypotheses_[runner.hypothesis];
    if (!h.touched || kMostTrust * (runner.fit.score - score) > h.promised) continue;
    if (Status s = search_blindly(&runner); !s) return s;
  }
  return {};
}

// The base alone begins once more where the best has it: what a hypothesis gains is not to be that
// its search found a better base.
Result<Model> refitted_base(const Forward& forward, const Observations& observations, Model base,
                            const Runner& best) {
  const Fitter fitter(forward, observations, base.space);
  ASSIGN_OR_RETURN(auto fit, fitter.start(best.fit.u.head(base.fit.u.size())));
  if (Status s = fitter.improve(&fit, kLongSearch); !s) return s.error();
  if (!(fit.score > base.fit.score)) return base;
  return model_of(forward, observations, base.space, std::move(fit));
}

// The best runners, so many of each hypothesis; `runners` are sorted.
std::vector<Runner> best_of_each(std::vector<Runner> runners, std::size_t most,
                                 std::ptrdiff_t of_each) {
  std::vector<Runner> best;
  for (Runner& runner : runners) {
    const auto there = std::ranges::count(best, runner.hypothesis, &Runner::hypothesis);
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

PairedGain gain_over(const Model& with, const Model& without, Eigen::Index common) {
  PairedGain gain = paired_gain(with.held_out, without.held_out);
  const auto price = [&](const Model& m) { return m.space.price(m.fit.u, common); };
  gain.sum += price(without) - price(with);
  return gain;
}

Result<Model> model_of(const Forward& forward, const Observations& observations, Space space,
                       Fit fit) {
  if (!std::isfinite(fit.score)) {
    return Error{"the model to start from cannot be simulated", ErrorCode::kSimulation};
  }
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
  const bool half = terms.effort == Effort::kGlobal && observations.size() >= kManyObservations;
  const Observations some = half ? half_of(observations) : observations;
  const Search first(forward, some, base.space, hypotheses);
  const Search whole(forward, observations, base.space, hypotheses);
  ASSIGN_OR_RETURN(const auto anchors, first.anchors(base.fit.u, terms.bases));
  auto runners = first.line_up(anchors, terms);
  if (!runners) return runners.error();
  const std::size_t most = terms.effort == Effort::kGlobal ? kLeaders : kFinalists;
  for (;;) {
    if (Status s = first.run(1, &*runners); !s) return s.error();
    const std::size_t many = runners->size();
    *runners = best_of_each(std::move(*runners), std::max(most, many / 2), many > 2 * most ? 2 : 1);
    if (runners->size() <= most) break;
  }
  ASSIGN_OR_RETURN(auto best, half ? whole.from(*runners) : std::move(runners));
  if (Status s = whole.run(kMiddleSearch, &best); !s) return s.error();
  if (Status s = whole.search_blindly(base.fit.score, &best); !s) return s.error();
  report(best);
  const double worth = base.fit.score + terms.least_gain;
  std::erase_if(best, [&](const Runner& r) { return r.fit.score < worth; });
  std::vector<Runner> leaders = best_of_each(std::move(best), kFinalists, 1);
  if (Status s = whole.run(kLongSearch, &leaders); !s) return s.error();
  report(leaders);
  if (leaders.empty()) return Contest{std::move(base), {}};
  ASSIGN_OR_RETURN(auto refitted,
                   refitted_base(forward, observations, std::move(base), leaders.front()));
  Contest contest{std::move(refitted), {}};
  for (const Runner& leader : leaders) {
    ASSIGN_OR_RETURN(auto model, model_of(forward, observations, leader.space, leader.fit));
    const Eigen::Index before = contest.base.fit.u.size();
    PairedGain gain = gain_over(model, contest.base, before);
    // No more than in sample, less what a parameter gains by luck.
    const double luck = 0.5 * static_cast<double>(model.fit.u.size() - before);
    gain.sum = std::min(gain.sum, model.fit.score - contest.base.fit.score - luck) -
               hypotheses[leader.hypothesis].luck;
    contest.contenders.push_back({leader.hypothesis, std::move(model), gain.sum, gain.se});
  }
  std::ranges::stable_sort(contest.contenders, std::ranges::greater{}, &Contender::gain);
  // Nothing distinguishes those within what is no progress of a fit.
  const auto equal = std::partition_point(
      contest.contenders.begin(), contest.contenders.end(),
      [&](const Contender& c) { return c.gain > contest.contenders.front().gain - kSettledGain; });
  std::stable_sort(contest.contenders.begin(), equal, [](const Contender& a, const Contender& b) {
    return a.hypothesis < b.hypothesis;
  });
  return contest;
}

}  // namespace gapfarm::infer
