#include "master/diagnose/fit/free_commands.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <tuple>

#include "common/base/ranges.h"
#include "master/diagnose/fit/slopes.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kPathTrust = 1e-3;  // of the duties' word on the way, beside the ends'

// A command seen along and across: both sides together, and against each other.
struct Duties {
  double drive = 0;  // mean of the sides, [-1, 1]
  double turn = 0;   // half the right's more than the left, [-1, 1]
  double duration_s = 0;

  double level() const { return std::abs(drive) + std::abs(turn); }  // of the faster side
  double bend() const { return level() > 0 ? std::abs(turn) / level() : 0; }
};

Duties duties_of(const Study& study, std::size_t trial) {
  const CommandSpec& c = study.cells[study.trials[trial].cell].command;
  return {(c.left + c.right) / 2, (c.right - c.left) / 2, c.duration_s};
}

// Factors of a squared-exponential covariance over (level, bend), one column each, by pivoted
// Cholesky until a hundredth of the variance is left.
Eigen::MatrixXd smooth_factors(const std::vector<Duties>& duties, double length) {
  const auto n = static_cast<Eigen::Index>(duties.size());
  const auto kernel = [&](Eigen::Index i, Eigen::Index j) {
    const Duties& a = duties[static_cast<std::size_t>(i)];
    const Duties& b = duties[static_cast<std::size_t>(j)];
    const double away = std::hypot(a.level() - b.level(), a.bend() - b.bend()) / length;
    return std::exp(-away * away / 2);
  };
  constexpr double kLeft = 0.01;
  Eigen::VectorXd left = Eigen::VectorXd::Ones(n);
  Eigen::MatrixXd factors(n, 0);
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::Index pivot = 0;
    if (left.maxCoeff(&pivot) < kLeft) break;
    Eigen::VectorXd column(n);
    for (Eigen::Index i = 0; i < n; ++i) column[i] = kernel(i, pivot);
    if (k > 0) column -= factors * factors.row(pivot).transpose();
    column /= std::sqrt(left[pivot]);
    left -= column.cwiseAbs2();
    factors.conservativeResize(Eigen::NoChange, k + 1);
    factors.col(k) = column;
  }
  return factors;
}

class ColumnMaker {
 public:
  explicit ColumnMaker(const Study& study) : study_(study) {
    for (std::size_t i = 0; i < study.size(); ++i) {
      duties_.push_back(duties_of(study, i));
      carried_.push_back(carried_to_end(study, i));
    }
  }

  const std::vector<Duties>& duties() const { return duties_; }
  std::vector<Eigen::VectorXd> take() { return std::move(columns_); }

  using Size = std::function<double(std::size_t trial, const Duties& duties)>;
  using Carry = std::function<Eigen::Matrix3d(const CarriedToEnd& carried)>;

  // A disturbance of one component, `size` large, carried to the end; once for each factor.
  void add(const Carry& carry, int component, const Size& size, const Eigen::MatrixXd& factors) {
    std::vector<Eigen::Vector3d> whole(study_.size()), values(study_.size());
    for (std::size_t i = 0; i < whole.size(); ++i) {
      whole[i] = carry(carried_[i]).col(component) * size(i, duties_[i]);
    }
    for (Eigen::Index f = 0; f < factors.cols(); ++f) {
      for (std::size_t i = 0; i < whole.size(); ++i) {
        values[i] = factors(static_cast<Eigen::Index>(i), f) * whole[i];
      }
      columns_.push_back(study_.whiten(values));
    }
  }

 private:
  const Study& study_;
  std::vector<Duties> duties_;
  std::vector<CarriedToEnd> carried_;
  std::vector<Eigen::VectorXd> columns_;
};

Eigen::Matrix3d at_end(const CarriedToEnd& /*carried*/) { return Eigen::Matrix3d::Identity(); }
Eigen::Matrix3d at_start(const CarriedToEnd& carried) { return carried.start; }
Eigen::Matrix3d under_way(const CarriedToEnd& carried) { return carried.rate; }

struct Misfit {
  MotionKind kind;
  int component;   // 0 x, 1 y, 2 heading
  double fixed;    // m or rad
  double growing;  // per second at full level
};

constexpr Misfit kMisfits[] = {
    {MotionKind::kStraight, 0, 0.0002, 0.0003}, {MotionKind::kTurn, 2, 0.002, 0.005},
    {MotionKind::kWide, 0, 0.0005, 0.0025},     {MotionKind::kWide, 1, 0.0005, 0.0025},
    {MotionKind::kWide, 2, 0.003, 0.008},
};

double misfit_size(const Misfit& misfit, double path, double speed_m_s) {
  return (misfit.fixed + misfit.growing * path) * speed_m_s / kMeasuredSpeed_m_s;
}

// A misfit of one kind of drive at one level and duration.
void add_misfits(const Study& study, std::vector<Eigen::VectorXd>* columns) {
  std::set<std::tuple<MotionKind, double, double>> conditions;
  for (const Cell& c : study.cells) {
    conditions.insert({c.kind, std::round(c.level * 100) / 100, c.command.duration_s});
  }
  for (const auto& [kind, level, duration_s] : conditions) {
    for (const Misfit& misfit : kMisfits) {
      if (misfit.kind != kind) continue;
      std::vector<Eigen::Vector3d> values(study.size(), Eigen::Vector3d::Zero());
      for (std::size_t i = 0; i < study.size(); ++i) {
        const Cell& c = study.cells[study.trials[i].cell];
        const bool here = c.kind == kind && std::abs(c.level - level) < 0.006 &&
                          c.command.duration_s == duration_s;
        if (!here) continue;
        const bool mirrors = misfit.component != 0 || kind == MotionKind::kStraight;
        values[i][misfit.component] = mirrors ? c.mirror : 1;
      }
      columns->push_back(misfit_size(misfit, level * duration_s, study.speed_m_s) *
                         study.whiten(values));
    }
  }
}

}  // namespace

bool commands_are_free(std::span<const Cell> cells) {
  std::size_t trials = 0, few = 0;
  for (const Cell& cell : cells) {
    trials += cell.trials;
    if (cell.trials < kFewInCell) few += cell.trials;
  }
  return static_cast<double>(few) > kFreeShare * static_cast<double>(trials);
}

Twist motion_of(const Study& study, std::size_t trial) {
  constexpr double kPi = std::numbers::pi;
  const ResidualTrial& t = study.trials[trial];
  const Pose X_SE = between(t.X_WS, t.X_WP);
  const double turns = std::round(((t.left + t.right)[2] - X_SE.theta) / (2 * kPi));
  if (turns == 0) return log(X_SE);
  const double theta = X_SE.theta + 2 * kPi * turns;
  Eigen::Matrix2d v;
  v << std::sin(theta), std::cos(theta) - 1, 1 - std::cos(theta), std::sin(theta);
  v /= theta;
  const Duties duties = duties_of(study, trial);
  const Eigen::Vector2d commanded(study.speed_m_s * duties.drive * duties.duration_s, 0);
  const Eigen::Matrix2d normal = v.transpose() * v + kPathTrust * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d motion =
      normal.ldlt().solve(v.transpose() * Eigen::Vector2d(X_SE.x, X_SE.y) + kPathTrust * commanded);
  return {motion.x(), motion.y(), theta};
}

CarriedToEnd carried_to_end(const Study& study, std::size_t trial) {
  const ResidualTrial& t = study.trials[trial];
  return {end_slopes(motion_of(study, trial)), carry(between(t.X_WS, t.X_WP))};
}

// Sizes: those of nuisance.cc's cells, spread over the commands between.  How a tread turns at a
// slight difference of the sides depends on the contact model most of all.
std::vector<Eigen::VectorXd> smooth_misfits(const Study& study) {
  constexpr double kLength = 0.35, kSmootherLength = 1;
  ColumnMaker maker(study);
  const Eigen::MatrixXd factors = smooth_factors(maker.duties(), kLength);
  const Eigen::MatrixXd smoother = smooth_factors(maker.duties(), kSmootherLength);
  const double speed = study.speed_m_s;
  maker.add(
      under_way, 0,
      [&](std::size_t, const Duties& d) {
        return speed * d.duration_s * d.drive * (0.001 + 0.012 * d.bend());
      },
      factors);
  maker.add(
      under_way, 1,
      [&](std::size_t, const Duties& d) {
        const double both = d.level() > 0 ? d.drive * d.turn / d.level() : 0;
        return speed * d.duration_s * 0.04 * both;
      },
      factors);
  maker.add(
      under_way, 2,
      [&](std::size_t i, const Duties& d) {
        const double straightness = 1 - d.bend();
        return motion_of(study, i)[2] * (0.003 + 0.03 * straightness * straightness);
      },
      factors);
  for (const auto& carry : {at_start, at_end}) {
    const double scale = speed / kMeasuredSpeed_m_s;
    const auto ahead = [&](std::size_t, const Duties& d) { return 0.0015 * scale * d.drive; };
    const auto aside = [&](std::size_t, const Duties& d) {
      return 0.006 * scale * d.drive * d.turn;
    };
    const auto turned = [&](std::size_t, const Duties& d) { return 0.008 * scale * d.turn; };
    maker.add(carry, 0, ahead, smoother);
    maker.add(carry, 1, aside, smoother);
    maker.add(carry, 2, turned, smoother);
  }
  return maker.take();
}

CovariateBlock free_command_block(const Study& study) {
  ColumnMaker maker(study);
  const Eigen::MatrixXd once = Eigen::MatrixXd::Ones(static_cast<Eigen::Index>(study.size()), 1);
  using Shape = double (*)(const Duties& d);
  const Shape shapes[] = {
      [](const Duties& d) { return d.drive; },
      [](const Duties& d) { return d.turn; },
      [](const Duties& d) { return std::abs(d.drive); },
      [](const Duties& d) { return std::abs(d.turn); },
      [](const Duties& d) { return d.drive * std::abs(d.drive); },
      [](const Duties& d) { return d.turn * std::abs(d.turn); },
      [](const Duties& d) { return d.drive * std::abs(d.turn); },
      [](const Duties& d) { return d.turn * std::abs(d.drive); },
  };
  for (const Shape& shape : shapes) {
    const auto size = [&](std::size_t, const Duties& d) { return d.duration_s * shape(d); };
    for (int component : {0, 1, 2}) maker.add(under_way, component, size, once);
  }
  for (const Shape& shape : {shapes[0], shapes[1]}) {
    const auto size = [&](std::size_t, const Duties& d) { return shape(d); };
    for (int component : {0, 1, 2}) maker.add(at_end, component, size, once);
  }
  for (int component : {0, 1, 2}) {
    maker.add(
        at_end, component, [](std::size_t, const Duties&) { return 1.0; }, once);
  }
  return {"duties and duration", stack(maker.take())};
}

std::vector<std::vector<double>> drive_classes(const Study& study) {
  std::size_t count = 4;
  for (const ResidualTrial& t : study.trials) {
    if (!study.free_commands) count = std::max(count, t.command + 1);
  }
  std::vector<std::vector<double>> classes(count, std::vector<double>(study.size(), 0));
  for (std::size_t i = 0; i < study.size(); ++i) {
    if (!study.free_commands) {
      classes[study.trials[i].command][i] = 1;
      continue;
    }
    const Duties d = duties_of(study, i);
    const bool turns = std::abs(d.turn) > std::abs(d.drive);
    const bool positive = (turns ? d.turn : d.drive) > 0;
    classes[(turns ? 2U : 0U) + (positive ? 0U : 1U)][i] = 1;
  }
  std::erase_if(classes, [](const std::vector<double>& in) {
    return std::all_of(in.begin(), in.end(), [](double v) { return v == 0; });
  });
  return classes;
}

Eigen::MatrixXd misfit_columns(const Study& study) {
  if (study.free_commands) return stack(smooth_misfits(study));
  std::vector<Eigen::VectorXd> columns;
  add_misfits(study, &columns);
  return stack(columns);
}

Result<Eigen::MatrixXd> nuisance_columns(Predictor& predictor, const Study& study) {
  constexpr double kStep = 0.05;
  constexpr double kLagStep = 0.02;  // s
  const ParameterTable& table = predictor.problem().table();
  std::vector<Probe> probes;
  for (const RetunedParameter& r : study.drive.retuned) {
    Probe& probe = probes.emplace_back(share_probe(study, r.row, kStep));
    probe.effect = "retuning " + table[r.row].key;
    if (r.unit == 0) continue;
    probe.plus.begin()->second = study.base.at(r.row) + kStep * r.unit;
    probe.minus.begin()->second = study.base.at(r.row) - kStep * r.unit;
  }
  if (table.find("motor_lag.tau")) {
    probes.push_back({"", {{"motor_lag.tau", kLagStep}}, {}, kLagStep});
  }
  ASSIGN_OR_RETURN(const auto slopes, probe_all(predictor, study, probes));
  std::vector<Eigen::VectorXd> columns;
  if (study.drive.alike) columns.push_back(0.3 * study.whiten(mapped(study.trials, of_gain)));
  for (std::size_t k = 0; k < probes.size(); ++k) {
    // Motors of some hundredths of a second are part of any robot.
    const bool lag = k == study.drive.retuned.size();
    const double prior_sd = lag ? 0.02 : study.drive.retuned[k].prior_sd;
    if (!slopes[k].empty()) columns.push_back(prior_sd * study.whiten(slopes[k]));
  }
  const Eigen::MatrixXd misfits = misfit_columns(study);
  for (const auto& column : misfits.colwise()) columns.emplace_back(column);
  return stack(columns);
}

}  // namespace gapfarm
