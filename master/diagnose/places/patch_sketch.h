// Where on the floor a patch of other friction could lie: a sketch that is quick enough to try
// thousands of discs.  The simulation has the last word on those that it proposes.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "common/pose/pose.h"
#include "master/diagnose/fit/regression.h"
#include "master/diagnose/places/patch.h"
#include "master/diagnose/study.h"

namespace gapfarm {

// Quasi-static: four contacts whose friction outweighs all else.  On a floor of one friction the
// motion does not depend on it; while some contacts are inside the disc, the body moves with the
// twist that makes the least of sum mu_i sqrt(s_i^2 + creep^2) over the contacts' sliding speeds
// s_i.  The base's motion with what that differs by from the twist on an even floor is followed to
// its end, for a strong patch leads elsewhere; how that end differs is the disc's mark.
class PatchSketch {
 public:
  PatchSketch(const Problem& problem, const Study& study);

  // Whitened shifts of the predicted ends, three rows a trial.
  Eigen::VectorXd column(const Patch& patch) const;

  // Twist (m/s, m/s, rad/s in body axes) of the robot with these tread speeds (m/s) while the
  // contacts have these relative frictions: left front, left rear, right front, right rear.
  Eigen::Vector3d twist(double left, double right, const Eigen::Vector4d& friction) const;

  struct Place {
    Patch patch;
    double squares = 0;  // that its mark explains beyond the regression's
  };
  // The best first, none near another, with the ratio that fits best.  Start places bound the
  // search.
  std::vector<Place> search(const Regression& explained, const PatchWish& wish) const;

 private:
  using Contacts = std::array<Eigen::Vector2d, 4>;  // world, m
  // A pose beside its heading's cosine and sine: composing takes no trigonometry.
  struct Placed {
    double x = 0, y = 0, theta = 0, cosine = 1, sine = 0;
    Eigen::Vector2d operator*(const Eigen::Vector2d& at) const {
      return {x + cosine * at.x() - sine * at.y(), y + sine * at.x() + cosine * at.y()};
    }
    Placed operator*(const Placed& next) const {
      const Eigen::Vector2d to = *this * Eigen::Vector2d(next.x, next.y);
      return {to.x(), to.y(), theta + next.theta, cosine * next.cosine - sine * next.sine,
              sine * next.cosine + cosine * next.sine};
    }
  };
  struct DrivenPath {  // that the base predicts of a trial
    double step_s = 0;
    Twist step = Twist::Zero();
    Placed half;  // of a step
    Pose X_WE;
    std::vector<Placed> X_WB;        // where each step begins
    std::vector<Contacts> contacts;  // in its middle
    // Of all of these.
    Eigen::Array2d low = Eigen::Array2d::Constant(INFINITY), high = -low;
  };
  using Steps = std::array<Placed, 16>;  // what one moves by, by the set of contacts inside
  static Placed placed(const Pose& X);
  Contacts contacts_at(const Placed& X_WB) const;
  // The first step with a part of the contacts inside; kSteps: none.
  std::size_t first_across(const DrivenPath& driven, const Patch& patch) const;
  Eigen::Vector3d shift_from(std::size_t first, std::size_t trial, const Patch& patch,
                             const Steps& steps) const;
  std::vector<Steps> steps(double ratio) const;  // by trial
  // Of all ratios' steps one column each.
  std::vector<Eigen::SparseVector<double>> columns(
      const Patch& patch, std::span<const std::vector<Steps>* const> steps) const;
  void lay_grid();
  void climb(const Regression& explained, Place* place) const;
  double fitted_ratio(const Regression& explained, const Patch& patch) const;

  const Study& study_;
  double scale_ = 1;                         // TrackedTable::scale()
  std::array<Eigen::Vector2d, 4> contacts_;  // body axes, m
  double lateral_ = 1;                       // over longitudinal friction
  double creep_ = 0;
  double speed_m_s_ = 0;
  std::vector<DrivenPath> driven_;         // by trial
  std::vector<std::vector<Steps>> steps_;  // of kRatios
  std::vector<Patch> grid_;
  Eigen::SparseMatrix<double> marks_;  // of the grid's discs
};

struct Footprint {
  double length_m = 0, gauge_m = 0;
  double friction_ratio = 1;  // lateral over longitudinal
  double creep = 0;           // slip speed over tread speed

  // Left front, left rear, right front, right rear; body axes, m.
  std::array<Eigen::Vector2d, 4> contacts() const;
};

// With the study's base.
Footprint footprint_of(const Problem& problem, const Study& study);

}  // namespace gapfarm
