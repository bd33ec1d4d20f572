// Profiles of fits of one or two values, by farms whose answers are closed forms.
#include "master/diagnose/fit/profile.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "master/diagnose/study.h"
#include "master/diagnose/subject.h"
#include "tests/unit/diagnose/answering_farm.h"

namespace gapfarm::profile_test {
namespace {

constexpr double kNoise_m = 1e-3;

// Ends at x and y that are functions of two parameters: of where a centre of mass is said to be, or
// others.
using Keys = std::array<std::string, 2>;
class Curve : public AnsweringFarm {
 public:
  using Place = std::function<Eigen::Vector2d(double x, double y)>;
  explicit Curve(Place place, Keys keys = {"com_offset.x", "com_offset.y"})
      : place_(std::move(place)), keys_(std::move(keys)) {}

 private:
  v1::TaskResult answer(const Problem& problem, const v1::Task& task) const override {
    ParameterValues values = problem.values;
    for (const v1::Override& o : task.predict().point().overrides()) {
      values[o.parameter()] = o.value();
    }
    const ParameterTable& table = problem.table();
    const Eigen::Vector2d at = place_(values[table.row(keys_[0])], values[table.row(keys_[1])]);
    v1::TaskResult result;
    result.set_outcome(v1::OK);
    const auto& wanted = task.predict().trials();
    for (std::uint32_t i = 0; i < problem.log.trials.size(); ++i) {
      if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), i) == wanted.end()) continue;
      v1::Predicted* predicted = result.mutable_predict()->add_predictions();
      predicted->set_trial(i);
      *predicted->mutable_end() = to_proto(Pose{at.x(), at.y(), 0});
    }
    return result;
  }

  Place place_;
  Keys keys_;
};

Problem lone_trial() {
  Problem problem;
  problem.values = problem.table().nominal();
  problem.commands = default_commands("srv1");
  Trial t;
  t.session = "s";
  t.command = problem.commands.front().name;
  t.duration_s = 1;
  problem.log.trials.push_back(t);
  return problem;
}

struct Fitted {
  Fitted(Curve::Place place, Eigen::Vector2d from)
      : farm(std::move(place)), problem(lone_trial()), predictor(farm, problem) {
    const ParameterTable& table = problem.table();
    study.subject = diagnosis_subject(problem);
    study.table = &table;
    study.trials.resize(1);
    study.whitener.assign(1, Eigen::Matrix3d::Identity() / kNoise_m);
    EffectCandidate effect;
    effect.signature.effect = "com_offset";
    const Overrides start = {{table.row("com_offset.x"), from.x()},
                             {table.row("com_offset.y"), from.y()}};
    const Eigen::MatrixXd none(3, 0);
    auto fit = fit_jointly(predictor, study, {effect}, start, BaseParameters::kHeld, none, kSteps);
    EXPECT_TRUE(fit.ok()) << fit.error().message;
    before = *fit;
    auto looked = profiled(predictor, study, {effect}, std::move(*fit));
    EXPECT_TRUE(looked.ok()) << looked.error().message;
    after = *looked;
  }

  static constexpr int kSteps = 4;
  Curve farm;
  Problem problem;
  Predictor predictor;
  Study study;
  JointFit before, after;
};

TEST(Profile, WidensNothingOfAStraightLine) {
  const Fitted f([](double x, double y) { return Eigen::Vector2d(x + y, x - y); }, {3e-3, 1e-3});
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(f.after.parameters[k].value, 0, 1e-6);
    EXPECT_NEAR(f.after.parameters[k].bent, 1, 1e-3);
    EXPECT_NEAR(f.after.parameters[k].standard_error, kNoise_m / std::sqrt(2), 1e-6);
  }
}

// A drag over a friction: in logarithms its valley is straight, and the friction's prior decides.
TEST(Profile, WidensNothingOfAQuotient) {
  Curve farm([](double drag, double friction) { return Eigen::Vector2d(drag / friction, 0); },
             {"rolling_resistance.coefficient", "friction"});
  const Problem problem = lone_trial();
  Predictor predictor(farm, problem);
  const ParameterTable& table = problem.table();
  const std::size_t drag = table.row("rolling_resistance.coefficient"),
                    friction = table.row("friction");
  Study study;
  study.subject = diagnosis_subject(problem);
  study.table = &table;
  study.trials.resize(1);
  study.trials[0].X_WE = {0.5, 0, 0};
  study.whitener.assign(1, Eigen::Matrix3d::Identity() / kNoise_m);
  study.base = {{friction, 0.4}};
  study.base_parameters = {{friction, 0.3}};
  EffectCandidate effect;
  effect.signature.effect = "rolling_resistance";
  const auto fit = fit_jointly(predictor, study, {effect}, {{drag, 0.1}, {friction, 0.4}},
                               BaseParameters::kFitted, Eigen::MatrixXd(3, 0), 8);
  ASSERT_TRUE(fit.ok()) << fit.error().message;
  const auto looked = profiled(predictor, study, {effect}, *fit);
  ASSERT_TRUE(looked.ok()) << looked.error().message;
  const FittedParameter &found = looked->parameters[1], &beside = looked->parameters[0];
  EXPECT_NEAR(found.value / beside.value, 0.5, 1e-3);
  EXPECT_NEAR(found.standard_error / found.value, std::hypot(0.3, kNoise_m / 0.5), 0.01);
  EXPECT_NEAR(found.bent, 1, 1e-3);
}

// Two standard errors of the slopes to either side a saturating end has moved by tanh(2).
TEST(Profile, WidensAsTheEndsSaturate) {
  const auto saturating = [](double x, double y) {
    return Eigen::Vector2d(kNoise_m * std::tanh(x / kNoise_m), y);
  };
  const Fitted f(saturating, {0, 0});
  const double per_unit = f.before.jacobian(0, 0) * kNoise_m;  // of a finite step
  const double aside = 2 / per_unit;
  EXPECT_NEAR(f.after.parameters[0].bent, 2 / std::tanh(aside), 0.02);
  EXPECT_NEAR(f.after.parameters[1].bent, 1, 1e-3);
}

// The same along a valley that bends: straight on, its wall hides that it is flat.
TEST(Profile, OthersFollowRoundABend) {
  const auto valley = [](double x, double y) {
    return Eigen::Vector2d(kNoise_m * std::tanh(x / kNoise_m), 5 * (y - 500 * x * x));
  };
  const Fitted f(valley, {0, 0});
  EXPECT_NEAR(f.after.parameters[0].bent, 2 / std::tanh(2), 0.05);
}

// Slopes know nothing of a step beyond which the ends are right.
TEST(Profile, GoesOnBeyondALedge) {
  const auto ledge = [](double x, double) {
    return Eigen::Vector2d(0.5 * (x - 0.5e-3), x > 1e-3 ? 0 : 3e-3);
  };
  const Fitted f(ledge, {0, 0});
  const Eigen::MatrixXd none(3, 0);
  EXPECT_NEAR(misfit_of(f.study, f.before, none), 9, 0.1);
  EXPECT_LT(misfit_of(f.study, f.after, none), 1);
  EXPECT_GT(f.after.parameters[0].value, 1e-3);
}

}  // namespace
}  // namespace gapfarm::profile_test
