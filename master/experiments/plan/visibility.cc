#include "master/experiments/plan/visibility.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "common/random/stream.h"
#include "master/diagnose/subject.h"
#include "master/farm/planned_trials.h"
#include "master/infer/certificate.h"
#include "master/infer/predictor.h"

namespace gapfarm::plan {
namespace {

// log det(I + X'X) as rows are added to X.
class LogDeterminant {
 public:
  explicit LogDeterminant(Eigen::Index unknowns)
      : inverse_(Eigen::MatrixXd::Identity(unknowns, unknowns)) {}

  // What `rows` would add: log det(I + R M^-1 R').
  double gain(const Eigen::Ref<const Rows>& rows) const {
    const Eigen::LLT<Eigen::MatrixXd> lower(inner(rows));
    return 2 * lower.matrixLLT().diagonal().array().log().sum();
  }

  void add(const Eigen::Ref<const Rows>& rows) {
    const Eigen::MatrixXd right = rows * inverse_;
    inverse_ -= right.transpose() * inner(rows).llt().solve(right);
  }

 private:
  Eigen::MatrixXd inner(const Eigen::Ref<const Rows>& rows) const {
    return Eigen::MatrixXd::Identity(rows.rows(), rows.rows()) + rows * inverse_ * rows.transpose();
  }

  Eigen::MatrixXd inverse_;  // of I + X'X
};

constexpr double kPower = 0.9;
constexpr unsigned kDraws = 4;    // an effect: directions and places
constexpr int kMostHalvings = 4;  // where the robot cannot be simulated at the first strength

NoiseEstimate noise_of(const DiagnosisSubject& subject, const ParameterValues& values) {
  const auto value = [&](const NoiseRow& from) { return values[from.row] / from.unit; };
  NoiseEstimate noise;
  noise.drive_common = value(subject.drive_common);
  noise.drive_side = value(subject.drive_side);
  noise.pose.position_m = value(subject.pose_position);
  noise.pose.heading_rad = value(subject.pose_heading);
  return noise;
}

Overrides with_effect(const Study& study, const EffectDraw& draw, double strength) {
  Overrides at = study.base;
  const std::vector<double> values = effect_values(*study.table, draw, strength);
  for (std::size_t k = 0; k < values.size(); ++k) {
    at[study.table->effect_row(draw.effect) + k] = values[k];
  }
  return at;
}

// Simulates every shift at its strength; those that cannot be are tried at half of it.
Status simulate_shifts(Predictor& predictor, const Study& study, std::vector<Shift>* shifts) {
  std::vector<std::size_t> open = indices(shifts->size());
  for (int half = 0; half <= kMostHalvings && !open.empty(); ++half) {
    std::vector<PredictionRequest> requests;
    for (const std::size_t k : open) {
      requests.push_back({with_effect(study, (*shifts)[k].draw, (*shifts)[k].strength), {}});
    }
    ASSIGN_OR_RETURN(const auto ends, predictor.attempt(requests));
    std::vector<std::size_t> failed;
    for (std::size_t i = 0; i < open.size(); ++i) {
      Shift& shift = (*shifts)[open[i]];
      if (ends[i]) {
        shift.rows = study.whiten(differences(study.predicted_ends(), *ends[i]));
      } else {
        shift.strength /= 2;
        failed.push_back(open[i]);
      }
    }
    open = std::move(failed);
  }
  std::erase_if(*shifts, [](const Shift& shift) { return shift.rows.size() == 0; });
  return {};
}

// Distance of a draw's strongest parameter from neutral.
struct Deviation {
  std::size_t row = 0;
  double size = 0;
};

Deviation deviation(const ParameterTable& table, const EffectDraw& draw, double strength) {
  std::size_t strongest = 0;
  for (std::size_t k = 1; k < draw.towards.size(); ++k) {
    if (std::abs(draw.towards[k]) > std::abs(draw.towards[strongest])) strongest = k;
  }
  const std::size_t row = table.effect_row(draw.effect) + strongest;
  const double value = effect_values(table, draw, std::min(1.0, strength))[strongest];
  return {row, std::abs(value - table[row].nominal)};
}

std::map<std::size_t, std::vector<const Shift*>> by_effect(const Signals& signals) {
  std::map<std::size_t, std::vector<const Shift*>> found;
  for (const Shift& shift : signals.shifts) found[shift.draw.effect].push_back(&shift);
  return found;
}

double freedom_of(const Problem& problem, std::size_t effect) {
  return static_cast<double>(problem.table().effects()[effect].parameters.size());
}

// Twice the nats that an effect must gain to be named: the diagnosis's threshold and what as many
// parameters gain by luck.
double threshold_of(const Problem& problem, std::size_t effect) {
  return 2 * diagnosis_subject(problem)->least_gain + freedom_of(problem, effect);
}

void find_like(const ParameterTable& table, const Signals& signals,
               const std::vector<const Shift*>& own, Visibility* seen) {
  for (const auto& [other, shifts] : by_effect(signals)) {
    if (other == own.front()->draw.effect) continue;
    const double typical = median(mapped(own, [&](const Shift* a) {
      return max_of(shifts, [&](const Shift* b) {
        return std::abs(plan::likeness(a->rows, b->rows, signals.nuisances));
      });
    }));
    if (typical <= seen->likeness) continue;
    seen->likeness = typical;
    seen->like = table.effects()[other].name;
  }
}

constexpr int kSteps = 200;            // of Frank and Wolfe; each brings the bound nearer
constexpr double kCloseEnough = 1e-3;  // nats an unknown

// Of all unknowns' information M, what is left of the first ones' once the others are allowed for
// (Schur's complement), and the map whose congruence takes any other information to at least that.
struct Allowed {
  Eigen::MatrixXd S, L;
};

Allowed allowed_for(const Eigen::MatrixXd& M, Eigen::Index nuisances) {
  const Eigen::Index s = M.rows() - nuisances;
  Allowed a;
  a.L = Eigen::MatrixXd::Zero(s, M.rows());
  a.L.leftCols(s).setIdentity();
  if (nuisances > 0) {
    a.L.rightCols(nuisances) = -M.bottomRightCorner(nuisances, nuisances)
                                    .llt()
                                    .solve(M.bottomLeftCorner(nuisances, s))
                                    .transpose();
  }
  a.S = a.L * M * a.L.transpose();
  return a;
}

// Of the information M: its value, and the slope that bounds those of others.
struct Criterion {
  double value = 0;
  Eigen::MatrixXd slope;
};

double log_det(const Eigen::MatrixXd& S) {
  return 2 * S.llt().matrixLLT().diagonal().array().log().sum();
}

// Frank and Wolfe's steps: `criterion` of information M is a concave sum of `size` logarithms, and
// that of any other M* is at most its value and size log(|M*^1/2 slope|^2 / size).  That is linear
// in M*, so no M* of `times` experiments has more than `times` the best of them.
double best_over(const std::vector<Rows>& candidates, double times, double size,
                 const std::function<Criterion(const Eigen::MatrixXd&)>& criterion,
                 Eigen::MatrixXd M, double planned) {
  const Eigen::MatrixXd prior = Eigen::MatrixXd::Identity(M.rows(), M.cols());
  double bound = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kSteps; ++k) {
    const Criterion at = criterion(M);
    std::size_t best = 0;
    double most = -1;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const double gain = (candidates[c] * at.slope).squaredNorm();
      if (gain <= most) continue;
      most = gain;
      best = c;
    }
    const double ahead = at.value - planned;
    const double share = (at.slope.squaredNorm() + times * most) / size;
    bound = std::min(bound, ahead + size * std::log(share));
    if (bound - ahead < kCloseEnough * size) break;
    const double step = 2.0 / (k + 3);
    const Eigen::MatrixXd there = prior + times * candidates[best].transpose() * candidates[best];
    M = (1 - step) * M + step * there;
  }
  return std::exp(std::min(0.0, -bound / (2 * size)));
}

}  // namespace

Signals Signals::of(const std::vector<std::size_t>& trials) const {
  const auto pick = [&](const auto& rows, auto& into) {
    into.resize(static_cast<Eigen::Index>(3 * trials.size()), rows.cols());
    for (std::size_t i = 0; i < trials.size(); ++i) {
      into.middleRows(static_cast<Eigen::Index>(3 * i), 3) =
          rows.middleRows(static_cast<Eigen::Index>(3 * trials[i]), 3);
    }
  };
  Signals part;
  pick(nuisances, part.nuisances);
  for (const Shift& shift : shifts) {
    part.shifts.push_back({shift.draw, shift.strength, {}});
    pick(shift.rows, part.shifts.back().rows);
  }
  return part;
}

Result<Signals> signals(Farm& farm, const Problem& problem, const TrialLog& log,
                        const std::vector<std::size_t>& effects, std::uint64_t seed) {
  const std::shared_ptr<const DiagnosisSubject> keeps_subject = diagnosis_subject(problem);
  const DiagnosisSubject& subject = *keeps_subject;
  Problem planned = without_log(problem);
  planned.log = log;
  ASSIGN_OR_RETURN(auto study, subject.make_study(planned, problem.genes));
  Predictor predictor(farm, planned);
  RETURN_IF_ERROR(subject.tune(predictor, true, &study));
  study.use_noise(noise_of(subject, planned.values));
  ASSIGN_OR_RETURN(auto nuisances, subject.nuisances(predictor, study));
  Signals found;
  found.nuisances = std::move(nuisances);
  const Arena arena = arena_of(log, 0);
  for (const std::size_t effect : effects) {
    if (!planned.table().effects()[effect].moves_means()) continue;
    for (unsigned d = 0; d < kDraws; ++d) {
      Stream stream({seed, Purpose::kSimulation, 2, effect, d});
      found.shifts.push_back(
          {draw_effect(planned.table(), effect, arena, stream), kFirstStrength, {}});
    }
  }
  RETURN_IF_ERROR(simulate_shifts(predictor, study, &found.shifts));
  return found;
}

std::vector<Visibility> visibility(const Problem& problem, const Signals& signals) {
  const ParameterTable& table = problem.table();
  std::vector<Visibility> all;
  for (const auto& [effect, shifts] : by_effect(signals)) {
    const double wanted = infer::noncentrality_for(kPower, threshold_of(problem, effect),
                                                   freedom_of(problem, effect));
    std::vector<double> strengths, sizes;
    for (const Shift* shift : shifts) {
      const double now = information(shift->rows, signals.nuisances);
      strengths.push_back(now > 0 ? shift->strength * std::sqrt(wanted / now) : 1e6);
      sizes.push_back(deviation(table, shift->draw, strengths.back()).size);
    }
    Visibility seen;
    const Parameter& p = table[deviation(table, shifts.front()->draw, 1).row];
    seen.effect = table.effects()[effect].name;
    seen.parameter = p.key;
    seen.unit = p.unit;
    seen.strength = median(strengths);
    if (seen.strength <= 1) seen.size = median(sizes);
    find_like(table, signals, shifts, &seen);
    all.push_back(std::move(seen));
  }
  return all;
}

double mean_power(const Problem& problem, const Signals& signals,
                  const std::vector<Visibility>& at) {
  double sum = 0;
  std::size_t count = 0;
  for (const auto& [effect, shifts] : by_effect(signals)) {
    const std::string& name = problem.table().effects()[effect].name;
    const Visibility* wanted = find_by(at, name, &Visibility::effect);
    if (wanted == nullptr || wanted->strength > 1) continue;
    for (const Shift* shift : shifts) {
      const double times = wanted->strength / shift->strength;
      sum +=
          infer::chance_of_exceeding(threshold_of(problem, effect), freedom_of(problem, effect),
                                     times * times * information(shift->rows, signals.nuisances));
      ++count;
    }
  }
  return count == 0 ? 0 : sum / static_cast<double>(count);
}

std::vector<std::size_t> select(const std::vector<Rows>& candidates, Eigen::Index nuisances,
                                std::size_t wanted) {
  std::vector<std::size_t> chosen;
  if (candidates.empty()) return chosen;
  LogDeterminant all(candidates.front().cols()), allowed(nuisances);
  std::vector<bool> taken(candidates.size());
  while (chosen.size() < std::min(wanted, candidates.size())) {
    std::size_t best = candidates.size();
    double most = 0;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      if (taken[c]) continue;
      const double gain =
          all.gain(candidates[c]) - allowed.gain(candidates[c].rightCols(nuisances));
      if (best < candidates.size() && gain <= most) continue;
      best = c;
      most = gain;
    }
    taken[best] = true;
    chosen.push_back(best);
    all.add(candidates[best]);
    allowed.add(candidates[best].rightCols(nuisances));
  }
  return chosen;
}

double information(const Eigen::VectorXd& shift, const Eigen::MatrixXd& nuisances) {
  return std::max(0.0, infer::information(shift, nuisances)(0, 0));
}

double likeness(const Eigen::VectorXd& a, const Eigen::VectorXd& b,
                const Eigen::MatrixXd& nuisances) {
  const double lengths = information(a, nuisances) * information(b, nuisances);
  return lengths > 0
             ? std::clamp(a.dot(infer::beyond(b, nuisances).col(0)) / std::sqrt(lengths), -1.0, 1.0)
             : 0;
}

// How much better a plan could be at most.

// Schur's complement of any M* is at most L M* L' for the L of any M, so that its log det is at
// most that of M's plus s log(tr(S^-1 L M* L') / s): determinants of a trace are greatest where all
// directions are alike.  At the best M it is equality (Kiefer and Wolfowitz 1960).
double best_over_plan(const std::vector<Rows>& candidates, Eigen::Index nuisances,
                      const std::vector<std::size_t>& chosen) {
  if (chosen.empty()) return 1;
  const Eigen::Index unknowns = candidates.front().cols();
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(unknowns, unknowns);
  for (const std::size_t c : chosen) M += candidates[c].transpose() * candidates[c];
  const auto criterion = [&](const Eigen::MatrixXd& at) {
    const Allowed a = allowed_for(at, nuisances);
    const Eigen::MatrixXd slope = a.S.llt().matrixL().solve(a.L).transpose();
    return Criterion{log_det(a.S), slope};
  };
  return best_over(candidates, static_cast<double>(chosen.size()),
                   static_cast<double>(unknowns - nuisances), criterion, M, criterion(M).value);
}

// 1 / (M^-1)_ii is the least of u' M u over all u whose i-th is 1, so that of M* is at most u' M* u
// for the u of any M; and the mean of logarithms is at most the logarithm of the mean.
double best_over_drive(const std::vector<Rows>& rates, double seconds,
                       const std::vector<std::ptrdiff_t>& wanted,
                       const Eigen::VectorXd& variances) {
  if (rates.empty() || wanted.empty() || seconds <= 0) return 1;
  const Eigen::Index unknowns = variances.size();
  double planned = 0;
  for (const auto i : wanted) planned -= std::log(variances[i]);
  const auto criterion = [&](const Eigen::MatrixXd& M) {
    const Eigen::MatrixXd inverse = inverse_of_symmetric(M);
    Criterion at{0, Eigen::MatrixXd(unknowns, static_cast<Eigen::Index>(wanted.size()))};
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      const double variance = inverse(wanted[k], wanted[k]);
      at.value -= std::log(variance);
      at.slope.col(static_cast<Eigen::Index>(k)) = inverse.col(wanted[k]) / std::sqrt(variance);
    }
    return at;
  };
  const Eigen::MatrixXd start = variances.cwiseInverse().asDiagonal();
  return best_over(rates, seconds, static_cast<double>(wanted.size()), criterion, start, planned);
}

}  // namespace gapfarm::plan
