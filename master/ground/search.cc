#include "master/ground/search.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/report/ground_text.h"
#include "master/ground/tolerances.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// An offer, and how well it predicts what was not fitted: the file with what is named and this put
// right.
struct Candidate {
  Offer offer;
  WindowFit fit = {};
  WindowFit held_out = {};
  HeldOutGain held_out_gain = {};  // over what is named
  bool may_be_named = false;
  bool competes = false;  // and is no trace of the names before it

  double gain() const { return offer.gain; }
};

// `slopes`: of the search's fit.
Candidate try_one(const WindowFitter& fitter, const GroundSearch& search,
                  const std::vector<Eigen::MatrixXd>& slopes, std::size_t index) {
  const GroundHypothesis& hypothesis = search.catalogue[index];
  Eigen::VectorXd values = search.fit.values;
  const std::vector<FitRow> rows = with_freed(search.fit.rows, hypothesis, &values);
  const Eigen::VectorXd here = values;
  if (hypothesis.propose) values = hypothesis.propose(fitter, search.fit, rows, here);
  if (values == here) {
    const double promised = fitter.promise(search.fit, slopes, rows, values);
    if (promised < kLeastGroundPromise) return {{index, std::max(promised, 0.0), {}}};
  }
  const WindowFit fit = fitter.fit(rows, {}, values);
  return {{index, gain_of(fitter, hypothesis, fit, search.fit),
           vector_of(
               hypothesis.freed,
               [&](const KinematicRow& freed) { return fit.values[row_index(rows, freed.name)]; })},
          fit};
}

bool chosen_before(const GroundSearch& search, std::size_t index) {
  // Rows of what is offered that are free already have nothing to show.
  for (const KinematicRow& row : search.catalogue[index].freed) {
    const Eigen::Index at = row_index(search.fit.rows, row.name);
    if (at < 0 || !search.fit.rows[at].free) return false;
  }
  return true;
}

// Nats that the next name must gain.  What changed is modelled with a form that is wrong by some
// share, and the more it changed, the more is left over for others to explain.
double least_gain(const GroundSearch& search) {
  if (!search.reference) return kLeastGroundGain;
  // A long log is sure of the smallest of differences, which no model has right.
  const double stretches = search.windows.stretches();
  double least = std::max(kLeastChangeGain, 3 * stretches * std::log(kChangeShrinks));
  if (!search.steps.empty()) least = std::max(least, kTraceShare * search.steps.front().gain);
  return least;
}

void predict_held_out(const WindowFitter& fitter, const GroundWork& work,
                      const GroundSearch& search, Candidate* candidate) {
  std::vector<std::size_t> hypotheses = mapped(search.steps, &GroundStep::chosen);
  hypotheses.push_back(candidate->offer.hypothesis);
  candidate->held_out = held_out_with(fitter, search, hypotheses, candidate->fit);
  candidate->held_out_gain =
      held_out_gain(fitter.windows(), candidate->held_out, search.chain.back(), work.seed);
}

// What a candidate gains, held out, in the windows where it is no trace of the names before it.
HeldOutGain gain_beyond_traces(const WindowSet& windows, const GroundWork& work,
                               const GroundSearch& search, const Candidate& candidate) {
  const WindowFit& file = search.chain.front();
  const WindowFit& named = search.chain.back();
  const auto moved = [&](const WindowFit& from, const WindowFit& to, std::size_t i) {
    const Eigen::Vector3d& scale = named.scales[static_cast<std::size_t>(windows.horizon[i])];
    return (from.residuals[i] - to.residuals[i]).cwiseQuotient(scale).norm();
  };
  WindowFit counted = candidate.held_out;
  for (std::size_t i = 0; i < counted.nats.size(); ++i) {
    if (moved(named, candidate.held_out, i) < kTraceShare * moved(file, named, i)) {
      counted.nats[i] = named.nats[i];
    }
  }
  return held_out_gain(windows, counted, named, work.seed);
}

void keep_if_best(GroundSearch* search, WindowFit held_out, std::string what) {
  const bool first = search->best.nats.empty();
  if (!first && !(mean(held_out.nats) > mean(search->best.nats))) return;
  search->best = std::move(held_out);
  search->best_of_all = std::move(what);
}

void name_candidate(const WindowSet& windows, const GroundWork& work,
                    const std::vector<Candidate>& candidates, const Candidate& chosen,
                    GroundSearch* search) {
  GroundStep step{chosen.offer.hypothesis, chosen.offer.gain, chosen.held_out_gain, {}};
  const auto add = [&](std::size_t hypothesis) {
    auto& alike = step.not_distinguished;
    const bool there = contains(alike, hypothesis);
    if (hypothesis != step.chosen && !there) alike.push_back(hypothesis);
  };
  for (const Candidate& other : candidates) {
    const HeldOutGain over = held_out_gain(windows, chosen.held_out, other.held_out, work.seed);
    if (over.lo <= 0 && other.may_be_named) add(other.offer.hypothesis);
  }
  for (const Offer& offer : search->offers.back()) {
    if (offer.values.size() > 0 && offer.gain > chosen.offer.gain - kNotDistinguished &&
        offer.gain > kNotDistinguished) {
      add(offer.hypothesis);
    }
  }
  search->steps.push_back(std::move(step));
  search->fit = chosen.fit;
  search->chain.push_back(chosen.held_out);
}

bool frees_part_of(const GroundHypothesis& part, const GroundHypothesis& whole) {
  const auto is_in_whole = [&](const KinematicRow& row) {
    return contains(whole.freed, row.name, &KinematicRow::name);
  };
  return part.freed.size() < whole.freed.size() && std::ranges::all_of(part.freed, is_in_whole);
}

// A candidate with some of the values of another one that gains no more over it than a model leaves
// traces of is the simpler word for the same.
const Candidate& simplest_of(const std::vector<GroundHypothesis>& catalogue,
                             const std::vector<Candidate>& candidates, const Candidate& chosen) {
  const Candidate* simplest = &chosen;
  for (const Candidate& c : candidates) {
    const bool part =
        frees_part_of(catalogue[c.offer.hypothesis], catalogue[simplest->offer.hypothesis]);
    const bool alike = (1 + kTraceShare) * c.offer.gain >= chosen.offer.gain;
    if (part && alike && c.may_be_named) simplest = &c;
  }
  return *simplest;
}

// Of candidates that predict no worse than the chosen one with 95 % confidence, the one that gains
// clearly most where all is fitted.
const Candidate& likeliest_of(const WindowSet& windows, const GroundWork& work,
                              const std::vector<Candidate>& candidates, const Candidate& chosen) {
  const Candidate* likeliest = &chosen;
  for (const Candidate& c : candidates) {
    if (c.offer.gain < likeliest->offer.gain + kNotDistinguished) continue;
    if (!c.may_be_named) continue;
    const HeldOutGain over = held_out_gain(windows, chosen.held_out, c.held_out, work.seed);
    if (over.lo <= 0) likeliest = &c;
  }
  return *likeliest;
}

// A hypothesis of values that every fit moves has nothing to gain by being free; beside what is
// named by now, the other values as the file has them, it may explain most, or all but what is
// tolerated.
std::optional<Candidate> best_within_tolerances(const WindowFitter& fitter, const GroundWork& work,
                                                const GroundSearch& search) {
  const WindowFit& named = search.chain.back();
  const WindowFit moved = fit_held_out(fitter, search.fit.rows, search.fit.values);
  const auto gain = [&](const WindowFit& with, const WindowFit& without) {
    return held_out_gain(fitter.windows(), with, without, work.seed);
  };
  if (gain(moved, named).lo < kToleratedGap) return std::nullopt;
  std::vector<FitRow> rows_named = tuned_rows(search.fit.rows);
  Eigen::VectorXd values_named = nominals(rows_named);
  for (const GroundStep& step : search.steps) {
    rows_named = with_freed(std::move(rows_named), search.catalogue[step.chosen], &values_named);
  }
  const double as_it_stands = fitter.fit(rows_named, {}, values_named).objective;
  std::optional<Candidate> best;
  for (std::size_t i = 0; i < search.catalogue.size(); ++i) {
    const auto is_held = [&](const KinematicRow& row) {
      return row_index(search.fit.rows, row.name) >= 0;
    };
    const GroundHypothesis& hypothesis = search.catalogue[i];
    if (hypothesis.freed.empty() || !std::ranges::all_of(hypothesis.freed, is_held)) continue;
    if (chosen_before(search, i)) continue;
    Candidate c{{i, 0, {}}};
    Eigen::VectorXd values = values_named;
    const std::vector<FitRow> alone_rows = with_freed(rows_named, hypothesis, &values);
    const WindowFit alone = fitter.fit(alone_rows, {}, values);
    c.held_out = fit_held_out(fitter, alone.rows, alone.values);
    c.held_out_gain = gain(c.held_out, named);
    c.offer.gain = alone.objective - as_it_stands;
    const bool all = gain(moved, c.held_out).hi < kToleratedGap;
    // As much as a fault of the log has to close.
    if (c.held_out_gain.lo < (all ? kToleratedGap : 3 * std::log(kFaultShrinks))) continue;
    if (best) {
      const HeldOutGain over = gain(c.held_out, best->held_out);
      const bool longer =
          hypothesis.freed.size() > search.catalogue[best->offer.hypothesis].freed.size();
      if (!((longer ? over.lo : over.mean) > 0)) continue;
    }
    values = search.fit.values;
    const std::vector<FitRow> rows = with_freed(search.fit.rows, hypothesis, &values);
    c.fit = fitter.fit(rows, {}, values);
    c.may_be_named = shows_its_size(fitter, work, search, i, c.fit, c.held_out);
    if (c.may_be_named) best = std::move(c);
  }
  return best;
}

// The best of the catalogue, when it is worth its name.
bool take_step(const WindowFitter& fitter, const GroundWork& work, GroundSearch* search) {
  std::vector<Candidate> tried;
  const std::vector<Eigen::MatrixXd> slopes = fitter.slopes(search->fit);
  for (std::size_t i = 0; i < search->catalogue.size(); ++i) {
    if (search->catalogue[i].put_right || chosen_before(*search, i)) continue;
    if (work.stopped && work.stopped()) return false;
    if (work.on_progress) {
      const std::size_t before = search->steps.size() * search->catalogue.size();
      work.on_progress(before + i, before + search->catalogue.size());
    }
    tried.push_back(try_one(fitter, *search, slopes, i));
    emit_offers(work, *search, mapped(tried, &Candidate::offer));
  }
  std::ranges::stable_sort(tried, std::greater(), &Candidate::gain);
  search->offers.push_back(mapped(tried, &Candidate::offer));
  const double least = least_gain(*search);
  const double worth = std::min(least, kLeastGroundGain);
  while (!tried.empty() && (tried.back().gain() < worth || tried.size() > kLeaders)) {
    tried.pop_back();
  }
  // What a well-kept file is off by needs no name, beside the other values as they are or as they
  // move; what changed is compared with what is kept.
  const auto shown = [&](const Candidate& c) {
    const GroundHypothesis& h = search->catalogue[c.offer.hypothesis];
    const bool off = tolerances_off(h, c.fit) > 1 && tolerances_off(h, c.held_out) > 1;
    return (search->reference || h.describe || off) &&
           shows_its_size(fitter, work, *search, c.offer.hypothesis, c.fit, c.held_out);
  };
  const bool further = !search->steps.empty();
  for (Candidate& c : tried) {
    predict_held_out(fitter, work, *search, &c);
    // What a log is sure enough of to close more than is tolerated needs no more, but beside a
    // name: of that others have what its form leaves.
    const bool enough = c.gain() >= least || (!further && c.held_out_gain.lo > kToleratedGap);
    c.may_be_named = enough && may_be_named(c.held_out_gain) && shown(c);
    // What has a name needs no other one while what is left is tolerated.
    c.competes = c.may_be_named && (!further || c.held_out_gain.hi > kToleratedGap) &&
                 may_be_named(gain_beyond_traces(fitter.windows(), work, *search, c));
  }
  std::ranges::stable_sort(tried, std::greater(),
                           [](const Candidate& c) { return c.held_out_gain.mean; });
  // Held out, values that gain far less than others do with small moves of the rest do not win.
  double most = 0;
  for (const Candidate& c : tried) most = std::max(most, c.competes ? c.gain() : 0);
  const auto chosen = std::ranges::find_if(tried, [&](const Candidate& c) {
    return c.competes && (!search->reference || c.gain() >= kShareOfBest * most);
  });
  const bool none = chosen == tried.end();
  if (!search->reference) {
    const auto within = best_within_tolerances(fitter, work, *search);
    if (within && (none || within->held_out_gain.lo > chosen->held_out_gain.hi)) {
      name_candidate(fitter.windows(), work, tried, *within, search);
      emit_steps(work, *search);
      return true;
    }
  }
  if (none) {
    const auto best = std::ranges::find_if(tried, shown);
    if (best != tried.end()) {
      keep_if_best(search, std::move(best->held_out),
                   search->catalogue[best->offer.hypothesis].name);
    }
    return false;
  }
  const Candidate& likeliest = likeliest_of(fitter.windows(), work, tried, *chosen);
  name_candidate(fitter.windows(), work, tried, simplest_of(search->catalogue, tried, likeliest),
                 search);
  emit_steps(work, *search);
  return true;
}

// Whether a value that has no name moved by more than a robot changes from log to log, and than the
// reference leaves open.
bool moved_far(const WindowFitter& fitter, const WindowFit& fit) {
  const Eigen::MatrixXd covariance = inverse_of_symmetric(fitter.prior_precision(fit.rows));
  for (std::size_t k = 0; k < fit.rows.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double moved = std::abs(fit.values[i] - fit.rows[k].row.nominal);
    if (!fit.rows[k].free && moved > kFarTolerances * std::sqrt(covariance(i, i))) return true;
  }
  return false;
}

// What everything that was tried would still close.
void measure_rest(const WindowFitter& fitter, const GroundWork& work, GroundSearch* search) {
  const std::vector<FitRow> all = all_free(search->fit.rows);
  search->free_fit = fitter.fit(all, {}, search->fit.values);
  WindowFit moved = fit_held_out(fitter, search->fit.rows, search->fit.values);
  const WindowFit named = search->chain.back();
  const bool far = moved_far(fitter, search->fit);
  // They may move, and need not.
  const bool within = search->reference && !far && mean(moved.nats) > mean(named.nats);
  const WindowFit& before = within ? moved : named;
  WindowFit best = before;
  std::swap(best, search->best);
  std::string what = "what is named";
  std::swap(what, search->best_of_all);
  if (!best.nats.empty()) keep_if_best(search, std::move(best), std::move(what));
  keep_if_best(search, moved, far ? "moves of all values" : kSmallMoves);
  keep_if_best(search, fit_held_out(fitter, all, search->free_fit.values), "every value free");
  if (std::optional<FreeResidual>& smooth = search->smooth) {
    const std::string correction = "a correction by " + smooth->depends_on;
    keep_if_best(search, smooth->held_out, correction);
    if (!smooth->sure && search->best_of_all != correction) smooth.reset();
  }
  search->closable = held_out_gain(search->windows, search->best, before, work.seed);
}

}  // namespace

Result<GroundSearch> search_ground(const GroundRobot& robot, const RunLog& log,
                                   const GroundQuestion& question, const GroundWork& work) {
  const auto stage = [&](const char* name) {
    if (work.on_stage) work.on_stage(name);
  };
  const auto is_stopped = [&] { return work.stopped && work.stopped(); };
  const Error stopped{"stopped"};
  GroundSearch search;
  static_cast<GroundBasis&>(search) = question;
  search.log = log;
  stage(kFaultStage);
  RETURN_IF_ERROR(search_faults(robot, question, work, &search));
  emit_faults(work, search);
  const WindowFitter fitter(robot, search.windows, search.reference, work.memo);
  stage(kCatalogueStage);
  search.chain.push_back(held_out_with(fitter, search, {}, search.fit));
  const GroundNames unnamed = search;
  while (search.steps.size() < kMostNames && take_step(fitter, work, &search)) {
  }
  if (!is_stopped()) drop_again(fitter, work, unnamed, &search);
  const std::size_t stood = search.steps.size();
  if (!is_stopped()) drop_stand_ins(fitter, work, unnamed, &search);
  if (search.steps.size() != stood) drop_again(fitter, work, unnamed, &search);
  if (is_stopped()) return stopped;
  emit_steps(work, search);
  stage(kRestStage);
  measure_rest(fitter, work, &search);
  const auto is_far = [&](const GroundStep& step) {
    return tolerances_off(search.catalogue[step.chosen], search.fit) > kFarTolerances;
  };
  // What is tuned beside a value carries it far along for nothing.
  const bool far = !search.windows.simulated && std::ranges::any_of(search.steps, is_far);
  if (!search.steps.empty() && !search.reference && !far) {
    const HeldOutGain all =
        held_out_gain(search.windows, search.best, search.chain.front(), work.seed);
    if (all.hi < kToleratedGap) {
      // However sure names are of it, the file is as good as is tolerated.
      GroundNames none = unnamed;
      none.offers = {search.offers.front()};
      static_cast<GroundNames&>(search) = std::move(none);
      measure_rest(fitter, work, &search);
    }
  }
  search.unexplained = share_unexplained(fitter, search.best);
  if (search.unexplained >= kUnexplained && !question.catalogue.empty()) {
    // What fits a little better then is a name for nothing.
    GroundQuestion as_it_is = question;
    as_it_is.catalogue.clear();
    as_it_is.faults.clear();
    as_it_is.sensor.clear();
    return search_ground(robot, log, as_it_is, work);
  }
  if (is_stopped()) return stopped;
  emit_rest(work, search);
  return search;
}

}  // namespace gapfarm
