#include "master/diagnose/push/push_subject.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "common/parameters/table.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/push/push_geometry.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr std::size_t kBases = 6;       // pushes of the log that the others are made from
constexpr double kBeside = 0.3;         // of the piece's radius of gyration
constexpr double kWorthMoving_m = 0.1;  // less is no other place
constexpr double kMillimetres = 1000;

// A push of the log that stands for others like it.
struct Base {
  std::size_t trial = 0;
  PushGeometry push;
};

double unlikeness(const Problem& problem, const Base& a, const Base& b) {
  if (problem.log.trials[a.trial].command != problem.log.trials[b.trial].command) return INFINITY;
  const double side = 2 * std::sin((a.push.in_piece_rad - b.push.in_piece_rad) / 2);
  return std::hypot(side, (a.push.arm_m - b.push.arm_m) / a.push.gyration_m);
}

// The first of the log, then always the one least like those taken.
std::vector<Base> bases_of(const Problem& problem) {
  const double finger_m = problem.values[row_of(Push::kFingerRadius)];
  std::vector<Base> open, taken;
  std::set<std::size_t> cells;
  const std::vector<std::size_t> cell_of = push_cells(problem.log);
  for (std::size_t i = 0; i < cell_of.size(); ++i) {
    if (!cells.insert(cell_of[i]).second) continue;
    const Trial& trial = problem.log.trials[i];
    const PushGeometry push = push_geometry(problem.piece(trial.command), trial, finger_m);
    if (push.touched) open.push_back({i, push});
  }
  while (!open.empty() && taken.size() < kBases) {
    std::size_t best = 0;
    double most = -1;
    for (std::size_t k = 0; k < open.size(); ++k) {
      double nearest = INFINITY;
      for (const Base& t : taken) nearest = std::min(nearest, unlikeness(problem, open[k], t));
      if (nearest > most) {
        most = nearest;
        best = k;
      }
    }
    taken.push_back(open[best]);
    open.erase(open.begin() + static_cast<std::ptrdiff_t>(best));
  }
  return taken;
}

// Piece and finger's way moved together.
Trial moved(Trial trial, const Pose& X) {
  trial.X_WS = X * trial.X_WS;
  for (TipSample& tip : trial.tip) {
    const Eigen::Vector2d p = transform(X, {tip.x, tip.y});
    tip.x = p.x();
    tip.y = p.y();
  }
  return trial;
}

Trial turned(const Trial& trial, const Eigen::Vector2d& about, double angle_rad) {
  const Pose there{about.x(), about.y(), 0};
  return moved(trial, there * Pose{0, 0, angle_rad} * Pose{-about.x(), -about.y(), 0});
}

Trial shifted(const Trial& trial, const Eigen::Vector2d& by) {
  return moved(trial, {by.x(), by.y(), 0});
}

// The finger alone, to the left of the push's direction.
Trial beside(Trial trial, double direction_rad, double left_m) {
  for (TipSample& tip : trial.tip) {
    tip.x -= left_m * std::sin(direction_rad);
    tip.y += left_m * std::cos(direction_rad);
  }
  return trial;
}

Trial at_speed(Trial trial, double factor) {
  for (TipSample& tip : trial.tip) tip.t_s /= factor;
  return trial;
}

class Planner {
 public:
  explicit Planner(const Problem& problem) : problem_(problem) {
    plan_ = {problem, {}, "other push", "measure one of them directly"};
    plan_.problem.genes.clear();
    plan_.problem.log = {};
    for (const Trial& t : problem.log.trials) {
      const Eigen::Vector2d c = transform(t.X_WS, centroid(problem.piece(t.command)));
      low_ = low_.cwiseMin(c);
      high_ = high_.cwiseMax(c);
    }
  }

  void add(const Base& base) {
    const Trial& trial = problem_.log.trials[base.trial];
    as_ = "Push " + trial.command + " as in trial " + std::to_string(trial.trial) +
          (trial.session.empty() ? "" : " of session " + trial.session);
    ordinary_.reset();
    const std::uint32_t own = add("as it was", trial, "");
    ordinary_ = own;
    const Eigen::Vector2d middle = transform(trial.X_WS, base.push.p_RC);
    for (int degrees : {45, 90}) {
      add("turned", turned(trial, middle, degrees * std::numbers::pi / 180),
          " with piece and finger turned by " + std::to_string(degrees) + " degrees");
    }
    for (const Eigen::Vector2d& corner : {low_, high_}) {
      const Eigen::Vector2d by = corner - middle;
      if (by.norm() < kWorthMoving_m) continue;
      add("elsewhere", shifted(trial, by),
          " from (" + plain_number(std::round(corner.x() * 100) / 100) + ", " +
              plain_number(std::round(corner.y() * 100) / 100) + ") m");
    }
    for (double side : {1.0, -1.0}) {
      const double left_m =
          std::round(side * kBeside * base.push.gyration_m * kMillimetres) / kMillimetres;
      add("beside", beside(trial, base.push.direction_rad, left_m),
          " with the finger " + plain_number(std::abs(left_m) * kMillimetres) +
              " mm further to the " + (side > 0 ? "left" : "right"));
    }
    for (const auto& [factor, ending] :
         {std::pair{2.0, " twice as fast"}, {0.5, " half as fast"}}) {
      add("speed", at_speed(trial, factor), ending);
    }
  }

  ExperimentPlan take() { return std::move(plan_); }

 private:
  std::uint32_t add(const char* group, Trial trial, const std::string& how) {
    std::vector<Trial>& log = plan_.problem.log.trials;
    const auto index = static_cast<std::uint32_t>(log.size());
    trial.session = "d" + std::to_string(index);
    trial.X_WE = trial.X_WS;
    log.push_back(std::move(trial));
    Design design;
    design.group = group;
    design.trials = {index};
    design.ordinary = ordinary_;
    design.cost = ordinary_ ? 1 : 0;
    design.action = [text = as_ + how](bool) { return text; };
    plan_.designs.push_back(std::move(design));
    return index;
  }

  const Problem& problem_;
  ExperimentPlan plan_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(INFINITY), high_ = -low_;
  std::string as_;
  std::optional<std::uint32_t> ordinary_;
};

}  // namespace

DiagnosisSubject push_subject() {
  DiagnosisSubject s;
  s.scenario = "push";
  s.effects = &push_effect_diagnoses();
  s.least_gain = kLeastGainOfPushes;
  s.farthest = 4;
  s.noise_tail = 7;
  s.base_moves = true;
  s.drive_common = {row_of(Push::kPushNoiseSlide)};
  s.drive_side = {row_of(Push::kPushNoiseTurn), kTurnUnit_rad_m};
  s.pose_position = {row_of(Push::kPoseNoisePosition)};
  s.pose_heading = {row_of(Push::kPoseNoiseHeading)};
  s.covariance = push_covariance;
  s.make_study = make_push_study;
  s.tune = tune_push_base;
  s.nuisances = push_nuisances;
  s.blocks = push_blocks;
  s.folds = push_folds;
  s.where = push_where;
  s.cautions = push_cautions;
  s.lacks = push_lacks;
  s.experiments = plan_pushes;
  s.view = push_view;
  s.shown = {{"arm_mm", "centroid left of the finger's line, mm", "contact offset"},
             {"direction", "push direction in the world, degrees", "push direction"},
             {"side", "push direction in the piece, degrees", "side of the piece"},
             {"pushed_mm", "distance pushed, mm", "distance"},
             {"speed", "finger's speed, mm/s", "finger speed"},
             {"along_edge", "touch on its edge, half edges from its middle", "place of the touch"},
             {"middle_x", "start of the centroid along x, m", "start x"},
             {"middle_y", "start of the centroid along y, m", "start y"}};
  s.labels.ends =
      "One picture a piece, seen from where each push began: x along the finger's way, y to its "
      "left. Every push is a condition of its own: the ellipses, which should hold nine in ten, "
      "are those of all its pushes together, and an error takes each push's own prediction away.";
  s.labels.residuals = "Measured minus predicted, along and across the push.";
  s.labels.x = "along the push";
  s.labels.y = "across the push";
  return s;
}

ExperimentPlan plan_pushes(const Problem& problem) {
  Planner planner(problem);
  for (const Base& base : bases_of(problem)) planner.add(base);
  return planner.take();
}

}  // namespace gapfarm
