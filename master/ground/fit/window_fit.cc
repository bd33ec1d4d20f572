#include "master/ground/fit/window_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/score/kinematic.h"

namespace gapfarm {
namespace {

constexpr int kSteps = 6;                            // of Gauss and Newton a round
constexpr double kFaster = 0.02;                     // to find how ends move with speed
constexpr double kEnough = 1e-3;                     // nats a step
constexpr double kGaussian = 1.4826, kOfTail = 1.3;  // of a median deviation

constexpr double kLeastWindowScale = 1e-5;  // m, rad

// So many times the middle one.
double robust_scale(std::vector<double>* sizes, double times) {
  if (sizes->empty()) return kLeastWindowScale;
  const auto middle = sizes->begin() + static_cast<long>(sizes->size() / 2);
  std::nth_element(sizes->begin(), middle, sizes->end());
  return std::max(times * *middle, kLeastWindowScale);
}

}  // namespace

double window_nats(double residual, double scale) {
  static const double constant = std::lgamma((kWindowTail + 1) / 2) - std::lgamma(kWindowTail / 2) -
                                 0.5 * std::log(kWindowTail * std::acos(-1.0));
  const double z = residual / scale;
  return constant - std::log(scale) - (kWindowTail + 1) / 2 * std::log1p(z * z / kWindowTail);
}

void GroundReference::complete(Kinematics* at) const {
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (at->index(names[k]) < 0) at->add(names[k], values[static_cast<Eigen::Index>(k)]);
  }
}

Eigen::Index row_index(const std::vector<FitRow>& rows, std::string_view name) {
  const auto found =
      std::ranges::find(rows, name, [](const FitRow& r) -> std::string_view { return r.row.name; });
  return found == rows.end() ? -1 : found - rows.begin();
}

std::vector<FitRow> held_rows(const std::vector<KinematicRow>& rows) {
  return mapped(rows, [](const KinematicRow& row) { return FitRow{row}; });
}

Eigen::VectorXd nominals(const std::vector<FitRow>& rows) {
  return vector_of(rows, [](const FitRow& row) { return row.row.nominal; });
}

WindowFitter::WindowFitter(const GroundRobot& robot, const WindowSet& windows,
                           const std::optional<GroundReference>& reference, FitMemo* memo)
    : robot_(robot),
      windows_(windows),
      paths_(robot, windows.runs, windows.trials),
      reference_(reference),
      memo_(memo) {
  if (memo != nullptr) question_ = question_of(robot, windows, reference);
  if (is_throttled(robot)) {
    if (windows.by_speed) shape_by_speed();
  } else if (!windows.noise.empty()) {
    shapes_ = noise_shapes(windows.least_noise);
  }
}

void WindowFitter::shape_by_speed() {
  const std::vector<FitRow> rows = {{{"ahead", 1, 0.02, "ratio", "-"}, false}};
  const auto both = residuals(
      rows, {Eigen::VectorXd::Constant(1, 1.0), Eigen::VectorXd::Constant(1, 1 + kFaster)});
  const auto &here = both[0], &faster = both[1];
  const auto n = static_cast<std::size_t>(windows_.horizons);
  std::vector<Eigen::Vector3d> shifts(here.size());
  std::vector<std::vector<double>> shares(n), rests(3 * n);
  for (std::size_t i = 0; i < here.size(); ++i) {
    const auto h = static_cast<std::size_t>(windows_.horizon[i]);
    shifts[i] = (faster[i] - here[i]) / kFaster;
    const double share = shifts[i].dot(here[i]) / std::max(shifts[i].squaredNorm(), 1e-12);
    shares[h].push_back(std::abs(share));
    const Eigen::Vector3d rest = here[i] - share * shifts[i];
    for (std::size_t c = 0; c < 3; ++c) {
      rests[3 * h + c].push_back(std::abs(rest[static_cast<Eigen::Index>(c)]));
    }
  }
  std::vector<Eigen::Matrix3d> shapes(here.size());
  for (std::size_t i = 0; i < here.size(); ++i) {
    const auto h = static_cast<std::size_t>(windows_.horizon[i]);
    Eigen::Vector3d s;
    for (std::size_t c = 0; c < 3; ++c) {
      s[static_cast<Eigen::Index>(c)] = robust_scale(&rests[3 * h + c], kGaussian);
    }
    const Eigen::Vector3d d = robust_scale(&shares[h], kGaussian) * shifts[i].cwiseQuotient(s);
    // (1 + d d')^-1/2 in units of s.
    const double square = d.squaredNorm();
    Eigen::Matrix3d root = Eigen::Matrix3d::Identity();
    if (square > 0) root += (1 / std::sqrt(1 + square) - 1) / square * d * d.transpose();
    shapes[i] = s.asDiagonal() * root * s.cwiseInverse().asDiagonal();
  }
  shapes_ = std::move(shapes);
}

std::vector<Eigen::Vector3d> WindowFitter::raw_residuals(const WindowFit& fit) const {
  std::vector<Eigen::Vector3d> raw = fit.residuals;
  for (std::size_t i = 0; i < shapes_.size(); ++i) raw[i] = shapes_[i].inverse() * raw[i];
  return raw;
}

Kinematics WindowFitter::kinematics(const std::vector<FitRow>& rows,
                                    const Eigen::VectorXd& values) const {
  Kinematics at;
  at.values = values;
  for (const FitRow& row : rows) at.names.push_back(row.row.name);
  at.origin_m = origin_m();
  if (reference_) reference_->complete(&at);
  return at;
}

std::vector<std::vector<Eigen::Vector3d>> WindowFitter::residuals(
    const std::vector<FitRow>& rows, const std::vector<Eigen::VectorXd>& points) const {
  const auto at = mapped(points, [&](const auto& values) { return kinematics(rows, values); });
  const bool stays = points.size() == 1;  // slopes about it come next
  const auto by_robot = [&](const Kinematics& k) { return paths_.ends(k, stays); };
  const auto ends = windows_.simulated ? windows_.simulated(at) : mapped(at, by_robot);
  std::vector<std::vector<Eigen::Vector3d>> all;
  for (std::size_t k = 0; k < at.size(); ++k) all.push_back(residuals(at[k], ends[k]));
  return all;
}

std::vector<Eigen::Vector3d> WindowFitter::residuals(const Kinematics& at,
                                                     const std::vector<Pose>& ends) const {
  std::vector<Eigen::Vector3d> r;
  r.reserve(ends.size());
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Trial& trial = windows_.trials[i];
    const Sense sense = windows_.sense_of(i);
    if (sense == Sense::kGyro) {
      const double turned = windows_.turned_rad[i] / at.value_or(kGyroScale, 1);
      r.emplace_back(0, 0, wrap_angle(turned - ends[i].theta + trial.X_WS.theta));
      continue;
    }
    r.push_back(local_difference(ends[i], sense == Sense::kReturn ? trial.X_WS : trial.X_WE));
    if (!shapes_.empty()) r.back() = shapes_[i] * r.back();
  }
  take_biases_out(&r);
  return r;
}

// A gyro's bias lasts as long as a run, and is what makes its windows fit best.
void WindowFitter::take_biases_out(std::vector<Eigen::Vector3d>* r) const {
  if (windows_.turned_rad.empty()) return;
  std::map<std::pair<int, std::size_t>, std::array<double, 2>> sums;  // of a horizon and a run
  const auto key = [&](std::size_t i) {
    return std::pair(windows_.horizon[i], windows_.run_of[i]);
  };
  for (std::size_t i = 0; i < r->size(); ++i) {
    if (windows_.sense_of(i) != Sense::kGyro) continue;
    const double T = *windows_.trials[i].duration_s;
    sums[key(i)][0] += T * (*r)[i][2];
    sums[key(i)][1] += T * T;
  }
  for (std::size_t i = 0; i < r->size(); ++i) {
    if (windows_.sense_of(i) != Sense::kGyro) continue;
    const auto& [with, without] = sums[key(i)];
    (*r)[i][2] -= with / without * *windows_.trials[i].duration_s;
  }
}

std::vector<double> WindowFitter::uses(const std::vector<char>& held_out) const {
  std::vector<double> use(windows_.trials.size());
  for (std::size_t i = 0; i < use.size(); ++i) {
    const bool out = !held_out.empty() && held_out[static_cast<std::size_t>(windows_.block[i])];
    // Windows of several horizons cover the same stretch.
    const bool once = windows_.sense_of(i) == Sense::kReturn;
    use[i] = out ? 0 : once ? 1 : 1.0 / windows_.lengths;
  }
  return use;
}

// Scales of Student's density, by its iteration.
void WindowFitter::rescale(WindowFit* fit, const std::vector<double>& use) const {
  const auto n = static_cast<std::size_t>(windows_.horizons);
  if (fit->scales.empty()) {
    std::vector<std::vector<double>> sizes(3 * n);
    for (std::size_t i = 0; i < use.size(); ++i) {
      for (std::size_t c = 0; c < 3 && use[i] > 0; ++c) {
        const auto h = static_cast<std::size_t>(windows_.horizon[i]);
        sizes[3 * h + c].push_back(std::abs(fit->residuals[i][static_cast<Eigen::Index>(c)]));
      }
    }
    fit->scales.resize(n);
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      fit->scales[k / 3][static_cast<Eigen::Index>(k % 3)] = robust_scale(&sizes[k], kOfTail);
    }
  }
  for (int round = 0; round < 20; ++round) {
    std::vector<Eigen::Vector3d> sums(n, Eigen::Vector3d::Zero());
    std::vector<double> counts(n, 0.0);
    for (std::size_t i = 0; i < use.size(); ++i) {
      const auto h = static_cast<std::size_t>(windows_.horizon[i]);
      counts[h] += use[i];
      for (Eigen::Index c = 0; c < 3; ++c) {
        const double r = fit->residuals[i][c];
        const double s = fit->scales[h][c];
        sums[h][c] += use[i] * window_weight(r, s) * s * s * r * r;
      }
    }
    for (std::size_t h = 0; h < n; ++h) {
      if (counts[h] == 0) continue;
      for (Eigen::Index c = 0; c < 3; ++c) {
        fit->scales[h][c] = std::max(std::sqrt(sums[h][c] / counts[h]), kLeastWindowScale);
      }
    }
  }
  // A return is as sure as it is said to be, and as what the way to it adds up: one alone has no
  // scatter.
  for (std::size_t k = 0; k < windows_.returns.size(); ++k) {
    const Return& back = windows_.returns[k];
    const Eigen::Vector3d squares = fit->scales.front().cwiseAbs2();
    fit->scales[n - windows_.returns.size() + k] =
        (back.variance + (back.of_way * squares).cwiseMin(back.of_slip)).cwiseSqrt();
  }
}

double WindowFitter::score(WindowFit* fit, const std::vector<double>& use) const {
  fit->nats.assign(use.size(), 0.0);
  fit->objective = prior(*fit);
  for (std::size_t i = 0; i < use.size(); ++i) {
    const Eigen::Vector3d& s = fit->scales[static_cast<std::size_t>(windows_.horizon[i])];
    for (Eigen::Index c = 0; c < 3; ++c) {
      fit->nats[i] += window_nats(fit->residuals[i][c], s[c]);
    }
    fit->objective += use[i] * fit->nats[i];
  }
  return fit->objective;
}

void WindowFitter::add_slopes(const WindowFit& fit, Eigen::Index first,
                              std::vector<Eigen::MatrixXd>* J) const {
  std::vector<double> steps;
  std::vector<Eigen::VectorXd> points;
  for (Eigen::Index k = first; k < fit.values.size(); ++k) {
    const KinematicRow& row = fit.rows[static_cast<std::size_t>(k)].row;
    steps.push_back(row.step * row.tolerance);
    points.emplace_back(fit.values)[k] += steps.back();
  }
  const auto moved = residuals(fit.rows, points);
  for (std::size_t j = 0; j < moved.size(); ++j) {
    for (std::size_t i = 0; i < J->size(); ++i) {
      (*J)[i].col(first + static_cast<Eigen::Index>(j)) =
          (moved[j][i] - fit.residuals[i]) / steps[j];
    }
  }
}

std::vector<Eigen::MatrixXd> WindowFitter::slopes(const WindowFit& fit) const {
  std::vector<Eigen::MatrixXd> J(fit.residuals.size(), Eigen::MatrixXd(3, fit.values.size()));
  add_slopes(fit, 0, &J);
  return J;
}

std::vector<WindowFitter::Equations> WindowFitter::equations_of(
    const WindowFit& fit, const std::vector<Eigen::MatrixXd>& J, const std::vector<double>& use,
    const std::vector<int>& part, const std::vector<Eigen::Vector3d>& curvature) const {
  const Eigen::Index n = fit.values.size();
  std::vector<Equations> all(static_cast<std::size_t>(1 + std::ranges::max(part)),
                             {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  for (std::size_t i = 0; i < use.size(); ++i) {
    if (use[i] == 0) continue;
    const auto h = static_cast<std::size_t>(windows_.horizon[i]);
    auto& [H, g] = all[static_cast<std::size_t>(part[i])];
    for (Eigen::Index c = 0; c < 3; ++c) {
      const Eigen::RowVectorXd slope = J[i].row(c);
      const double r = fit.residuals[i][c], w = use[i] * window_weight(r, fit.scales[h][c]);
      H += w * curvature[h][c] * slope.transpose() * slope;
      g += w * slope.transpose() * r;
    }
  }
  return all;
}

WindowFitter::Equations WindowFitter::normal_equations(const WindowFit& fit,
                                                       const std::vector<Eigen::MatrixXd>& J,
                                                       const std::vector<double>& use) const {
  const std::vector<Eigen::Vector3d> as_weighted(fit.scales.size(), Eigen::Vector3d::Ones());
  Equations equations =
      equations_of(fit, J, use, std::vector<int>(use.size(), 0), as_weighted).front();
  const Eigen::MatrixXd P = prior_precision(fit.rows);
  equations.H += P;
  equations.g += P * (fit.values - nominals(fit.rows));
  return equations;
}

double WindowFitter::promise(const WindowFit& fit, const std::vector<Eigen::MatrixXd>& fit_slopes,
                             const std::vector<FitRow>& rows, const Eigen::VectorXd& values) const {
  WindowFit moved = fit;
  moved.rows = rows;
  moved.values = values;
  std::vector<Eigen::MatrixXd> J(fit_slopes.size(), Eigen::MatrixXd(3, values.size()));
  for (std::size_t i = 0; i < J.size(); ++i) J[i].leftCols(fit.values.size()) = fit_slopes[i];
  add_slopes(moved, fit.values.size(), &J);
  const auto [H, g] = normal_equations(moved, J, uses({}));
  return prior(moved) - prior(fit) + g.dot(solve_symmetric(H, g)) / 2;
}

namespace {

// Values after a step of Gauss and Newton; what would fall below where it has a meaning stays
// there.
Eigen::VectorXd stepped(const WindowFit& fit, const Eigen::MatrixXd& H, const Eigen::VectorXd& g) {
  Eigen::VectorXd least(g.size());
  for (Eigen::Index k = 0; k < g.size(); ++k) {
    least[k] = least_value(fit.rows[static_cast<std::size_t>(k)].row) - fit.values[k];
  }
  return fit.values + bounded_minimum(H, -g, least, Eigen::VectorXd::Constant(g.size(), INFINITY));
}

}  // namespace

bool WindowFitter::step(WindowFit* fit, const std::vector<Eigen::MatrixXd>& J,
                        const std::vector<double>& use, double* damping) const {
  const auto [H, g] = normal_equations(*fit, J, use);
  for (int attempt = 0; attempt < 5; ++attempt) {
    Eigen::MatrixXd damped = H;
    damped.diagonal() *= 1 + *damping;
    WindowFit next = *fit;
    next.values = stepped(*fit, damped, g);
    if (next.values.allFinite()) {
      next.residuals = std::move(residuals(next.rows, {next.values}).front());
      if (score(&next, use) > fit->objective) {
        const double gained = next.objective - fit->objective;
        *fit = std::move(next);
        *damping = std::max(*damping / 10, 1e-6);
        return gained > kEnough;
      }
    }
    *damping = std::max(*damping, 1e-3) * 10;
  }
  return false;
}

WindowFit WindowFitter::hold(const std::vector<FitRow>& rows, const Eigen::VectorXd& values,
                             const std::vector<char>& held_out) const {
  return standing(rows, {values, {}}, uses(held_out));
}

WindowFit WindowFitter::judge(WindowFit fit, const std::vector<Eigen::Vector3d>& raw,
                              const std::vector<char>& held_out) const {
  return shaped(std::move(fit), raw, shapes_, uses(held_out));
}

Eigen::Matrix3d WindowFitter::whitener(const WindowFit& fit, std::size_t window) const {
  const Eigen::Vector3d& s = fit.scales[static_cast<std::size_t>(windows_.horizon[window])];
  const Eigen::Matrix3d scaled = s.cwiseInverse().asDiagonal();
  return shapes_.empty() ? scaled : Eigen::Matrix3d(scaled * shapes_[window]);
}

WindowFit WindowFitter::fit(const std::vector<FitRow>& rows, const std::vector<char>& held_out,
                            const Eigen::VectorXd& values, int rounds) const {
  const Eigen::VectorXd start =
      values.size() == static_cast<Eigen::Index>(rows.size()) ? values : nominals(rows);
  const std::string key = memo_ != nullptr ? key_of(rows, held_out, start, rounds) : "";
  const std::vector<double> use = uses(held_out);
  if (const auto kept = memo_ != nullptr ? memo_->find(key) : std::nullopt) {
    return standing(rows, *kept, use);
  }
  WindowFit fit = standing(rows, {start, {}}, use);
  for (int round = 0; round < rounds && !rows.empty(); ++round) {
    const double before = fit.objective;
    double damping = 1e-3;
    const std::vector<Eigen::MatrixXd> J = slopes(fit);  // what costs: one a round
    for (int k = 0; k < kSteps && step(&fit, J, use, &damping); ++k) {
    }
    rescale(&fit, use);
    score(&fit, use);
    if (fit.objective - before < 0.01) break;
  }
  if (memo_ != nullptr) memo_->keep(key, {fit.values, fit.scales});
  return fit;
}

WindowFit WindowFitter::standing(const std::vector<FitRow>& rows, const KeptFit& kept,
                                 const std::vector<double>& use) const {
  WindowFit fit{rows, kept.values, kept.scales, residuals(rows, {kept.values}).front(), {}};
  if (kept.scales.empty()) rescale(&fit, use);
  score(&fit, use);
  return fit;
}

}  // namespace gapfarm
