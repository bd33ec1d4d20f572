#include "master/ground/stands.h"

#include <algorithm>
#include <utility>

#include "master/ground/report/ground_text.h"

namespace gapfarm {
namespace {

// Sets those of the values that a fit has.
void take_values(const WindowFit& fit, const std::vector<FitRow>& rows, Eigen::VectorXd* values) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Index j = row_index(fit.rows, rows[i].row.name);
    if (j >= 0) (*values)[static_cast<Eigen::Index>(i)] = fit.values[j];
  }
}

}  // namespace

bool shows_its_size(const WindowFitter& fitter, const GroundWork& work, const GroundSearch& search,
                    std::size_t index, const WindowFit& fit) {
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
    return shows({row.key, 0, intervals(i, 0) - row.nominal, intervals(i, 1) - row.nominal, ""});
  });
}

WindowFit held_out_with(const WindowFitter& fitter, const GroundSearch& search,
                        const std::vector<std::size_t>& hypotheses, const WindowFit& fit) {
  std::vector<FitRow> rows;
  Eigen::VectorXd start;
  for (const std::size_t h : hypotheses) {
    rows = with_freed(std::move(rows), search.catalogue[h], &start);
  }
  take_values(fit, rows, &start);
  return fit_held_out(fitter, rows, start);
}

namespace {

// What the search has where only these are named, in this order; `unnamed`: before the first.
GroundNames with_names(const WindowFitter& fitter, const GroundWork& work,
                       const GroundSearch& search, const GroundNames& unnamed,
                       const std::vector<GroundStep>& steps) {
  GroundNames again = unnamed;
  again.moved = search.moved;
  std::vector<std::size_t> hypotheses;
  for (GroundStep step : steps) {
    const GroundHypothesis& hypothesis = search.catalogue[step.chosen];
    hypotheses.push_back(step.chosen);
    Eigen::VectorXd values = again.fit.values;
    const std::vector<FitRow> rows = with_freed(again.fit.rows, hypothesis, &values);
    take_values(search.fit, rows, &values);
    WindowFit fit = fitter.fit(rows, {}, values);
    const bool moved = again.moved && hypotheses.size() == steps.size();
    step.gain = gain_of(fitter, hypothesis, fit, again.fit);
    step.before =
        moved ? fit_held_out(fitter, again.fit.rows, again.fit.values) : again.chain.back();
    again.chain.push_back(moved ? fit_held_out(fitter, rows, fit.values)
                                : held_out_with(fitter, search, hypotheses, fit));
    step.held_out = held_out_gain(search.windows, again.chain.back(), step.before, work.seed);
    again.steps.push_back(std::move(step));
    again.fit = std::move(fit);
  }
  return again;
}

}  // namespace

void drop_again(const WindowFitter& fitter, const GroundWork& work, const GroundNames& unnamed,
                GroundSearch* search) {
  for (std::size_t k = 0; search->steps.size() > 1 && k < search->steps.size();) {
    const auto at = static_cast<std::ptrdiff_t>(k);
    std::vector<GroundStep> steps = search->steps;
    steps.erase(steps.begin() + at);
    GroundNames others = with_names(fitter, work, *search, unnamed, steps);
    const GroundStep& step = search->steps[k];
    const HeldOutGain gain =
        held_out_gain(search->windows, search->chain.back(), others.chain.back(), work.seed);
    if (may_be_named(gain) && may_be_named(step.held_out) &&
        shows_its_size(fitter, work, *search, step.chosen, search->fit)) {
      ++k;
      continue;
    }
    others.offers = search->offers;
    others.offers.erase(others.offers.begin() + at);
    static_cast<GroundNames&>(*search) = std::move(others);
    k = 0;
  }
}

}  // namespace gapfarm
