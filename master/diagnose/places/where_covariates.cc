#include "master/diagnose/places/where_covariates.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace gapfarm {
namespace {

std::vector<double> middle(std::span<const ResidualTrial> trials) {
  double x0 = INFINITY, x1 = -INFINITY, y0 = INFINITY, y1 = -INFINITY;
  for (const ResidualTrial& t : trials) {
    x0 = std::min(x0, t.X_WS.x), x1 = std::max(x1, t.X_WS.x);
    y0 = std::min(y0, t.X_WS.y), y1 = std::max(y1, t.X_WS.y);
  }
  return {(x0 + x1) / 2, (y0 + y1) / 2};
}

class CovariateList {
 public:
  CovariateList(std::span<const ResidualTrial> trials, std::span<const Eigen::Vector3d> residuals,
                std::span<const Cell> cells)
      : trials_(trials), residuals_(residuals), cells_(cells) {}

  std::vector<WhereCovariate> take() { return std::move(covariates_); }

  void add_covariates() {
    using V = std::vector<double>;
    const auto& t = trials_;
    const auto cell = [this](std::size_t i) -> const Cell& { return cells_[trials_[i].cell]; };
    add({"time", {}, true, true, 60, "with every minute of the session"},
        [&](std::size_t i) { return V{t[i].context.session_time_s}; });
    add({"duration", {}, false, false, 1, "with every second that the command lasts"},
        [&](std::size_t i) { return V{cell(i).command.duration_s}; });
    add({"level", {}, false, false, 0.1, "with every tenth of the level"},
        [&](std::size_t i) { return V{cell(i).level}; });
    add({"place in run", {}, true, true, 1, "with every trial since the robot was put down"},
        [&](std::size_t i) { return V{double(t[i].context.place_in_run)}; });
    add({"direction change", {}}, [&](std::size_t i) {
      return V{t[i].context.last_left * cell(i).command.left < 0 ? 1.0 : 0.0,
               t[i].context.last_right * cell(i).command.right < 0 ? 1.0 : 0.0};
    });
    const char* const heading[] = {"start heading", "start heading, 2nd harmonic",
                                   "start heading, 4th harmonic"};
    for (int h = 0; h < 3; ++h) {
      const int order = 1 << h;
      add({heading[h], {}, true}, [&t, order](std::size_t i) {
        return V{std::cos(order * t[i].X_WS.theta), std::sin(order * t[i].X_WS.theta)};
      });
    }
    const V centre = middle(trials_);
    add({"start x", {}, true, true, 0.1, "with every 100 mm that they start farther along x"},
        [&](std::size_t i) { return V{t[i].X_WS.x - centre[0]}; });
    add({"start y", {}, true, true, 0.1, "with every 100 mm that they start farther along y"},
        [&](std::size_t i) { return V{t[i].X_WS.y - centre[1]}; });
    add({"radius from the middle",
         {},
         true,
         true,
         0.1,
         "with every 100 mm that they start farther from the arena's middle"},
        [&](std::size_t i) {
          return V{std::hypot(t[i].X_WS.x - centre[0], t[i].X_WS.y - centre[1])};
        });
    std::size_t sessions = 0;
    for (const ResidualTrial& trial : t) sessions = std::max(sessions, trial.session + 1);
    if (sessions > 1) {
      add({"session", {}, true}, [&](std::size_t i) {
        V one(sessions - 1, 0.0);
        if (t[i].session > 0) one[t[i].session - 1] = 1;
        return one;
      });
    }
    add({"previous residual", {}}, [&](std::size_t i) {
      const auto& before = t[i].context.previous;
      if (!before || t[i].context.moved) return V{0, 0, 0};
      const Eigen::Vector3d& r = residuals_[*before];
      return V{r[0], r[1], r[2]};
    });
    add({"unrecorded move", {}, true, true, 1, "when the robot was put down by hand just before"},
        [&](std::size_t i) { return V{t[i].context.moved ? 1.0 : 0.0}; });
  }

 private:
  void add(WhereCovariate covariate,
           const std::function<std::vector<double>(std::size_t)>& values) {
    const std::size_t width = values(0).size();
    covariate.columns.resize(static_cast<Eigen::Index>(trials_.size()),
                             static_cast<Eigen::Index>(width));
    for (std::size_t i = 0; i < trials_.size(); ++i) {
      const std::vector<double> row = values(i);
      for (std::size_t j = 0; j < width; ++j) {
        covariate.columns(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = row[j];
      }
    }
    covariate.columns.rowwise() -= covariate.columns.colwise().mean().eval();
    covariates_.push_back(std::move(covariate));
  }

  std::span<const ResidualTrial> trials_;
  std::span<const Eigen::Vector3d> residuals_;
  std::span<const Cell> cells_;
  std::vector<WhereCovariate> covariates_;
};

}  // namespace

std::vector<WhereCovariate> where_covariates(std::span<const ResidualTrial> trials,
                                             std::span<const Eigen::Vector3d> residuals,
                                             std::span<const Cell> cells) {
  CovariateList list(trials, residuals, cells);
  list.add_covariates();
  return list.take();
}

}  // namespace gapfarm
