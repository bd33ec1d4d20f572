#include <algorithm>
#include <cmath>

#include "common/parameters/table.h"
#include "master/diagnose/fit/slopes.h"
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

// Retuning in one session and not in another, and offsets of its own.
CovariateBlock sessions_block(const Study& study) {
  std::vector<Eigen::VectorXd> columns;
  for (std::size_t s = 1; s < study.sessions; ++s) {
    const Feature here = [s](const ResidualTrial& t) { return t.session == s ? 1.0 : 0.0; };
    const Eigen::MatrixXd offsets = block(study, "", {here}).columns;
    for (Eigen::Index k = 0; k < offsets.cols(); ++k) columns.push_back(offsets.col(k));
    for (const RetunedPush& retuned : study.retuned) {
      std::vector<Eigen::Vector3d> d = retuned.slopes;
      for (std::size_t i = 0; i < d.size(); ++i) d[i] *= here(study.trials[i]);
      columns.push_back(study.whiten(d));
    }
  }
  return {"session", stack(columns)};
}

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
      block(study, "order of the pushes", powers(order, 2))};
  if (study.sessions > 1 && study.sessions <= 8) blocks.push_back(sessions_block(study));
  return blocks;
}

}  // namespace gapfarm
