#include "master/ground/search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "master/ground/edge.h"
#include "master/ground/so_far.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostFaults = 2;
constexpr std::size_t kMostSteps = 3;
constexpr double kFaultShrinks = 1.4;  // residuals must, for a log to be called the wrong way round
constexpr double kFaultGain = 10;      // nats
constexpr double kChangeShrinks = 1.01;  // residuals must, for a change to be named
constexpr double kNotToldApart = 2;      // nats
// Nats to second order below which nothing is fitted: a third of what a name takes.
constexpr double kLeastPromise = kLeastGroundGain / 3;
constexpr int kFolds = 5;
// Standard errors by which what is named must be better on stretches that were left out: the first
// name has its gain to speak for it, further ones are to be rare.
constexpr double kLeastSureFirst = 1;
constexpr double kLeastSureNext = 2;
constexpr double kShareOfFirst = 0.5;
// Where to begin with another floor: changes of a grip's logarithm, and logarithms of its shape.
constexpr double kGripChanges[] = {0, -0.3, -0.7, -1.1, -1.6, -2.2, 0.5};
constexpr double kGripShapes[] = {0.7, 1.8};
constexpr double kNear_s = 1, kMiddle_s = 3, kFar_s = 10;  // either way of the file's delay

Eigen::VectorXd nominals(const std::vector<FitRow>& rows) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    values[static_cast<Eigen::Index>(i)] = rows[i].row.nominal;
  }
  return values;
}

std::vector<FitRow> held_rows(const GroundQuestion& question) {
  std::vector<FitRow> rows;
  for (const KinematicRow& row : question.rows) rows.push_back({row, false});
  return rows;
}

const GroundReference* reference_of(const GroundQuestion& question) {
  return question.reference ? &*question.reference : nullptr;
}

Eigen::Index row_index(const std::vector<FitRow>& rows, const std::string& name) {
  const auto found =
      std::find_if(rows.begin(), rows.end(), [&](const FitRow& r) { return r.row.name == name; });
  return found == rows.end() ? -1 : found - rows.begin();
}

// Values whose grip is the best of those far and near: past the limit of a tyre no slope leads
// back.
Eigen::VectorXd scan_grip(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values) {
  const Eigen::Index grip = row_index(rows, "grip"), shape = row_index(rows, "grip_shape");
  Eigen::VectorXd best = values;
  double most = fitter.hold(rows, values).objective;
  for (const double change : kGripChanges) {
    for (const double sharp : kGripShapes) {
      Eigen::VectorXd moved = values;
      moved[grip] += change;
      moved[shape] = sharp;
      const double objective = fitter.hold(rows, moved).objective;
      if (objective <= most) continue;
      most = objective;
      best = moved;
    }
  }
  return best;
}

// `slopes`: of the search's fit.
Offer try_one(const WindowFitter& fitter, const GroundSearch& search,
              const std::vector<Eigen::MatrixXd>& slopes, std::size_t index, WindowFit* fit) {
  const GroundHypothesis& hypothesis = search.catalogue[index];
  Eigen::VectorXd values = search.fit.values;
  const std::vector<FitRow> rows = with_freed(search.rows, hypothesis, &values);
  if (hypothesis.freed.size() == 1 && hypothesis.freed[0].name == "delay") {
    values = scan_delay(fitter, rows, values);
  }
  if (hypothesis.name == "friction") values = scan_grip(fitter, rows, values);
  if (hypothesis.name == kFloorEdge) values = scan_floor_edge(fitter, search.fit, rows, values);
  const bool afar =
      hypothesis.name == kFloorEdge || values.head(search.fit.values.size()) != search.fit.values;
  if (!afar) {
    const double promised = fitter.promise(search.fit, slopes, rows, values);
    if (promised < kLeastPromise) return {index, std::max(promised, 0.0), {}};
  }
  *fit = fitter.fit(rows, {}, values);
  Offer offer{index, fit->objective - search.fit.objective - hypothesis.price, {}};
  offer.values.resize(static_cast<Eigen::Index>(hypothesis.freed.size()));
  for (std::size_t k = 0; k < hypothesis.freed.size(); ++k) {
    offer.values[static_cast<Eigen::Index>(k)] =
        fit->values[row_index(rows, hypothesis.freed[k].name)];
    const bool less = offer.values[static_cast<Eigen::Index>(k)] < hypothesis.freed[k].nominal;
    if (hypothesis.only_more && less) offer.gain = 0;
  }
  if (hypothesis.name == kFloorEdge && !parts_windows(fitter, *fit)) offer.gain = 0;
  return offer;
}

bool chosen_before(const GroundSearch& search, std::size_t index) {
  // Rows of what is offered that are free already have nothing to tell.
  for (const KinematicRow& row : search.catalogue[index].freed) {
    const Eigen::Index at = row_index(search.rows, row.name);
    if (at < 0 || !search.rows[static_cast<std::size_t>(at)].free) return false;
  }
  return true;
}

// Takes the last step back unless it tells more of what was left out.
bool confirm_step(const WindowFitter& fitter, GroundSearch* search) {
  Eigen::VectorXd start;
  const std::vector<FitRow> rows = only_chosen(*search, search->steps.size(), &start);
  WindowFit with = fit_left_out(fitter, rows, start);
  const double sure = surely_better(fitter.windows(), with, search->chain.back());
  search->steps.back().sure = sure;
  if (sure < (search->steps.size() == 1 ? kLeastSureFirst : kLeastSureNext)) return false;
  search->chain.push_back(std::move(with));
  return true;
}

// Nats that the next name must tell.  What changed is modelled with a form that is wrong by some
// share, and the more it changed, the more is left over for others to explain.
double least_gain(const GroundSearch& search) {
  if (!search.reference) return kLeastGroundGain;
  // A long log is sure of the smallest of differences, which no model has right.
  const double stretches = static_cast<double>(search.windows.trials.size()) /
                           static_cast<double>(search.windows.horizons);
  double least = std::max(kLeastGroundGain, 3 * stretches * std::log(kChangeShrinks));
  if (!search.steps.empty()) least = std::max(least, kShareOfFirst * search.steps.front().gain);
  return least;
}

// The best of the catalogue, when it is worth its name.
bool take_step(const WindowFitter& fitter, const GroundWork& work, GroundSearch* search) {
  std::vector<std::pair<Offer, WindowFit>> tried;
  const std::vector<Eigen::MatrixXd> slopes = fitter.slopes(search->fit);
  for (std::size_t i = 0; i < search->catalogue.size(); ++i) {
    if (work.stopped && work.stopped()) return false;
    if (work.on_progress) {
      const std::size_t before = search->steps.size() * search->catalogue.size();
      work.on_progress(before + i, before + search->catalogue.size());
    }
    if (search->catalogue[i].put_right || chosen_before(*search, i)) continue;
    WindowFit fit;
    Offer offer = try_one(fitter, *search, slopes, i, &fit);
    tried.emplace_back(std::move(offer), std::move(fit));
    tell_of_offers(work, *search, tried);
  }
  std::stable_sort(tried.begin(), tried.end(),
                   [](const auto& a, const auto& b) { return a.first.gain > b.first.gain; });
  std::vector<Offer> offers;
  for (const auto& [offer, fit] : tried) offers.push_back(offer);
  search->offers.push_back(offers);
  if (tried.empty() || tried.front().first.gain < least_gain(*search)) return false;
  GroundStep step{offers[0].hypothesis, offers[0].gain, 0, {}};
  for (std::size_t k = 1; k < offers.size(); ++k) {
    if (offers[k].gain > offers[0].gain - kNotToldApart) {
      step.not_told_apart.push_back(offers[k].hypothesis);
    }
  }
  WindowFit before = std::exchange(search->fit, std::move(tried.front().second));
  search->steps.push_back(std::move(step));
  search->rows = search->fit.rows;
  if (confirm_step(fitter, search)) {
    tell_of_steps(work, *search);
    return true;
  }
  search->steps.pop_back();
  search->fit = std::move(before);
  search->rows = search->fit.rows;
  return false;
}

}  // namespace

double surely_better(const WindowSet& windows, const WindowFit& with, const WindowFit& without) {
  std::vector<double> gains(static_cast<std::size_t>(windows.blocks), 0.0);
  double sum = 0;
  for (std::size_t i = 0; i < with.nats.size(); ++i) {
    gains[static_cast<std::size_t>(windows.block[i])] += with.nats[i] - without.nats[i];
    sum += with.nats[i] - without.nats[i];
  }
  const double mean = sum / static_cast<double>(gains.size());
  double squares = 0;
  for (const double gain : gains) squares += (gain - mean) * (gain - mean);
  return squares > 0 ? sum / std::sqrt(squares) : 0;
}

Eigen::VectorXd scan_delay(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                           const Eigen::VectorXd& values) {
  const Eigen::Index delay = row_index(rows, "delay");
  Eigen::VectorXd best = values;
  double most = fitter.hold(rows, values).objective;
  for (double size = 0.1; size <= kFar_s; size += size < kNear_s     ? 0.1
                                                  : size < kMiddle_s ? 0.25
                                                                     : 0.5) {
    for (const double shift : {size, -size}) {
      Eigen::VectorXd moved = values;
      moved[delay] += shift;
      const double objective = fitter.hold(rows, moved).objective;
      if (objective <= most) continue;
      most = objective;
      best = moved;
    }
  }
  return best;
}

std::vector<FitRow> with_freed(std::vector<FitRow> rows, const GroundHypothesis& hypothesis,
                               Eigen::VectorXd* values) {
  for (const KinematicRow& freed : hypothesis.freed) {
    const Eigen::Index at = row_index(rows, freed.name);
    if (at >= 0) {
      rows[static_cast<std::size_t>(at)].free = true;
      continue;
    }
    rows.push_back({freed, true});
    values->conservativeResize(static_cast<Eigen::Index>(rows.size()));
    (*values)[values->size() - 1] = freed.nominal;
  }
  return rows;
}

std::optional<GroundFault> find_ground_fault(const GroundRobot& robot, const RunLog& log,
                                             const GroundQuestion& question,
                                             const WindowSettings& settings) {
  const std::vector<GroundHypothesis>& catalogue = question.catalogue;
  const GroundReference* reference = reference_of(question);
  const std::vector<FitRow> rows = held_rows(question);
  const auto as_logged = window_set(robot, log, settings);
  if (!as_logged) return std::nullopt;
  const double before =
      WindowFitter(robot, *as_logged, reference).hold(rows, nominals(rows)).objective;
  std::optional<GroundFault> best;
  for (std::size_t i = 0; i < catalogue.size(); ++i) {
    if (!catalogue[i].put_right) continue;
    GroundFault fault;
    fault.hypothesis = i;
    fault.log = log;
    catalogue[i].put_right(&fault.log);
    const auto windows = window_set(robot, fault.log, settings);
    if (!windows) continue;
    const double stretches =
        static_cast<double>(windows->trials.size()) / static_cast<double>(windows->horizons);
    // Densities are of what was logged, in its own unit.
    fault.objective =
        WindowFitter(robot, *windows, reference).hold(rows, nominals(rows)).objective +
        2 * stretches * std::log(catalogue[i].metres);
    fault.gain = fault.objective - before;
    fault.shrinks = std::exp(fault.gain / (3 * stretches));
    if (fault.gain < kFaultGain || fault.shrinks < kFaultShrinks) continue;
    if (!best || fault.gain > best->gain) best = std::move(fault);
  }
  return best;
}

namespace {

// Puts right what is the wrong way round, and fits what stands as it does.
Status search_faults(const GroundRobot& robot, const WindowSettings& settings,
                     const GroundQuestion& question, FitMemo* memo, GroundSearch* search) {
  while (search->faults.size() < kMostFaults) {
    auto fault = find_ground_fault(robot, search->log, question, settings);
    auto windows = window_set(robot, search->log, settings);
    if (!windows) return windows.error();
    search->windows = std::move(*windows);
    search->rows = held_rows(question);
    const WindowFitter fitter(robot, search->windows, reference_of(question), memo);
    search->fit = fitter.fit(search->rows);
    // Values a little off must not do as well.
    if (!fault || fault->objective < search->fit.objective) break;
    search->faults.push_back(fault->hypothesis);
    search->fault_gains.push_back(fault->gain);
    search->log = std::move(fault->log);
    auto mended = window_set(robot, search->log, settings);
    if (!mended) return mended.error();
    search->windows = std::move(*mended);
    const WindowFitter again(robot, search->windows, reference_of(question), memo);
    search->fit = again.fit(search->rows);
  }
  return {};
}

}  // namespace

Result<GroundSearch> search_ground(const GroundRobot& robot, const RunLog& log,
                                   const WindowSettings& settings, const GroundQuestion& question,
                                   const GroundWork& work) {
  const auto stage = [&](const char* name) {
    if (work.on_stage) work.on_stage(name);
  };
  const Error stopped{"stopped"};
  GroundSearch search;
  search.catalogue = question.catalogue;
  search.reference = question.reference;
  search.log = log;
  stage(kFaultStage);
  if (Status s = search_faults(robot, settings, question, work.memo, &search); !s) {
    return s.error();
  }
  tell_of_faults(work, search);
  const WindowFitter fitter(robot, search.windows, reference_of(question), work.memo);
  stage(kCatalogueStage);
  search.chain.push_back(fit_left_out(fitter, {}, {}));
  while (search.steps.size() < kMostSteps && take_step(fitter, work, &search)) {
  }
  if (work.stopped && work.stopped()) return stopped;
  tell_of_steps(work, search);
  stage(kRestStage);
  std::vector<FitRow> all = search.rows;
  for (FitRow& row : all) row.free = true;
  search.free_fit = fitter.fit(all, {}, search.fit.values);
  if (work.stopped && work.stopped()) return stopped;
  tell_of_rest(work, search);
  return search;
}

std::vector<FitRow> only_chosen(const GroundSearch& search, std::size_t places,
                                Eigen::VectorXd* values) {
  std::vector<FitRow> rows;
  values->resize(0);
  for (std::size_t k = 0; k < places; ++k) {
    rows = with_freed(std::move(rows), search.catalogue[search.steps[k].chosen], values);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Index j = row_index(search.rows, rows[i].row.name);
    if (j >= 0) (*values)[static_cast<Eigen::Index>(i)] = search.fit.values[j];
  }
  return rows;
}

WindowFit fit_left_out(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                       const Eigen::VectorXd& start) {
  const auto blocks = static_cast<std::size_t>(fitter.windows().blocks);
  WindowFit whole = fitter.hold(rows, start);
  for (int fold = 0; fold < kFolds; ++fold) {
    std::vector<char> out(blocks, 0);
    for (std::size_t b = 0; b < blocks; ++b) out[b] = static_cast<int>(b % kFolds) == fold;
    const WindowFit part =
        rows.empty() ? fitter.hold(rows, start, out) : fitter.fit(rows, out, start, 1);
    for (std::size_t i = 0; i < whole.nats.size(); ++i) {
      if (!out[static_cast<std::size_t>(fitter.windows().block[i])]) continue;
      whole.nats[i] = part.nats[i];
      whole.residuals[i] = part.residuals[i];
    }
  }
  return whole;
}

}  // namespace gapfarm
