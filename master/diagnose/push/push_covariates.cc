// What the ends of pushes may depend on: in columns, and where they go wrong in words and pictures.
#include <algorithm>
#include <cmath>
#include <functional>

#include "common/parameters/table.h"
#include "master/diagnose/fit/slopes.h"
#include "master/diagnose/places/where.h"
#include "master/diagnose/push/push_subject.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// What a simulation of other physics gets wrong of one push by itself, along it, across it and in
// turn, as kMisfit is of all: root mean squares of the means of repeats by a simulator with
// friction all over the face (docs/pushing.md).
constexpr double kConditionMisfit[] = {0.02, 0.01, 0.01};
constexpr double kFarArm = 2;  // gyration radii: beyond, the finger slips off

double arm(const ResidualTrial& t) {
  return std::clamp(t.push.arm_m / t.push.gyration_m, -kFarArm, kFarArm);
}

// A length by component: along, across, turn.
Eigen::Vector3d by_component(const ResidualTrial& t, double length_m) {
  return {length_m, length_m, length_m / t.push.gyration_m};
}

Eigen::VectorXd column(const Study& study, int component, const Feature& feature) {
  return study.whiten(mapped(study.trials, [&](const ResidualTrial& t) {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    shift[component] = t.push.touched ? feature(t) : 0;
    return from_push_axes(t, shift);
  }));
}

// What another physics gets wrong grows with.
Eigen::Vector3d misfit(const ResidualTrial& t) { return by_component(t, t.push.pushed_m); }

CovariateBlock block(const Study& study, const std::string& name,
                     const std::vector<Feature>& features) {
  std::vector<Eigen::VectorXd> columns;
  for (const Feature& feature : features) {
    for (int k = 0; k < 3; ++k) {
      columns.push_back(column(study, k, [&](const ResidualTrial& t) {
        return feature(t) * by_component(t, t.spread.slid_m)[k];
      }));
    }
  }
  return {name, stack(columns)};
}

// World-frame shifts of the readings that depend on the pose: the end's, less what the start's
// does to the end.
CovariateBlock readings(const Study& study) {
  std::vector<Eigen::VectorXd> columns;
  for (const auto& power : powers_of_place(study)) {
    for (int k = 0; k < 2; ++k) {
      columns.push_back(
          study.whiten(mapped(study.trials, [&](const ResidualTrial& t) -> Eigen::Vector3d {
            return power(t.X_WP) * rotation_about_z(-t.X_WP.theta).col(k) -
                   power(t.X_WS) * t.spread.start.col(k);
          })));
    }
  }
  return {"place of the readings", stack(columns)};
}

std::vector<Feature> powers(const Feature& value, int most) {
  std::vector<Feature> features;
  for (int p = 1; p <= most; ++p) {
    features.push_back([=](const ResidualTrial& t) { return std::pow(value(t), p); });
  }
  return features;
}

// `value` less its mean, over its standard deviation; 0 where it hardly varies.
Feature standardised(const Study& study, const Feature& value, double least_sd) {
  using T = const ResidualTrial&;
  const auto n = static_cast<double>(study.size());
  const double mean = sum_of(study.trials, [&](T t) { return value(t) / n; });
  const double sd =
      std::sqrt(sum_of(study.trials, [&](T t) { return std::pow(value(t) - mean, 2) / n; }));
  if (sd < least_sd) return [](const ResidualTrial&) { return 0.0; };
  return [=](const ResidualTrial& t) { return std::clamp((value(t) - mean) / sd, -3.0, 3.0); };
}

std::vector<Feature> in_each_piece(const Study& study, const std::vector<Feature>& features) {
  const auto most = static_cast<std::size_t>(max_of(study.trials, &ResidualTrial::command));
  std::vector<Feature> all;
  for (std::size_t c = 0; c <= most; ++c) {
    for (const Feature& f : features) {
      all.push_back([=](const ResidualTrial& t) { return t.command == c ? f(t) : 0.0; });
    }
  }
  return all;
}

// Offsets and retuning that go with features: what changes from session to session, or meanwhile.
CovariateBlock retuned_block(const Study& study, const std::string& name,
                             const std::vector<Feature>& features) {
  const Eigen::MatrixXd offsets = block(study, name, features).columns;
  std::vector<Eigen::VectorXd> columns(offsets.colwise().begin(), offsets.colwise().end());
  for (const Feature& feature : features) {
    for (const RetunedPush& retuned : study.retuned) {
      std::vector<Eigen::Vector3d> d = retuned.slopes;
      for (std::size_t i = 0; i < d.size(); ++i) d[i] *= feature(study.trials[i]);
      columns.push_back(study.whiten(d));
    }
  }
  return {name, stack(columns)};
}

// Of all but the first.
std::vector<Feature> later_sessions(const Study& study) {
  std::vector<Feature> all;
  for (std::size_t s = 1; s < study.sessions; ++s) {
    all.push_back([s](const ResidualTrial& t) { return t.session == s ? 1.0 : 0.0; });
  }
  return all;
}

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
  using T = const ResidualTrial&;
  std::vector<WhereCovariate> all;
  const auto add = [&](const std::string& name, const std::vector<Feature>& features,
                       double unit = 1, const std::string& each = "") {
    const auto of_touched = [](const Feature& f) -> Feature {
      return [=](T t) { return t.push.touched ? f(t) : 0; };
    };
    add_covariate({name, {}, false, false, unit, each}, trials, mapped(features, of_touched), &all);
  };
  add("contact offset", {[](T t) { return t.push.arm_m; }}, 0.01,
      "with every 10 mm that the centroid lies farther left of the push");
  add("place of the touch", {[](T t) { return t.push.along_edge; }}, 0.1,
      "with every tenth of the half edge that the touch lies farther on");
  for (const int h : {1, 2}) {
    const std::string times = h == 1 ? "" : ", twice a turn";
    add("push direction" + times, harmonics([h](T t) { return h * t.push.direction_rad; }, 1));
    add("side of the piece" + times, harmonics([h](T t) { return h * t.push.in_piece_rad; }, 1));
  }
  add("start heading", harmonics([](T t) { return t.X_WS.theta; }, 1));
  add("distance pushed", {[](T t) { return t.push.pushed_m; }}, 0.01,
      "with every 10 mm of the finger's way");
  add("finger speed", {[](T t) { return t.push.speed_m_s; }}, 0.01,
      "with every 10 mm/s of the finger");
  add("start x", {[](T t) { return t.X_WS.x; }}, 0.1,
      "with every 100 mm that they start farther along x");
  add("start y", {[](T t) { return t.X_WS.y; }}, 0.1,
      "with every 100 mm that they start farther along y");
  add("order", {[](T t) { return t.context.session_time_s / 60; }}, 1 / 60.0,
      "with every second of the session");
  const std::vector<Feature> sessions = session_features(trials);
  if (!sessions.empty()) add("session", sessions);
  return all;
}

struct PushVariety : LogVariety {
  std::size_t directions = 0, sides = 0;
  double fastest = 0, slowest = INFINITY;  // m/s
  std::size_t missed = 0;
};

PushVariety variety(const Study& study, const TrialLog& log) {
  PushVariety v{log_variety(study.trials, study.cells, log)};
  const std::vector<PushGeometry> pushes =
      filtered(mapped(study.trials, &ResidualTrial::push), &PushGeometry::touched);
  v.missed = study.size() - pushes.size();
  v.directions = distinct(pushes, [](const PushGeometry& p) { return sector_of(p.direction_rad); });
  v.sides = distinct(pushes, [](const PushGeometry& p) { return sector_of(p.in_piece_rad); });
  for (const PushGeometry& push : pushes) {
    v.fastest = std::max(v.fastest, push.speed_m_s);
    v.slowest = std::min(v.slowest, push.speed_m_s);
  }
  return v;
}

bool one_speed(const PushVariety& v) { return v.fastest < 1.5 * v.slowest; }

}  // namespace

Result<Eigen::MatrixXd> push_nuisances(Predictor& predictor, Study& study) {
  study.misfit_columns = 0;
  study.misfit_expected = rests_on_its_face(predictor.problem().values) ? kSoundMisfit : 0;
  std::vector<Eigen::VectorXd> columns;
  for (const RetunedPush& retuned : study.retuned) {
    columns.push_back(retuned.parameter.prior_log_sd * study.whiten(retuned.slopes));
  }
  constexpr double kMargin_m = 5e-4;
  ASSIGN_OR_RETURN(
      const auto margin,
      probe_all(predictor, study, {{"", {{"contact_margin", kMargin_m}}, {}, kMargin_m}}));
  columns.push_back(kOutline_m * study.whiten(margin.front()));
  // Alike for a push and its mirror image: along it even in the arm, across it and in turn odd.
  for (int component = 0; component < 3; ++component) {
    for (int power = component == 0 ? 0 : 1; power <= 3; power += 2) {
      columns.push_back(kMisfit * column(study, component, [&](const ResidualTrial& t) {
                          return misfit(t)[component] * std::pow(arm(t), power);
                        }));
    }
  }
  for (std::size_t c = 0; c < study.cells.size(); ++c) {
    if (study.cells[c].trials < kFewestAlike) continue;
    for (int component = 0; component < 3; ++component) {
      const auto here = [&](const ResidualTrial& t) {
        return t.cell == c ? misfit(t)[component] : 0.0;
      };
      columns.push_back(kConditionMisfit[component] * column(study, component, here));
      ++study.misfit_columns;
    }
  }
  return stack(columns);
}

std::vector<CovariateBlock> push_blocks(const Study& study) {
  const Feature one = [](const ResidualTrial&) { return 1.0; };
  const auto direction = [](const ResidualTrial& t) { return t.push.direction_rad; };
  const auto in_piece = [](const ResidualTrial& t) { return t.push.in_piece_rad; };
  const auto slid = standardised(
      study, [](const ResidualTrial& t) { return t.spread.slid_m; }, 1e-3);
  const auto speed = standardised(
      study, [](const ResidualTrial& t) { return t.push.speed_m_s; }, 1e-3);
  const auto order = standardised(
      study, [](const ResidualTrial& t) { return t.context.session_time_s; }, 1);

  std::vector<CovariateBlock> blocks = {
      block(study, "piece", in_each_piece(study, {one})),
      block(study, "contact offset", powers(arm, 3)),
      block(study, "place of the touch on its edge",
            powers([](const ResidualTrial& t) { return t.push.along_edge; }, 3)),
      block(study, "side of the piece", in_each_piece(study, harmonics(in_piece, 2))),
      block(study, "push direction", harmonics(direction, 1)),
      block(study, "push direction, twice a turn",
            harmonics([=](const ResidualTrial& t) { return 2 * direction(t); }, 1)),
      block(study, "start heading",
            harmonics([](const ResidualTrial& t) { return t.X_WS.theta; }, 2)),
      block(study, "start place", start_place(study)),
      readings(study),
      block(study, "distance slid", powers(slid, 2)),
      block(study, "finger speed", powers(speed, 2)),
      retuned_block(study, "order of the pushes", powers(order, 2))};
  if (study.sessions > 1 && study.sessions <= 8) {
    blocks.push_back(retuned_block(study, "session", later_sessions(study)));
  }
  return blocks;
}

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
  return where(study.trials, along_push, covariances, study.cells, problem,
               {pushes_of, push_component, push_deviation, covariates});
}

std::vector<std::string> push_cautions(const Study& study, const TrialLog& log) {
  const PushVariety v = variety(study, log);
  const std::string few = few_trials_caution(study.size(), "push", "pushes");
  return stated(
      {{!few.empty(), few},
       {v.missed > 0,
        std::to_string(v.missed) + " of " + std::to_string(study.size()) +
            " pushes do not touch their piece where the log has it; they say little."},
       {v.typical_cell < kFewestAlike,
        "Most pushes were done " + times_text(v.typical_cell) +
            ", so what repeating one varies by is taken from what nothing smooth explains."},
       {v.directions < 4,
        "The finger went in " + counted(v.directions, "direction", "directions") +
            " (of twelve): friction_anisotropy, table_tilt and camera_aspect need several."},
       {v.sides < 4,
        "Pieces were pushed at " + counted(v.sides, "side", "sides") +
            " (of twelve): com_offset, pressure_distribution and marker_offset need several."},
       {v.width_m < 0.3, "All starts lie within " + plain_number(1000 * v.width_m) +
                             " mm: friction_patch and camera_distortion need several places."},
       {one_speed(v),
        "The finger always went equally fast: friction_speed hardly shows, and finger_compliance "
        "looks like a smaller finger."},
       {one_speed(v) && study.base.count(row_of(Push::kGroundFriction)) > 0,
        "Pushes of one speed hardly show ground_friction, and an angle of table_tilt is known only "
        "in proportion to it: measure it, and give it in [parameters], not in [genes]."},
       {study.sessions > 1 && study.sessions <= 8,
        "Effects are taken to be alike in all " + std::to_string(study.sessions) +
            " sessions; what changed between them shows as a dependence on the session."}});
}

std::vector<std::string> push_lacks(const Study& study, const TrialLog& log) {
  const PushVariety v = variety(study, log);
  return stated({{v.commands < 2, "several pieces"},
                 {v.directions < 4, "pushes in several directions"},
                 {v.sides < 4, "pushes at several sides"},
                 {one_speed(v), "several speeds"},
                 {v.width_m < 0.3, "several start places"}});
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
