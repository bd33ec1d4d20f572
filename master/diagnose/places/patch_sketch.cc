#include "master/diagnose/places/patch_sketch.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>

#include "common/base/constants.h"
#include "common/math/statistics.h"
#include "common/pose/pose.h"
#include "master/diagnose/fit/free_commands.h"

namespace gapfarm {
namespace {

constexpr std::size_t kSteps = 16;  // of a way
// A fitted share of the mark scales it, so few stand for all; but where a robot can no longer turn
// its way out of a patch, that is so from some ratio on.
constexpr std::array<double, 8> kRatios = {0.1, 0.14, 0.2, 0.3, 0.45, 0.67, 1.6, 2.5};
constexpr std::array<std::size_t, 3> kGridRatios = {2, 4, 7};  // of these
// Lengths for an SRV-1; a larger robot distinguishes discs as much larger.
constexpr std::array<double, 6> kPatchRadii_m = {0.14, 0.20, 0.28, 0.38, 0.50, 0.65};
constexpr double kPatchStep_m = 0.1;
constexpr double kApart_m = 0.08;  // discs closer than this, in all of x, y and radius, are one
constexpr Eigen::Index kFewestMarked = 30;  // rows, three a trial
constexpr double kMostSteps = 20;           // of the grid, along each axis
constexpr std::size_t kClimbs = 12;
constexpr double kLeastPatchRatio = 0.08;
constexpr double kMostPatchRatio = 2.8;

// Which contacts lie in the patch, a bit each.
unsigned inside(const std::array<Eigen::Vector2d, 4>& contacts, const Patch& patch) {
  const Eigen::Vector2d centre(patch[0], patch[1]);
  unsigned set = 0;
  for (unsigned c = 0; c < 4; ++c) {
    set |= (contacts[c] - centre).squaredNorm() < patch[2] * patch[2] ? 1U << c : 0U;
  }
  return set;
}

constexpr unsigned kAllInside = 15;

bool near(const Patch& a, const Patch& b, double apart_m) {
  return std::abs(a[0] - b[0]) < apart_m && std::abs(a[1] - b[1]) < apart_m &&
         std::abs(a[2] - b[2]) < apart_m;
}

double value_of(const Problem& problem, const Study& study, const char* key) {
  return value_at(problem, study.base, problem.table().row(key));
}

// Of a program's robot, whose parameters mean what its author wants: as wide as it turns, as long,
// and with treads that give way like most.
Footprint footprint_of_turns(const Study& study) {
  constexpr double kUsualGauge_m = 0.15, kUsualCreep = 0.1, kLeastApart = 0.1;
  std::vector<double> gauges;
  for (const ResidualTrial& trial : study.trials) {
    const CommandSpec& c = study.cells[trial.cell].command;
    const double turned = std::abs((trial.left + trial.right)[2]);
    const double apart = std::abs(c.right - c.left) * study.speed_m_s * c.duration_s;
    if (std::abs(c.right - c.left) > kLeastApart && turned > 0) gauges.push_back(apart / turned);
  }
  const double gauge_m = gauges.empty() ? kUsualGauge_m : median(gauges);
  return {gauge_m, gauge_m, 1, kUsualCreep};
}

}  // namespace

PatchSketch::PatchSketch(const Problem& problem, const Study& study)
    : study_(study), scale_(problem.treads().scale()) {
  const Footprint footprint = footprint_of(problem, study);
  contacts_ = footprint.contacts();
  lateral_ = footprint.friction_ratio;
  creep_ = footprint.creep;
  speed_m_s_ = study.speed_m_s;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& trial = study.trials[i];
    DrivenPath& driven = driven_.emplace_back();
    const Twist whole = motion_of(study, i);
    driven.step_s = study.cells[trial.cell].command.duration_s / kSteps;
    driven.step = whole / kSteps;
    driven.half = placed(exp(Twist(driven.step / 2)));
    driven.X_WE = trial.X_WS * exp(whole);
    const Placed next = placed(exp(driven.step));
    driven.X_WB = {placed(trial.X_WS)};
    for (std::size_t k = 0; k < kSteps; ++k) {
      driven.contacts.push_back(contacts_at(driven.X_WB[k] * driven.half));
      driven.X_WB.push_back(driven.X_WB[k] * next);
      for (const Eigen::Vector2d& contact : driven.contacts.back()) {
        driven.low = driven.low.cwiseMin(contact.array());
        driven.high = driven.high.cwiseMax(contact.array());
      }
    }
  }
  for (double ratio : kRatios) steps_.push_back(steps(ratio));
  lay_grid();
}

void PatchSketch::lay_grid() {
  Extent box;
  for (const ResidualTrial& t : study_.trials) box.add(t.X_WS);
  const double step = std::max(kPatchStep_m * scale_, box.longer_side() / kMostSteps);
  std::vector<const std::vector<Steps>*> of_grid;
  for (const std::size_t r : kGridRatios) of_grid.push_back(&steps_[r]);
  std::vector<Eigen::Triplet<double>> marks;
  for (double radius_m : kPatchRadii_m) {
    for (double x = box.x0; x <= box.x1; x += step) {
      for (double y = box.y0; y <= box.y1; y += step) {
        const auto of_ratios = columns({x, y, radius_m * scale_, 1}, of_grid);
        for (std::size_t k = 0; k < of_ratios.size(); ++k) {
          if (of_ratios[k].nonZeros() < kFewestMarked) continue;
          const auto column = static_cast<Eigen::Index>(grid_.size());
          for (Eigen::SparseVector<double>::InnerIterator it(of_ratios[k]); it; ++it) {
            marks.emplace_back(it.index(), column, it.value());
          }
          grid_.push_back({x, y, radius_m * scale_, kRatios[kGridRatios[k]]});
        }
      }
    }
  }
  marks_.resize(static_cast<Eigen::Index>(3 * study_.size()),
                static_cast<Eigen::Index>(grid_.size()));
  marks_.setFromTriplets(marks.begin(), marks.end());
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

// The base's steps with what the twist on the disc differs by from that on an even floor.
std::vector<PatchSketch::Steps> PatchSketch::steps(double ratio) const {
  std::vector<std::array<Eigen::Vector3d, 16>> shifts;  // of the twist, by cell
  for (const Cell& cell : study_.cells) {
    const double left = cell.command.left * speed_m_s_, right = cell.command.right * speed_m_s_;
    const Eigen::Vector3d even = twist(left, right, Eigen::Vector4d::Ones());
    auto& of_cell = shifts.emplace_back();
    for (std::size_t set = 0; set < of_cell.size(); ++set) {
      Eigen::Vector4d friction = Eigen::Vector4d::Ones();
      for (std::size_t c = 0; c < 4; ++c) {
        if ((set >> c & 1) != 0) friction[c] = ratio;
      }
      of_cell[set] = twist(left, right, friction) - even;
    }
  }
  std::vector<Steps> all(driven_.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto& of_cell = shifts[study_.trials[i].cell];
    for (std::size_t set = 0; set < of_cell.size(); ++set) {
      all[i][set] = placed(exp(Twist(driven_[i].step + of_cell[set] * driven_[i].step_s)));
    }
  }
  return all;
}

PatchSketch::Placed PatchSketch::placed(const Pose& X) {
  return {X.x, X.y, X.theta, std::cos(X.theta), std::sin(X.theta)};
}

PatchSketch::Contacts PatchSketch::contacts_at(const Placed& X_WB) const {
  return {X_WB * contacts_[0], X_WB * contacts_[1], X_WB * contacts_[2], X_WB * contacts_[3]};
}

std::size_t PatchSketch::first_across(const DrivenPath& driven, const Patch& patch) const {
  const Eigen::Array2d centre(patch[0], patch[1]);
  const Eigen::Array2d off = (driven.low - centre).cwiseMax(centre - driven.high).cwiseMax(0.0);
  if (off.matrix().squaredNorm() >= patch[2] * patch[2]) return kSteps;
  std::size_t k = 0;
  for (; k < kSteps; ++k) {
    const unsigned set = inside(driven.contacts[k], patch);
    if (set != 0 && set != kAllInside) break;
  }
  return k;
}

// Of the end, in the predicted end's axes.
Eigen::Vector3d PatchSketch::shift_from(std::size_t first, std::size_t trial, const Patch& patch,
                                        const Steps& steps) const {
  const DrivenPath& driven = driven_[trial];
  Placed X_WB = driven.X_WB[first];
  for (std::size_t k = first; k < kSteps; ++k) {
    X_WB = X_WB * steps[inside(contacts_at(X_WB * driven.half), patch)];
  }
  return difference_of(study_.trials[trial], driven.X_WE, {X_WB.x, X_WB.y, X_WB.theta});
}

std::vector<Eigen::SparseVector<double>> PatchSketch::columns(
    const Patch& patch, std::span<const std::vector<Steps>* const> steps) const {
  std::vector<Eigen::SparseVector<double>> all(
      steps.size(), Eigen::SparseVector<double>(static_cast<Eigen::Index>(3 * study_.size())));
  for (std::size_t i = 0; i < study_.size(); ++i) {
    const std::size_t first =
        study_.ignores(static_cast<Eigen::Index>(i)) ? kSteps : first_across(driven_[i], patch);
    for (std::size_t k = 0; k < steps.size() && first < kSteps; ++k) {
      const Eigen::Vector3d mark = study_.whitener[i] * shift_from(first, i, patch, (*steps[k])[i]);
      for (Eigen::Index c = 0; c < 3; ++c) {
        all[k].insertBack(static_cast<Eigen::Index>(3 * i) + c) = mark[c];
      }
    }
  }
  return all;
}

Eigen::VectorXd PatchSketch::column(const Patch& patch) const {
  const std::vector<Steps> own = steps(patch[3]);
  return columns(patch, std::array{&own}).front();
}

// Up the nearest hill, in ever smaller steps of place and radius and from ratio to ratio.
void PatchSketch::climb(const Regression& explained, Place* place) const {
  for (double step : {0.05, 0.025, 0.012}) {
    const double step_m = step * scale_;
    for (bool better = true; better;) {
      better = false;
      for (int k = 0; k < 8; ++k) {
        Place next = *place;
        const std::size_t at = std::ranges::find(kRatios, next.patch[3]) - kRatios.begin();
        std::size_t to = at;
        if (k < 6) {
          next.patch[k / 2] += k % 2 == 0 ? step_m : -step_m;
        } else {
          to = k == 6 ? at + 1 : at - 1;  // below 0 it is large
          if (to >= kRatios.size()) continue;
          next.patch[3] = kRatios[to];
        }
        if (next.patch[2] < 0.08 * scale_) continue;
        next.squares = explained.each_gain(columns(next.patch, std::array{&steps_[to]}).front())[0];
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
  return std::clamp(std::pow(patch[3], share), kLeastPatchRatio, kMostPatchRatio);
}

std::vector<PatchSketch::Place> PatchSketch::search(const Regression& explained,
                                                    const PatchWish& wish) const {
  const Eigen::VectorXd squares = explained.each_gain(marks_);
  std::vector<Place> places;
  const auto is_wanted = [&](const Patch& patch) {
    return !wish.beside || are_two_patches(*wish.beside, patch);
  };
  for (std::size_t k = 0; k < grid_.size(); ++k) {
    if (is_wanted(grid_[k])) places.push_back({grid_[k], squares[k]});
  }
  std::ranges::stable_sort(places, std::greater(), &Place::squares);
  std::vector<Place> apart;
  const auto add = [&](const Place& place, std::vector<Place>* to) {
    const auto is_near = [&](const Patch& known) {
      return near(place.patch, known, kApart_m * scale_);
    };
    if (std::ranges::none_of(*to, is_near, &Place::patch)) to->push_back(place);
  };
  for (const Place& place : places) {
    // A disc of the grid that is off by half a step shows a third of what the right one would.
    if (apart.size() < kClimbs && 3 * place.squares > wish.least) add(place, &apart);
  }
  for (Place& place : apart) climb(explained, &place);
  std::ranges::stable_sort(apart, std::greater(), &Place::squares);
  std::vector<Place> found;
  for (const Place& place : apart) {
    if (found.size() == wish.most || place.squares < wish.least) break;
    if (is_wanted(place.patch)) add(place, &found);  // it may have climbed too near
  }
  for (Place& place : found) place.patch[3] = fitted_ratio(explained, place.patch);
  return found;
}

std::array<Eigen::Vector2d, 4> Footprint::contacts() const {
  const double front = length_m / 2, side = gauge_m / 2;
  return {Eigen::Vector2d(front, side), Eigen::Vector2d(-front, side),
          Eigen::Vector2d(front, -side), Eigen::Vector2d(-front, -side)};
}

Footprint footprint_of(const Problem& problem, const Study& study) {
  if (problem.external) return footprint_of_turns(study);
  return {value_of(problem, study, "contact_length"), value_of(problem, study, "track_gauge"),
          value_of(problem, study, "friction_ratio"), value_of(problem, study, "tread_creep")};
}

}  // namespace gapfarm
