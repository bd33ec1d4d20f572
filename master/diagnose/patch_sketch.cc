#include "master/diagnose/patch_sketch.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/pose/pose.h"
#include "common/score/statistics.h"
#include "master/diagnose/free_commands.h"

namespace gapfarm {
namespace {

constexpr int kMoments = 16;  // of a way
// A fitted share of the mark scales it, so one smaller and one larger friction stand for all.
constexpr std::array<double, 2> kRatios = {0.4, 2.5};
constexpr std::array<double, 6> kPatchRadii_m = {0.14, 0.20, 0.28, 0.38, 0.50, 0.65};
constexpr double kPatchStep_m = 0.1;
constexpr double kApart_m = 0.08;  // discs nearer than this, in all of x, y and radius, are one
constexpr Eigen::Index kFewestMarked = 30;  // rows, three a trial
constexpr double kMostSteps = 20;           // of the grid, along each axis
constexpr std::size_t kClimbs = 12;
constexpr double kLeastRatio = 0.08;
constexpr double kMostRatio = 2.8;
constexpr double kCreepAtRest_m_s = 1.5e-3;  // as the simulation has

double value_of(const Problem& problem, const Study& study, const char* key) {
  const std::size_t row = problem.table().row(key);
  const auto tuned = study.base.find(row);
  return tuned != study.base.end() ? tuned->second : problem.values[row];
}

// What the sketch has to know of a robot.
struct Footprint {
  double length_m = 0, gauge_m = 0, friction_ratio = 1, creep = 0;
};

// Of a program's robot, whose parameters mean what its author wants: as wide as it turns, as long,
// and with treads that give way like most.
Footprint footprint_of_turns(const Study& study) {
  constexpr double kUsualGauge_m = 0.15, kUsualCreep = 0.1, kLeastApart = 0.1;
  std::vector<double> gauges;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& trial = study.trials[i];
    const CommandSpec& c = study.cells[trial.cell].command;
    const double turned = std::abs((trial.left + trial.right)[2]);
    const double apart = std::abs(c.right - c.left) * study.speed_m_s * c.duration_s;
    if (std::abs(c.right - c.left) > kLeastApart && turned > 0) gauges.push_back(apart / turned);
  }
  const double gauge_m = gauges.empty() ? kUsualGauge_m : median(gauges);
  return {gauge_m, gauge_m, 1, kUsualCreep};
}

Footprint footprint_of(const Problem& problem, const Study& study) {
  if (problem.external) return footprint_of_turns(study);
  return {value_of(problem, study, "contact_length"), value_of(problem, study, "track_gauge"),
          value_of(problem, study, "friction_ratio"), value_of(problem, study, "tread_creep")};
}

// Shift of the end, in its axes, for a twist in the body axes of a moment from which X leads there.
Eigen::Matrix3d moved_to_end(const Pose& X) {
  const double c = std::cos(X.theta), s = std::sin(X.theta);
  Eigen::Matrix3d m;
  // A turn about the moment's origin moves the end by (-y, x) of the way there.
  m << c, s, -c * X.y + s * X.x, -s, c, s * X.y + c * X.x, 0, 0, 1;
  return m;
}

bool near(const Patch& a, const Patch& b) {
  return std::abs(a[0] - b[0]) < kApart_m && std::abs(a[1] - b[1]) < kApart_m &&
         std::abs(a[2] - b[2]) < kApart_m;
}

}  // namespace

PatchSketch::PatchSketch(const Problem& problem, const Study& study) : study_(study) {
  const Footprint footprint = footprint_of(problem, study);
  const double front = footprint.length_m / 2, side = footprint.gauge_m / 2;
  contacts_ = {Eigen::Vector2d(front, side), Eigen::Vector2d(-front, side),
               Eigen::Vector2d(front, -side), Eigen::Vector2d(-front, -side)};
  lateral_ = footprint.friction_ratio;
  creep_ = footprint.creep;
  speed_m_s_ = study.speed_m_s;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& trial = study.trials[i];
    const double duration = study.cells[trial.cell].command.duration_s;
    const Twist way = way_of(study, i);
    std::vector<Moment>& moments = moments_.emplace_back(kMoments);
    for (int k = 0; k < kMoments; ++k) {
      const double share = (k + 0.5) / kMoments;
      const Pose X_SB = exp(Twist(way * share));
      const Pose X_WB = trial.X_WS * X_SB;
      for (int c = 0; c < 4; ++c) {
        const Pose at = X_WB * Pose{contacts_[c].x(), contacts_[c].y(), 0};
        moments[k].contacts[c] = {at.x, at.y};
      }
      moments[k].to_end = study.whitener[i] *
                          moved_to_end(between(X_SB, between(trial.X_WS, trial.X_WP))) *
                          (duration / kMoments);
    }
  }
  for (double ratio : kRatios) shifts_.push_back(shifts(ratio));
  lay_grid();
}

void PatchSketch::lay_grid() {
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const ResidualTrial& t : study_.trials) {
    low = low.cwiseMin(Eigen::Vector2d(t.X_WS.x, t.X_WS.y));
    high = high.cwiseMax(Eigen::Vector2d(t.X_WS.x, t.X_WS.y));
  }
  const double step = std::max(kPatchStep_m, (high - low).maxCoeff() / kMostSteps);
  std::vector<Eigen::VectorXd> marks;
  for (std::size_t r = 0; r < kRatios.size(); ++r) {
    for (double radius : kPatchRadii_m) {
      for (double x = low.x(); x <= high.x(); x += step) {
        for (double y = low.y(); y <= high.y(); y += step) {
          const Patch patch = {x, y, radius, kRatios[r]};
          Eigen::VectorXd mark = column(patch, shifts_[r]);
          if ((mark.array() != 0).count() < kFewestMarked) continue;
          grid_.push_back(patch);
          marks.push_back(std::move(mark));
        }
      }
    }
  }
  marks_.resize(static_cast<Eigen::Index>(3 * study_.size()),
                static_cast<Eigen::Index>(marks.size()));
  for (std::size_t k = 0; k < marks.size(); ++k) {
    marks_.col(static_cast<Eigen::Index>(k)) = marks[k];
  }
}

// Newton's method on a convex function; a step that does not lower it is halved.
Eigen::Vector3d PatchSketch::twist(double left, double right,
                                   const Eigen::Vector4d& friction) const {
  const double gauge = contacts_[0].y() - contacts_[2].y();
  Eigen::Vector3d v((left + right) / 2, 0, (right - left) / gauge / 3);
  const auto losses = [&](const Eigen::Vector3d& at, Eigen::Vector3d* slope,
                          Eigen::Matrix3d* curvature) {
    double sum = 0;
    for (int c = 0; c < 4; ++c) {
      const double tread = c < 2 ? left : right;
      const double creep = creep_ * std::abs(tread) + kCreepAtRest_m_s;
      Eigen::Matrix<double, 2, 3> of_twist;
      of_twist << 1, 0, -contacts_[c].y(), 0, lateral_, lateral_ * contacts_[c].x();
      const Eigen::Vector2d slip = of_twist * at - Eigen::Vector2d(tread, 0);
      const double r = std::sqrt(slip.squaredNorm() + creep * creep);
      sum += friction[c] * r;
      if (slope == nullptr) continue;
      *slope += friction[c] / r * of_twist.transpose() * slip;
      *curvature += friction[c] / r * of_twist.transpose() *
                    (Eigen::Matrix2d::Identity() - slip * slip.transpose() / (r * r)) * of_twist;
    }
    return sum;
  };
  for (int i = 0; i < 60; ++i) {
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();
    Eigen::Matrix3d curvature = Eigen::Matrix3d::Zero();
    const double now = losses(v, &slope, &curvature);
    curvature.diagonal() *= 1 + 1e-9;
    Eigen::Vector3d step = -curvature.ldlt().solve(slope);
    for (int half = 0; half < 40 && losses(v + step, nullptr, nullptr) > now; ++half) step /= 2;
    v += step;
    if (step.cwiseAbs().maxCoeff() < 1e-9) break;
  }
  return v;
}

std::vector<PatchSketch::Shifts> PatchSketch::shifts(double ratio) const {
  std::vector<Shifts> all;
  for (const Cell& cell : study_.cells) {
    const double left = cell.command.left * speed_m_s_, right = cell.command.right * speed_m_s_;
    const Eigen::Vector3d even = twist(left, right, Eigen::Vector4d::Ones());
    Shifts& shifts = all.emplace_back();
    for (std::size_t inside = 0; inside < shifts.size(); ++inside) {
      Eigen::Vector4d friction = Eigen::Vector4d::Ones();
      for (std::size_t c = 0; c < 4; ++c) {
        if ((inside >> c & 1) != 0) friction[static_cast<Eigen::Index>(c)] = ratio;
      }
      shifts[inside] = twist(left, right, friction) - even;
    }
  }
  return all;
}

Eigen::VectorXd PatchSketch::column(const Patch& patch, const std::vector<Shifts>& shifts) const {
  Eigen::VectorXd column = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * study_.size()));
  const Eigen::Vector2d centre(patch[0], patch[1]);
  const double within = patch[2] * patch[2];
  for (std::size_t i = 0; i < study_.size(); ++i) {
    const Shifts& shift = shifts[study_.trials[i].cell];
    for (const Moment& moment : moments_[i]) {
      unsigned inside = 0;
      for (unsigned c = 0; c < 4; ++c) {
        inside |= (moment.contacts[c] - centre).squaredNorm() < within ? 1U << c : 0U;
      }
      if (inside == 0 || inside == 15) continue;
      column.segment<3>(static_cast<Eigen::Index>(3 * i)) += moment.to_end * shift[inside];
    }
  }
  study_.drop_ignored(column);
  return column;
}

Eigen::VectorXd PatchSketch::column(const Patch& patch) const {
  return column(patch, shifts(patch[3]));
}

// Up the nearest hill, in ever smaller steps.
void PatchSketch::climb(const Regression& explained, Place* place) const {
  const std::vector<Shifts>& shifts = shifts_[place->patch[3] == kRatios[0] ? 0 : 1];
  for (double step_m : {0.05, 0.025, 0.012}) {
    for (bool better = true; better;) {
      better = false;
      for (int k = 0; k < 6; ++k) {
        Place next = *place;
        next.patch[static_cast<std::size_t>(k / 2)] += k % 2 == 0 ? step_m : -step_m;
        if (next.patch[2] < 0.08) continue;
        next.squares = explained.each_gain(column(next.patch, shifts))[0];
        if (next.squares <= place->squares * (1 + 1e-9)) continue;
        *place = next;
        better = true;
      }
    }
  }
}

// The mark grows about with the logarithm of the ratio.
double PatchSketch::fitted_ratio(const Regression& explained, const Patch& patch) const {
  const Eigen::VectorXd mark = column(patch);
  const double own = explained.own_squares(mark);
  const double share = own > 0 ? mark.dot(explained.left()) / own : 0;
  return std::clamp(std::pow(patch[3], share), kLeastRatio, kMostRatio);
}

std::vector<PatchSketch::Place> PatchSketch::search(const Regression& explained, std::size_t most,
                                                    double least) const {
  const Eigen::VectorXd squares = explained.each_gain(marks_);
  std::vector<Place> places;
  for (std::size_t k = 0; k < grid_.size(); ++k) {
    places.push_back({grid_[k], squares[static_cast<Eigen::Index>(k)]});
  }
  const auto best_first = [](const Place& a, const Place& b) { return a.squares > b.squares; };
  std::stable_sort(places.begin(), places.end(), best_first);
  std::vector<Place> apart;
  const auto add = [](const Place& place, std::vector<Place>* to) {
    const bool known = std::any_of(
        to->begin(), to->end(), [&](const Place& other) { return near(place.patch, other.patch); });
    if (!known) to->push_back(place);
  };
  for (const Place& place : places) {
    // A disc of the grid that is off by half a step shows a third of what the right one would.
    if (apart.size() < kClimbs && 3 * place.squares > least) add(place, &apart);
  }
  for (Place& place : apart) climb(explained, &place);
  std::stable_sort(apart.begin(), apart.end(), best_first);
  std::vector<Place> found;
  for (const Place& place : apart) {
    if (found.size() < most && place.squares >= least) add(place, &found);
  }
  for (Place& place : found) place.patch[3] = fitted_ratio(explained, place.patch);
  return found;
}

}  // namespace gapfarm
