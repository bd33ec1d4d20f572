// Where pushes go wrong, in words, and how pictures show them.
#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "common/base/ranges.h"
#include "common/parameters/table.h"
#include "common/score/fitness.h"
#include "master/diagnose/places/where.h"
#include "master/diagnose/push/push_subject.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

std::string pushes_of(const std::string& piece) {
  return piece == "all" ? "All pushes" : "Pushes of " + piece;
}

std::string push_component(int component) {
  if (component == 2) return "heading";
  return component == 0 ? "end along the push" : "end across the push";
}

std::string push_deviation(int component, double size, bool along_motion, bool trend) {
  if (along_motion) return deviation_text(component, size, along_motion, trend);
  const std::string much = amount_text(size, component);
  const std::string far = trend ? " farther" : " too far";
  if (component == 0) {
    return size > 0 ? "end " + much + far + " along the push"
                    : "end " + much + (trend ? " shorter" : " too short") + " of the push";
  }
  const std::string side = size > 0 ? "left" : "right";
  if (component == 1) return "end " + much + far + " to the push's " + side;
  return "end turned " + much + far + " to the " + side;
}

std::vector<WhereCovariate> covariates(std::span<const ResidualTrial> trials,
                                       std::span<const Eigen::Vector3d> /*residuals*/,
                                       std::span<const Cell> /*cells*/) {
  std::vector<WhereCovariate> all;
  const auto add = [&](const std::string& name, double unit, const std::string& each,
                       const std::vector<std::function<double(const ResidualTrial&)>>& of) {
    const auto values = [&](std::size_t i) {
      return mapped(of, [&](const auto& f) { return trials[i].push.touched ? f(trials[i]) : 0; });
    };
    add_covariate({name, {}, false, false, unit, each}, trials.size(), values, &all);
  };
  using T = const ResidualTrial&;
  add("contact offset", 0.01, "with every 10 mm that the centroid lies farther left of the push",
      {[](T t) { return t.push.arm_m; }});
  add("place of the touch", 0.1, "with every tenth of the half edge that the touch lies farther on",
      {[](T t) { return t.push.along_edge; }});
  for (int h : {1, 2}) {
    const std::string times = h == 1 ? "" : ", twice a turn";
    add("push direction" + times, 1, "",
        {[h](T t) { return std::cos(h * t.push.direction_rad); },
         [h](T t) { return std::sin(h * t.push.direction_rad); }});
    add("side of the piece" + times, 1, "",
        {[h](T t) { return std::cos(h * t.push.in_piece_rad); },
         [h](T t) { return std::sin(h * t.push.in_piece_rad); }});
  }
  add("start heading", 1, "",
      {[](T t) { return std::cos(t.X_WS.theta); }, [](T t) { return std::sin(t.X_WS.theta); }});
  add("distance pushed", 0.01, "with every 10 mm of the finger's way",
      {[](T t) { return t.push.pushed_m; }});
  add("finger speed", 0.01, "with every 10 mm/s of the finger",
      {[](T t) { return t.push.speed_m_s; }});
  add("start x", 0.1, "with every 100 mm that they start farther along x",
      {[](T t) { return t.X_WS.x; }});
  add("start y", 0.1, "with every 100 mm that they start farther along y",
      {[](T t) { return t.X_WS.y; }});
  add("order", 1 / 60.0, "with every second of the session",
      {[](T t) { return t.context.session_time_s / 60; }});
  std::size_t sessions = 0;
  for (T t : trials) sessions = std::max(sessions, t.session + 1);
  std::vector<std::function<double(T)>> indicators;
  for (std::size_t s = 1; s < sessions; ++s) {
    indicators.emplace_back([s](T t) { return t.session == s ? 1.0 : 0.0; });
  }
  if (!indicators.empty()) add("session", 1, "", indicators);
  return all;
}

struct PushVariety : LogVariety {
  std::size_t directions = 0, sides = 0;
  double fastest = 0, slowest = INFINITY;  // m/s
  std::size_t missed = 0;
};

PushVariety variety(const Study& study, const TrialLog& log) {
  PushVariety v{log_variety(study.trials, study.cells, log)};
  std::set<int> directions, sides;
  for (const ResidualTrial& t : study.trials) {
    if (!t.push.touched) {
      ++v.missed;
      continue;
    }
    directions.insert(sector_of(t.push.direction_rad));
    sides.insert(sector_of(t.push.in_piece_rad));
    v.fastest = std::max(v.fastest, t.push.speed_m_s);
    v.slowest = std::min(v.slowest, t.push.speed_m_s);
  }
  v.directions = directions.size();
  v.sides = sides.size();
  return v;
}

bool one_speed(const PushVariety& v) { return v.fastest < 1.5 * v.slowest; }

}  // namespace

std::vector<Where> push_where(const Study& study, std::span<const Eigen::Vector3d> residuals,
                              const Problem& problem) {
  std::vector<Eigen::Vector3d> along_push;
  std::vector<Eigen::Matrix3d> covariances = study.covariances();
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& t = study.trials[i];
    const double turn_rad = t.X_WP.theta - t.push.direction_rad;
    along_push.push_back(rotation_about_z(turn_rad) * residuals[i]);
    covariances[i] = rotate_covariance(covariances[i], turn_rad);
  }
  WhereOptions options;
  options.labels = {pushes_of, push_component, push_deviation};
  options.covariates = covariates;
  return where(study.trials, along_push, covariances, study.cells, problem, options);
}

std::vector<std::string> push_cautions(const Study& study, const TrialLog& log) {
  const PushVariety v = variety(study, log);
  std::vector<std::string> text;
  const auto add_caution = [&](const std::string& sentence) { text.push_back(sentence); };
  const std::string few = few_trials_caution(study.size(), "push", "pushes");
  if (!few.empty()) add_caution(few);
  if (v.missed > 0) {
    add_caution(std::to_string(v.missed) + " of " + std::to_string(study.size()) +
                " pushes do not touch their piece where the log has it; they say little.");
  }
  if (v.typical_cell < kFewestAlike) {
    add_caution("Most pushes were done " +
                (v.typical_cell <= 1 ? std::string("once")
                                     : "about " + plain_number(v.typical_cell) + " times") +
                ", so what repeating one varies by is taken from what nothing smooth explains.");
  }
  if (v.directions < 4) {
    add_caution("The finger went in " + std::to_string(v.directions) +
                (v.directions == 1 ? " direction" : " directions") +
                " (of twelve): friction_anisotropy, table_tilt and camera_aspect need several.");
  }
  if (v.sides < 4) {
    add_caution("Pieces were pushed at " + std::to_string(v.sides) +
                (v.sides == 1 ? " side" : " sides") +
                " (of twelve): com_offset, pressure_distribution and marker_offset need several.");
  }
  if (v.width_m < 0.3) {
    add_caution("All starts lie within " + plain_number(1000 * v.width_m) +
                " mm: friction_patch and camera_distortion need several places.");
  }
  if (one_speed(v)) {
    add_caution(
        "The finger always went equally fast: friction_speed hardly shows, and finger_compliance "
        "looks like a smaller finger.");
  }
  if (one_speed(v) && study.base.count(row_of(Push::kGroundFriction)) > 0) {
    add_caution(
        "Pushes of one speed hardly show ground_friction, and an angle of table_tilt is known only "
        "in proportion to it: measure it, and give it in [parameters], not in [genes].");
  }
  if (study.sessions > 1 && study.sessions <= 8) {
    add_caution("Effects are taken to be alike in all " + std::to_string(study.sessions) +
                " sessions; what changed between them shows as a dependence on the session.");
  }
  return text;
}

std::vector<std::string> push_lacks(const Study& study, const TrialLog& log) {
  const PushVariety v = variety(study, log);
  std::vector<std::string> lacks;
  if (v.commands < 2) lacks.emplace_back("several pieces");
  if (v.directions < 4) lacks.emplace_back("pushes in several directions");
  if (v.sides < 4) lacks.emplace_back("pushes at several sides");
  if (one_speed(v)) lacks.emplace_back("several speeds");
  if (v.width_m < 0.3) lacks.emplace_back("several start places");
  return lacks;
}

TrialView push_view(const Study& study, std::size_t trial) {
  const ResidualTrial& t = study.trials[trial];
  const PushGeometry& push = t.push;
  const Eigen::Vector2d middle = transform(t.X_WS, push.p_RC);
  // Poses are those of the log's frame; the picture's origin is where that frame began.
  return {{t.X_WS.x, t.X_WS.y, push.direction_rad},
          wrap_angle(push.direction_rad - t.X_WP.theta),
          {1e3 * push.arm_m, kDegrees * push.direction_rad, kDegrees * push.in_piece_rad,
           1e3 * push.pushed_m, 1e3 * push.speed_m_s, push.along_edge, middle.x(), middle.y()}};
}

}  // namespace gapfarm
