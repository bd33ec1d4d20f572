#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "common/random/stream.h"
#include "master/diagnose/subject.h"
#include "tests/immediate_farm.h"

namespace gapfarm::next_experiment_test {
namespace {

constexpr double kSd = 0.01;

struct Seen {
  const v1::Trial& trial;
  const v1::Trial* before;  // in its session
  double strength = 0;      // the point's only override, 0 without one
};

// Predicts every trial's end at its start, moved in x (own axes) as `shift` says.
class FakeFarm : public tests::ImmediateFarm {
 public:
  explicit FakeFarm(std::function<double(const Seen&)> shift) : shift_(std::move(shift)) {}

  std::string add_problem(const v1::Problem& problem) override {
    problem_ = problem;
    return "hash";
  }

  bool broken = false;
  double diverges_above = 1e9;

 private:
  Result<v1::TaskResult> answer_task(const std::string&, const v1::Task& asked) override {
    if (broken) return stop_requested();
    const v1::PredictTask& task = asked.predict();
    EXPECT_GT(task.trials_size(), 0);
    v1::TaskResult result;
    const double strength =
        task.point().overrides_size() > 0 ? task.point().overrides(0).value() : 0;
    result.set_outcome(strength > diverges_above ? v1::DIVERGED : v1::OK);
    for (const std::uint32_t i : task.trials()) {
      const v1::Trial& trial = problem_.trials(static_cast<int>(i));
      const v1::Trial* before = i > 0 ? &problem_.trials(static_cast<int>(i) - 1) : nullptr;
      if (before != nullptr && before->session() != trial.session()) before = nullptr;
      v1::Predicted* to = result.mutable_predict()->add_predictions();
      to->set_trial(i);
      *to->mutable_end() =
          to_proto(from_proto(trial.start()) * Pose{shift_({trial, before, strength}), 0, 0});
      for (const double c : {kSd * kSd, 0.0, 0.0, kSd * kSd, 0.0, kSd * kSd}) to->add_cov(c);
    }
    return result;
  }

  std::function<double(const Seen&)> shift_;
  v1::Problem problem_;
};

Problem make_problem() {
  Problem problem;
  problem.values = problem.table().nominal();
  problem.commands = default_commands("srv1");
  Trial a, b;
  a.X_WS = {0.3, 0.4, 0};
  b.X_WS = {1.7, 1.6, 2};
  problem.log.trials = {a, b};
  return problem;
}

CompetingCause alternative(const std::string& name, double value) {
  CompetingCause r{name, {}};
  r.overrides.emplace_back();
  r.overrides.back().set_value(value);
  return r;
}

TEST(Divergence, IsHalfTheSquaredDistanceOfEqualSpreadsAndSymmetric) {
  PredictedEnd a{{1, 2, 0.4}, kSd * kSd * Eigen::Matrix3d::Identity()};
  PredictedEnd b = a;
  EXPECT_DOUBLE_EQ(divergence(a, b), 0);
  b.X_WM.x += 2 * kSd;
  EXPECT_NEAR(divergence(a, b), 2, 1e-9);
  b.covariance(1, 1) *= 4;
  b.covariance(0, 0) *= 2;
  EXPECT_GT(divergence(a, b), 0.5);
  PredictedEnd turned = b;
  turned.X_WM = a.X_WM;
  EXPECT_NEAR(divergence(a, turned), divergence(turned, a), 1e-12);
  // d' S^-1 d alone does not change when both poses are seen from elsewhere.
  const Pose X{3, -1, 2};
  const PredictedEnd c{X * a.X_WM, a.covariance}, d{X * b.X_WM, b.covariance};
  EXPECT_NEAR(divergence(c, d), divergence(a, b), 1e-9);
  a.covariance.setZero();
  EXPECT_EQ(divergence(a, b), 0);
}

// As many likelihood ratios as promised, simulated: both errors are near one in twenty.
TEST(TrialsNeeded, GiveTheErrorsThatAreClaimed) {
  Stream stream({3, Purpose::kTest, 0, 0, 0});
  const double shift = 0.6;  // s.d.s
  const std::uint64_t n = trials_needed(shift * shift / 2);
  EXPECT_EQ(n, 31u);  // ceil(5.41 / 0.18)
  int wrong = 0;
  constexpr int kRepeats = 4000;
  for (int r = 0; r < kRepeats; ++r) {
    double ratio = 0;
    for (std::uint64_t i = 0; i < n; ++i) {
      const double value = stream.normal();
      ratio += shift * value - shift * shift / 2;
    }
    wrong += ratio > 0 ? 1 : 0;
  }
  EXPECT_NEAR(wrong / double(kRepeats), 0.05, 0.012);
  EXPECT_EQ(trials_needed(1e6), 3u);
  EXPECT_GT(trials_needed(0), 1'000'000'000u);
}

TEST(NextExperiments, ChooseTheCommandAndDurationThatPart) {
  FakeFarm farm([](const Seen& s) {
    return s.trial.command() == "turn_ccw"
               ? 0.005 * s.strength * s.trial.duration() * s.trial.right() / 0.3
               : 0;
  });
  const auto next =
      next_experiments(farm, plan_drives(make_problem()),
                       {alternative("com_offset", 0), alternative("marker_offset", 1)});
  ASSERT_TRUE(next.ok()) << next.error().message;
  ASSERT_EQ(next->size(), 1u);  // no other command parts them
  const NextExperiment& best = next->front();
  EXPECT_EQ(best.trials, 11u);  // 5.41 / (1^2 / 2)
  EXPECT_EQ(
      best.text,
      "Drive turn_ccw for 2 s at full level from any start: 11 trials distinguish com_offset from "
      "marker_offset.");
  EXPECT_EQ(best.separates, (std::vector<std::string>{"com_offset", "marker_offset"}));
}

TEST(NextExperiments, OfferAnotherCommandWhenOnePartsThemAll) {
  FakeFarm farm(
      [](const Seen& s) { return s.strength * (s.trial.command() == "forward" ? 0.02 : 0.01); });
  const auto next = next_experiments(farm, plan_drives(make_problem()),
                                     {alternative("a", 0), alternative("b", 1)});
  ASSERT_TRUE(next.ok());
  ASSERT_EQ(next->size(), 2u);
  EXPECT_LT((*next)[0].trials, (*next)[1].trials);
  EXPECT_NE((*next)[0].text.find("Drive forward for 0.5 s"), std::string::npos)
      << (*next)[0].text;  // the quickest of equals
  EXPECT_EQ((*next)[1].text.find("Drive forward "), std::string::npos) << (*next)[1].text;
}

TEST(NextExperiments, AskForHeadingsDirectionsAndLateDrivesWhereTheseReport) {
  const CompetingCauses alternatives = {alternative("a", 0), alternative("b", 1)};
  FakeFarm tilt(
      [](const Seen& s) { return 0.008 * s.strength * std::cos(s.trial.start().theta() - 2.2); });
  const auto headings = next_experiments(tilt, plan_drives(make_problem()), alternatives);
  ASSERT_TRUE(headings.ok());
  EXPECT_NE(headings->front().text.find("from several headings and places"), std::string::npos);
  EXPECT_GE(headings->front().trials, 5u);

  FakeFarm backlash([](const Seen& s) {
    const bool reversed = s.before != nullptr && s.before->left() * s.trial.left() < 0;
    return reversed ? 0.02 * s.strength : 0;
  });
  const auto reversing = next_experiments(backlash, plan_drives(make_problem()), alternatives);
  ASSERT_TRUE(reversing.ok());
  EXPECT_NE(reversing->front().text.find("straight after driving the opposite way"),
            std::string::npos);

  FakeFarm sag([](const Seen& s) { return s.strength * s.trial.t() / 60 * 0.0005; });
  const auto late = next_experiments(sag, plan_drives(make_problem()), alternatives);
  ASSERT_TRUE(late.ok());
  EXPECT_NE(late->front().text.find("20 minutes into a session"), std::string::npos);
}

TEST(NextExperiments, ReportWhenNothingParts) {
  FakeFarm farm([](const Seen& s) { return s.strength >= 2 ? 0.02 : 0; });
  const auto next =
      next_experiments(farm, plan_drives(make_problem()),
                       {alternative("lag", 0), alternative("timing", 1), alternative("tilt", 2)});
  ASSERT_TRUE(next.ok());
  ASSERT_EQ(next->size(), 2u);
  EXPECT_NE((*next)[0].text.find("lag from tilt and timing from tilt"), std::string::npos)
      << (*next)[0].text;
  EXPECT_EQ((*next)[1].trials, 0u);
  EXPECT_NE((*next)[1].text.find("lag from timing"), std::string::npos) << (*next)[1].text;
}

TEST(NextExperiments, PassOnFaults) {
  FakeFarm farm([](const Seen&) { return 0.0; });
  EXPECT_TRUE(
      next_experiments(farm, plan_drives(make_problem()), {alternative("alone", 0)})->empty());
  farm.diverges_above = 0.5;
  const auto dead = next_experiments(farm, plan_drives(make_problem()),
                                     {alternative("a", 0), alternative("b", 1)});
  ASSERT_FALSE(dead.ok());
  EXPECT_NE(dead.error().message.find("'b'"), std::string::npos);
  farm.broken = true;
  const auto stopped = next_experiments(farm, plan_drives(make_problem()),
                                        {alternative("a", 0), alternative("b", 1)});
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kStopped);
}

}  // namespace
}  // namespace gapfarm::next_experiment_test
