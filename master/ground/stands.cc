#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "master/ground/report/ground_text.h"
#include "master/ground/search.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// Sets those of the values that a fit has.
void take_values(const WindowFit& fit, const std::vector<FitRow>& rows, Eigen::VectorXd* values) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Index j = row_index(fit.rows, rows[i].row.name);
    if (j >= 0) (*values)[i] = fit.values[j];
  }
}

// What the search has where only these are named, in this order; `unnamed`: before the first.
GroundNames with_names(const WindowFitter& fitter, const GroundWork& work,
                       const GroundSearch& search, const GroundNames& unnamed,
                       const std::vector<GroundStep>& steps) {
  GroundNames again = unnamed;
  std::vector<std::size_t> hypotheses;
  for (GroundStep step : steps) {
    const GroundHypothesis& hypothesis = search.catalogue[step.chosen];
    hypotheses.push_back(step.chosen);
    Eigen::VectorXd values = again.fit.values;
    const std::vector<FitRow> rows = with_freed(again.fit.rows, hypothesis, &values);
    take_values(search.fit, rows, &values);
    WindowFit fit = fitter.fit(rows, {}, values);
    step.gain = gain_of(fitter, hypothesis, fit, again.fit);
    WindowFit predicted = held_out_with(fitter, search, hypotheses, fit);
    step.held_out = held_out_gain(search.windows, predicted, again.chain.back(), work.seed);
    again.chain.push_back(std::move(predicted));
    again.steps.push_back(std::move(step));
    again.fit = std::move(fit);
  }
  return again;
}

// A smooth correction of a prediction; sure where it closes more than is tolerated beyond that and
// beyond all that `values` explain: robots that nobody touched have a little of it.
std::optional<FreeResidual> correction(const WindowFitter& fitter, const GroundWork& work,
                                       const WindowFit& held_out, const WindowFit& values) {
  std::optional<FreeResidual> smooth = fit_free_residual(fitter, held_out);
  const auto closes = [&](const WindowFit& before) {
    const HeldOutGain gain = held_out_gain(fitter.windows(), smooth->held_out, before, work.seed);
    return gain.lo > kToleratedGap;
  };
  if (smooth) smooth->sure = closes(held_out) && closes(values);
  return smooth;
}

// Takes away names that do not stand, one after the other: `stands` says so of each, beside what
// the search has without it.
template <class Stands>
void drop_where_not(const WindowFitter& fitter, const GroundWork& work, const GroundNames& unnamed,
                    GroundSearch* search, Stands stands) {
  for (std::size_t k = 0; k < search->steps.size();) {
    std::vector<GroundStep> steps = search->steps;
    steps.erase(steps.begin() + static_cast<std::ptrdiff_t>(k));
    GroundNames others = with_names(fitter, work, *search, unnamed, steps);
    if (stands(search->steps[k], others)) {
      ++k;
      continue;
    }
    others.offers = search->offers;
    others.offers.erase(others.offers.begin() + static_cast<std::ptrdiff_t>(steps.empty() ? 1 : k));
    static_cast<GroundNames&>(*search) = std::move(others);
    k = 0;
  }
}

}  // namespace

double gain_of(const WindowFitter& fitter, const GroundHypothesis& hypothesis,
               const WindowFit& with, const WindowFit& without) {
  const double gain =
      hypothesis.gain ? hypothesis.gain(fitter, with, without) : with.objective - without.objective;
  const double more_values = static_cast<double>(hypothesis.freed.size()) - 1;
  return gain - (kPriceOfAValue * more_values + hypothesis.price);
}

std::vector<FitRow> with_freed(std::vector<FitRow> rows, const GroundHypothesis& hypothesis,
                               Eigen::VectorXd* values) {
  for (const KinematicRow& freed : hypothesis.freed) {
    const Eigen::Index at = row_index(rows, freed.name);
    if (at >= 0) {
      rows[at].free = true;
      continue;
    }
    rows.push_back({freed, true});
    values->conservativeResize(rows.size());
    (*values)[values->size() - 1] = freed.nominal;
  }
  return rows;
}

std::vector<FitRow> tuned_rows(const std::vector<FitRow>& rows) {
  return filtered(rows, [](const FitRow& row) { return row.row.tuned; });
}

double tolerances_off(const GroundHypothesis& hypothesis, const WindowFit& fit) {
  return max_of(hypothesis.freed, [&](const KinematicRow& row) {
    return std::abs(fit.values[row_index(fit.rows, row.name)] - row.nominal) / row.tolerance;
  });
}

bool shows_its_size(const WindowFitter& fitter, const GroundWork& work, const GroundSearch& search,
                    std::size_t index, const WindowFit& fit, const WindowFit& alone) {
  const GroundHypothesis& hypothesis = search.catalogue[index];
  const double kept = search.reference ? hypothesis.kept : 0;
  const auto shows = [&](const Estimate& size) { return size.lo > kept || size.hi < -kept; };
  if (hypothesis.describe) {
    NamedEffect effect;
    hypothesis.describe(fitter, fit, work.seed, &effect);
    return shows(effect.parameters.front());
  }
  const Eigen::MatrixX2d intervals = fitter.intervals(fit, work.seed);
  return std::ranges::any_of(hypothesis.freed, [&](const KinematicRow& row) {
    const Eigen::Index i = row_index(fit.rows, row.name);
    const double value = alone.values[row_index(alone.rows, row.name)];
    return shows({row.key, 0, std::min(intervals(i, 0), value) - row.nominal,
                  std::max(intervals(i, 1), value) - row.nominal, ""});
  });
}

WindowFit held_out_with(const WindowFitter& fitter, const GroundSearch& search,
                        const std::vector<std::size_t>& hypotheses, const WindowFit& fit) {
  std::vector<FitRow> rows = tuned_rows(fit.rows);
  Eigen::VectorXd start = nominals(rows);
  for (const std::size_t h : hypotheses) {
    rows = with_freed(std::move(rows), search.catalogue[h], &start);
  }
  take_values(fit, rows, &start);
  return fit_held_out(fitter, rows, fitter.fit(rows, {}, start).values);
}

StatedValues stated_values(const WindowFitter& fitter, const GroundSearch& search,
                           const std::vector<std::string>& unseen, std::uint64_t seed) {
  const WindowFit& fit = search.fit;
  StatedValues all{{}, fit.values, fitter.intervals(fit, seed)};
  std::vector<FitRow> rows;
  std::vector<Eigen::Index> places;
  for (Eigen::Index j = 0; j < fit.values.size(); ++j) {
    const FitRow& row = fit.rows[static_cast<std::size_t>(j)];
    const double had = row.row.nominal, off = fit.values[j] - had;
    // What fits move without its name predicts as well, but costs as many nats as a name.
    const bool known = search.unexplained < kUnexplained && !contains(unseen, row.row.name) &&
                       std::pow(off / row.row.tolerance, 2) / 2 > kLeastGroundGain &&
                       (all.intervals(j, 0) > had || all.intervals(j, 1) < had);
    // Against a reference every value is the two logs' own.
    all.in_file.push_back(row.free || known || search.reference.has_value());
    if (!all.in_file.back() && !row.row.tuned) continue;
    rows.push_back(row);
    places.push_back(j);
  }
  if (search.reference || search.windows.simulated) return all;
  const WindowFit alone =
      fitter.fit(rows, {}, vector_of(places, [&](Eigen::Index j) { return fit.values[j]; }));
  const Eigen::MatrixX2d intervals = fitter.intervals(alone, seed);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Eigen::Index j = places[k], at = static_cast<Eigen::Index>(k);
    all.values[j] = alone.values[at];
    all.intervals(j, 0) = std::min(all.intervals(j, 0), intervals(at, 0));
    all.intervals(j, 1) = std::max(all.intervals(j, 1), intervals(at, 1));
  }
  return all;
}

void drop_again(const WindowFitter& fitter, const GroundWork& work, const GroundNames& unnamed,
                GroundSearch* search) {
  const auto stands = [&](const GroundStep& step, const GroundNames& others) {
    const HeldOutGain gain =
        held_out_gain(search->windows, search->chain.back(), others.chain.back(), work.seed);
    // What is left alone once another went may gain nothing that is sure.
    return may_be_named(step.held_out) &&
           (others.steps.empty() ||
            (may_be_named(gain) && shows_its_size(fitter, work, *search, step.chosen, search->fit,
                                                  search->chain.back())));
  };
  drop_where_not(fitter, work, unnamed, search, stands);
}

void drop_stand_ins(const WindowFitter& fitter, const GroundWork& work, const GroundNames& unnamed,
                    GroundSearch* search) {
  if (search->reference) return;  // what both logs have is no change
  const WindowFit values = fit_held_out(fitter, all_free(search->fit.rows), search->fit.values);
  search->smooth = correction(fitter, work, search->chain.back(), values);
  if (!search->smooth || !search->smooth->sure) return;
  const auto gain = [&](const WindowFit& with, const WindowFit& without) {
    return held_out_gain(search->windows, with, without, work.seed);
  };
  const auto stands = [&](const GroundStep& step, const GroundNames& others) {
    auto without = correction(fitter, work, others.chain.back(), values);
    if (!without || !without->sure) return true;
    // Of what acts in the world a correction by place says the same in more numbers.
    if (without->of_world && search->catalogue[step.chosen].of_world) return true;
    const HeldOutGain alone = gain(search->chain.back(), others.chain.back());
    const HeldOutGain beside = gain(search->smooth->held_out, without->held_out);
    if (may_be_named(beside) && beside.mean >= kTraceShare * alone.mean) return true;
    search->stand_ins.push_back(step.chosen);
    search->smooth = std::move(without);
    return false;
  };
  drop_where_not(fitter, work, unnamed, search, stands);
}

}  // namespace gapfarm
