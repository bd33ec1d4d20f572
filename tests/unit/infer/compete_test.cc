// Hypotheses compete on a world whose forward model is a formula: what is found is known.
#include "master/infer/compete.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/parameters/table.h"
#include "common/random/stream.h"
#include "master/infer/certificate.h"

namespace gapfarm::infer {
namespace {

constexpr std::size_t kObservations = 60;
constexpr double kNoise = 0.01;
constexpr double kOutlier = 1.5;  // m; one observation in twelve

std::size_t row(const char* key) { return push_table().row(key); }

double value(const Overrides& at, const char* key) {
  const auto found = at.find(row(key));
  return found == at.end() ? push_table()[row(key)].nominal : found->second;
}

// Ends of pieces that a table pulls along and its friction holds back; a camera that is a
// saturating function of its offset, so that slopes taken far away point at something else.
Pose end_of(std::size_t i, const Overrides& at) {
  const double a = 0.37 * static_cast<double>(i);
  const double friction = value(at, "finger_friction");
  const double pull = value(at, "table_tilt.angle"), to = value(at, "table_tilt.direction");
  const double shift = std::tanh(20 * value(at, "com_offset.x"));
  return {std::cos(a) * friction + 3 * pull * std::cos(to) * (1 + 0.3 * std::sin(3 * a)),
          std::sin(a) * friction + 3 * pull * std::sin(to) * (1 + 0.3 * std::sin(3 * a)),
          shift * std::cos(2 * a)};
}

Forward forward() {
  return [](const std::vector<PredictionRequest>& points)
             -> Result<std::vector<std::optional<std::vector<Pose>>>> {
    std::vector<std::optional<std::vector<Pose>>> all;
    for (const PredictionRequest& point : points) {
      std::vector<Pose> ends;
      if (point.trials.empty()) {
        for (std::size_t i = 0; i < kObservations; ++i) ends.push_back(end_of(i, point.at));
      }
      for (const std::uint32_t i : point.trials) ends.push_back(end_of(i, point.at));
      all.push_back(std::move(ends));
    }
    return all;
  };
}

Observations observed(const Overrides& truth, bool outliers = false, std::uint64_t seed = 7) {
  Observations o;
  Stream stream({seed, Purpose::kStatistics, 0, 0, 0});
  for (std::size_t i = 0; i < kObservations; ++i) {
    Pose end = end_of(i, truth);
    end = end * Pose{kNoise * stream.normal(), kNoise * stream.normal(), kNoise * stream.normal()};
    if (outliers && i % 12 == 5) end.x += kOutlier;
    o.measured.push_back(end);
    o.whitener.push_back(Eigen::Matrix3d::Identity() / kNoise);
    o.fold.push_back(i % 5);
  }
  return o;
}

Coordinate friction() {
  Coordinate c;
  c.kind = Coordinate::Kind::kLogarithm;
  c.row = row("finger_friction");
  c.size = 0.5;
  return c;
}

Hypothesis tilt() {
  Coordinate c;
  c.kind = Coordinate::Kind::kPolar;
  c.row = row("table_tilt.angle");
  c.direction_row = row("table_tilt.direction");
  c.size = 0.03;
  c.prior_sd = kPriorSizes;
  return {"table_tilt", {c}, {}, true};
}

Hypothesis offset() {
  Coordinate c;
  c.row = row("com_offset.x");
  c.size = 0.003;
  c.prior_sd = kPriorSizes;
  return {"com_offset", {c}, {}, true};
}

Model base_of(const Forward& f, const Observations& o) {
  const Space space(push_table(), {friction()});
  const Fitter fitter(f, o, space);
  Fit fit = fitter.start(space.from({{row("finger_friction"), 0.2}})).value();
  EXPECT_TRUE(fitter.improve(&fit, 20));
  return model_of(f, o, space, std::move(fit)).value();
}

TEST(InferModel, OfAPointThatCannotBeSimulatedIsAnError) {
  const Forward diverges = [](const std::vector<PredictionRequest>& points)
      -> Result<std::vector<std::optional<std::vector<Pose>>>> {
    return std::vector<std::optional<std::vector<Pose>>>(points.size());
  };
  const Observations o = observed({});
  const Space space(push_table(), {friction()});
  const Fitter fitter(diverges, o, space);
  Fit fit = fitter.start(space.from({})).value();
  EXPECT_TRUE(fitter.improve(&fit, 20));
  const auto model = model_of(diverges, o, space, std::move(fit));
  ASSERT_FALSE(model.ok());
  EXPECT_EQ(model.error().code, ErrorCode::kSimulation);
}

TEST(InferSpace, GoesThereAndBack) {
  const Space space = Space(push_table(), {friction()}).with(tilt().coordinates);
  const Overrides values = {{row("finger_friction"), 0.31},
                            {row("table_tilt.angle"), 0.05},
                            {row("table_tilt.direction"), -2.1}};
  const Overrides back = space.values(space.from(values));
  for (const auto& [r, v] : values) EXPECT_NEAR(back.at(r), v, 1e-12) << push_table()[r].key;
}

TEST(InferSpace, ADirectionHasNoSeam) {
  const Space space(push_table(), tilt().coordinates);
  const double pi = std::numbers::pi;
  const auto at = [&](double direction) {
    return space.from({{row("table_tilt.angle"), 0.05}, {row("table_tilt.direction"), direction}});
  };
  EXPECT_LT((at(pi - 1e-6) - at(-pi + 1e-6)).norm(), 1e-4);
}

TEST(InferSpace, AnAngleGoesRoundAndConstantsStay) {
  Coordinate c;
  c.kind = Coordinate::Kind::kAngle;
  c.row = row("table_tilt.direction");
  c.size = 0.2;
  const Space space =
      Space(push_table(), {c})
          .holding({{row("table_tilt.angle"), 0.04}, {row("table_tilt.direction"), 1}});
  Eigen::VectorXd u = space.from({{row("table_tilt.direction"), 3.0}});
  EXPECT_NEAR(u[0], 15, 1e-9);
  u[0] += 1;  // beyond half a turn
  const Overrides values = space.values(u);
  EXPECT_NEAR(values.at(row("table_tilt.direction")), 3.2 - 2 * std::numbers::pi, 1e-9);
  EXPECT_EQ(values.at(row("table_tilt.angle")), 0.04);
}

// What a column may explain to first order no parameter has to.
TEST(InferFit, AColumnTakesItsPartWithoutASimulation) {
  std::size_t asked = 0;
  const Forward f = remembering([&](const std::vector<PredictionRequest>& points) {
    asked += points.size();
    return forward()(points);
  });
  Observations o = observed({{row("finger_friction"), 0.2}});
  o.columns = Eigen::MatrixXd::Zero(3 * kObservations, 1);
  for (std::size_t i = 0; i < kObservations; ++i) {
    const Pose end = end_of(i, {{row("finger_friction"), 0.2}});
    o.columns(static_cast<Eigen::Index>(3 * i), 0) = std::cos(end.theta) / kNoise * 0.02;
    o.columns(static_cast<Eigen::Index>(3 * i) + 1, 0) = -std::sin(end.theta) / kNoise * 0.02;
    o.measured[i].x += 0.03;  // one and a half of the column
  }
  Coordinate column;
  column.kind = Coordinate::Kind::kColumn;
  const Space space(push_table(), {column}, {{row("finger_friction"), 0.2}});
  const Fitter fitter(f, o, space);
  Fit fit = fitter.start(Eigen::VectorXd::Zero(1)).value();
  const double before = fit.score;
  EXPECT_TRUE(fitter.improve(&fit, 10));
  EXPECT_NEAR(fit.u[0], 1.5, 0.1);
  EXPECT_GT(fit.score, before + 50);
  EXPECT_EQ(asked, 1u);
}

// Half of the observations show the value as well, and no others are simulated.
TEST(InferFit, AsksForSomeAlone) {
  Observations o = observed({{row("finger_friction"), 0.6}});
  for (std::uint32_t i = 0; i < kObservations; ++i) {
    o.weight.push_back(i % 2);
    if (i % 2 == 1) o.asked.push_back(i);
  }
  const Forward f = [&](const std::vector<PredictionRequest>& points) {
    for (const PredictionRequest& p : points) EXPECT_EQ(p.trials, o.asked);
    return forward()(points);
  };
  const Model base = base_of(f, o);
  EXPECT_NEAR(base.space.values(base.fit.u).at(row("finger_friction")), 0.6, 0.02);
}

TEST(InferFit, FindsTheValueDespiteOutliers) {
  const Forward f = forward();
  const Observations o = observed({{row("finger_friction"), 0.6}}, /*outliers=*/true);
  const Model base = base_of(f, o);
  EXPECT_NEAR(base.space.values(base.fit.u).at(row("finger_friction")), 0.6, 0.01);
  EXPECT_LT(base.fit.scale, 2);
}

// Wherever they lie, in the fit, its score and what is held out.
TEST(InferFit, ObservationsWithoutWeightTeachNothing) {
  const Forward f = forward();
  Observations o = observed({{row("finger_friction"), 0.6}});
  o.weight.assign(kObservations, 2);
  const auto fitted = [&](double away) {
    for (std::size_t i = 0; i < kObservations; i += 3) {
      o.weight[i] = 0;
      o.measured[i].x += away;
    }
    return base_of(f, o);
  };
  const Model near = fitted(0.02), far = fitted(1);
  EXPECT_NEAR(near.fit.u[0], far.fit.u[0], 1e-9);
  EXPECT_NEAR(near.fit.score, far.fit.score, 1e-9);
  EXPECT_EQ(far.held_out[3], 0);
  EXPECT_NEAR(near.held_out[4], far.held_out[4], 1e-9);
}

// Of three logs alike the one without a prior is fitted at its own value, the others between that
// and where the prior has it.
TEST(InferFit, APriorPullsToItsCentre) {
  const Forward f = forward();
  const Observations o = observed({{row("finger_friction"), 0.6}});
  const auto fitted = [&](double prior_sd) {
    Coordinate c = friction();
    c.centre = std::log(0.3) / c.size;
    c.prior_sd = prior_sd;
    const Space space(push_table(), {c});
    const Fitter fitter(f, o, space);
    Fit fit = fitter.start(space.from({{row("finger_friction"), 0.5}})).value();
    EXPECT_TRUE(fitter.improve(&fit, 20));
    return space.values(fit.u).at(row("finger_friction"));
  };
  EXPECT_NEAR(fitted(INFINITY), 0.6, 0.01);
  EXPECT_LT(fitted(0.01), fitted(INFINITY) - 0.01);
  EXPECT_NEAR(fitted(1e-5), 0.3, 0.01);
}

TEST(InferCompete, NamesWhatActsWithItsSize) {
  const Forward f = forward();
  const Observations o = observed({{row("finger_friction"), 0.6},
                                   {row("table_tilt.angle"), 0.08},
                                   {row("table_tilt.direction"), 2.9}},
                                  /*outliers=*/true);
  const std::vector<Hypothesis> both = {offset(), tilt()};
  const auto contest = compete(f, o, base_of(f, o), both, {}, nullptr);
  ASSERT_TRUE(contest) << contest.error().message;
  ASSERT_FALSE(contest->contenders.empty());
  const Contender& best = contest->contenders.front();
  EXPECT_EQ(both[best.hypothesis].name, "table_tilt");
  EXPECT_GT(best.gain, 5 * best.gain_se);
  const Overrides at = best.model.space.values(best.model.fit.u);
  EXPECT_NEAR(at.at(row("table_tilt.angle")), 0.08, 0.004);
  EXPECT_NEAR(at.at(row("table_tilt.direction")), 2.9, 0.05);
}

TEST(InferCompete, NothingIsGainedWhereNothingActs) {
  const Forward f = forward();
  const Observations o = observed({{row("finger_friction"), 0.6}});
  const auto contest = compete(f, o, base_of(f, o), {offset(), tilt()}, {}, nullptr);
  ASSERT_TRUE(contest) << contest.error().message;
  EXPECT_NEAR(contest->base.fit.scale, 1, 0.25);
  for (const Contender& c : contest->contenders) EXPECT_LT(c.gain, kLeastPromise);
}

// Drives end elsewhere where they cross a disc, in jumps as wide as a step of the simulation:
// slopes are 0 or of one jump, and the search without them finds the disc's place.
TEST(InferCompete, FindsAPlaceWhereSlopesAreOfNoUse) {
  constexpr double kStep_m = 0.05, kRadius_m = 0.2;
  const auto inside = [](std::size_t i, const Overrides& at) {
    const double across = 0.03 * static_cast<double>(i % 30) - 0.4;
    const double off = across - value(at, i < 30 ? "friction_patch.x" : "friction_patch.y");
    return std::floor(std::max(0.0, kRadius_m - std::abs(off)) / kStep_m) * kStep_m;
  };
  const Forward f = [&](const std::vector<PredictionRequest>& points)
      -> Result<std::vector<std::optional<std::vector<Pose>>>> {
    std::vector<std::optional<std::vector<Pose>>> all;
    for (const PredictionRequest& point : points) {
      std::vector<Pose>& ends = all.emplace_back().emplace();
      const bool some = !point.trials.empty();
      for (std::size_t k = 0; k < (some ? point.trials.size() : kObservations); ++k) {
        const double less = 1 - value(point.at, "friction_patch.ratio");
        ends.push_back({less * inside(some ? point.trials[k] : k, point.at), 0, 0});
      }
    }
    return all;
  };
  const auto disc = [](double x, double y) {
    return Overrides{{row("friction_patch.x"), x},
                     {row("friction_patch.y"), y},
                     {row("friction_patch.ratio"), 0.5}};
  };
  const double x = 0.031, y = -0.043;
  Observations o = observed({});
  for (std::uint32_t i = 0; i < kObservations; ++i) {
    o.measured[i] = (**f({{disc(x, y), {i}}})->begin())[0] * Pose{0, kNoise * (i % 3 - 1.0), 0};
  }
  Hypothesis patch;
  patch.name = "friction_patch";
  for (const char* key : {"friction_patch.x", "friction_patch.y"}) {
    Coordinate& c = patch.coordinates.emplace_back();
    c.row = row(key);
    c.size = 0.05;
  }
  patch.from_neutral = false;
  patch.starts = {{disc(x + 0.09, y - 0.08), {}}};
  const auto found = [&](const Hypothesis& h) {
    const auto contest = compete(f, o, base_of(f, o), {h}, {Effort::kLocal, {}, 1}, nullptr);
    const Model& model = contest.value().contenders.at(0).model;
    return model.space.values(model.fit.u);
  };
  patch.promised = 1e6;
  patch.touched = [&](const Overrides& at) {
    std::vector<std::uint32_t> touched;
    for (std::uint32_t i = 0; i < kObservations; ++i) {
      if (inside(i, at) > 0) touched.push_back(i);
    }
    return touched;
  };
  const Overrides at = found(patch);
  EXPECT_NEAR(at.at(row("friction_patch.x")), x, 0.02);
  EXPECT_NEAR(at.at(row("friction_patch.y")), y, 0.02);
}

// What the world's frame is must not matter: a quarter turn of the cause turns the answer.
TEST(InferCompete, TurnsWithTheCause) {
  const Forward f = forward();
  for (const double direction : {-1.5, 0.0, 1.5, 3.0}) {
    const Observations o = observed({{row("finger_friction"), 0.6},
                                     {row("table_tilt.angle"), 0.06},
                                     {row("table_tilt.direction"), direction}});
    const auto contest = compete(f, o, base_of(f, o), {tilt()}, {}, nullptr);
    ASSERT_TRUE(contest) << contest.error().message;
    ASSERT_EQ(contest->contenders.size(), 1u) << direction;
    const Model& model = contest->contenders.front().model;
    EXPECT_NEAR(model.space.values(model.fit.u).at(row("table_tilt.direction")), direction, 0.05);
  }
}

// A line's offset and rise (x from 0 to 5, noise 0.5), and the rise where the offset is known to
// 0.1.
TEST(InferCertificate, BoundIsTheCovarianceOfALine) {
  Eigen::MatrixXd slopes(6, 2);
  for (int i = 0; i < 6; ++i) slopes.row(i) << 1 / 0.5, i / 0.5;
  const Eigen::VectorXd least = least_deviations(information(slopes, Eigen::MatrixXd(6, 0)));
  EXPECT_NEAR(least[1], 0.5 / std::sqrt(17.5), 1e-12);
  EXPECT_NEAR(least[0], 0.5 * std::sqrt(1.0 / 6 + 2.5 * 2.5 / 17.5), 1e-12);
  const auto with = [&](double known) {
    return least_deviations(information(slopes.col(1), slopes.col(0) * known))[0];
  };
  EXPECT_NEAR(with(1e4), 0.5 / std::sqrt(17.5), 1e-6);
  EXPECT_NEAR(with(1e-6), 0.5 / std::sqrt(55), 1e-6);
  Eigen::Matrix2d blind = Eigen::Matrix2d::Zero();
  blind(0, 0) = 4;
  EXPECT_EQ(least_deviations(blind)[0], 0.5);
  EXPECT_EQ(least_deviations(blind)[1], INFINITY);
}

// Each hypothesis by itself, at the size that the slopes of a log without it promise.
TEST(InferCertificate, NamesWhatItCallsDetectableAsOftenAsPromised) {
  constexpr int kLogs = 200;
  constexpr double kLeastGain = 9;  // nats
  const Forward f = forward();
  for (const Hypothesis& h : {offset(), tilt()}) {
    const Observations nothing = observed({{row("finger_friction"), 0.6}});
    const Model base = base_of(f, nothing);
    const Space own = base.space.only(h.coordinates);
    Fit fit = base.fit;
    fit.u.conservativeResize(1 + own.dimensions());
    fit.u.tail(own.dimensions()) = own.from({});
    ASSERT_TRUE(Fitter(f, nothing, base.space.with(h.coordinates)).differentiate(&fit, 1));
    const Eigen::MatrixXd I =
        information(fit.slopes.rightCols(own.dimensions()), 100 * fit.slopes.leftCols(1));
    const double size = std::sqrt(detectable_squares(kLeastGain, own.dimensions()) / I(0, 0));
    Overrides truth = own.values(own.from({}) + size * Eigen::VectorXd::Unit(own.dimensions(), 0));
    truth[row("finger_friction")] = 0.6;
    int named = 0;
    for (int k = 0; k < kLogs; ++k) {
      const Observations o = observed(truth, false, 1000 + static_cast<std::uint64_t>(k));
      const auto contest = compete(f, o, base_of(f, o), {h}, {}, nullptr);
      ASSERT_TRUE(contest);
      const std::vector<Contender>& all = contest->contenders;
      named +=
          !all.empty() && all[0].gain >= kLeastGain && all[0].gain >= kLeastSure * all[0].gain_se;
    }
    EXPECT_NEAR(named, kDetectablePower * kLogs, 0.05 * kLogs) << h.name;
  }
}

TEST(InferCompete, PairedGainsKnowTheirError) {
  const PairedGain gain = paired_gain({1, 2, 3, 2}, {0, 1, 2, 1});
  EXPECT_DOUBLE_EQ(gain.sum, 4);
  EXPECT_DOUBLE_EQ(gain.se, 0);
}

}  // namespace
}  // namespace gapfarm::infer
