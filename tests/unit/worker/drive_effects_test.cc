// What each drive effect does to the motion, against closed forms.  v: speed at full duty.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/unit/worker/effect_util.h"
#include "worker/evaluate.h"

namespace gapfarm::drive_effects_test {

using tests::Changes;
using tests::commands;
using tests::CoulombTurn;
using tests::driven;
using tests::end_of;
using tests::full_speed;
using tests::noiseless;

// Treads at v -+ s, s = v ratio / (2 + ratio), turn at the rate of treads at -+ s, and the way is
// driven at the mean of both speeds.
TEST(EffectSignature, MotorAsymmetryCurvesAStraightDrive) {
  for (const double ratio : {0.2, -0.2}) {
    const Pose end = end_of({{"motor_asymmetry.ratio", ratio}}, driven("forward"));
    const double angle = CoulombTurn(full_speed() * ratio / (2 + ratio)).rate_rad_s;
    EXPECT_NEAR(end.theta, angle, 0.03 * std::abs(angle));
    // An arc of length v and that angle.
    const double aside = full_speed() * (1 - std::cos(angle)) / angle;
    EXPECT_NEAR(end.x, full_speed() * std::sin(angle) / angle, 2e-3);
    EXPECT_NEAR(end.y, aside, 0.1 * std::abs(aside));
  }
}

TEST(EffectSignature, MotorAsymmetryBendsBackwardDrivesTheOtherWay) {
  const Changes faster_right = {{"motor_asymmetry.ratio", 0.05}};
  const Pose ahead = end_of(faster_right, driven("forward"));
  const Pose back = end_of(faster_right, driven("backward"));
  EXPECT_NEAR(back.theta, -ahead.theta, 1e-3);
  EXPECT_NEAR(back.x, -ahead.x, 1e-3);
  EXPECT_NEAR(back.y, ahead.y, 1e-3);
}

TEST(EffectSignature, MotorDeadbandTakesItsDutyFromEveryCommand) {
  const Changes band = {{"motor_deadband.duty", 0.125}};
  for (const double duty : {1.0, -0.5, 0.25}) {
    const DrivenCommand less = {std::copysign(std::abs(duty) - 0.125, duty),
                                duty < 0 ? -0.75 : 0.75, 1};
    EXPECT_EQ(end_of(band, {duty, duty < 0 ? -0.875 : 0.875, 1}), end_of({}, less)) << duty;
  }
  EXPECT_NEAR(end_of(band, driven("forward")).x, 0.875 * full_speed(), 1e-3);
  EXPECT_EQ(end_of(band, {0.125, -0.1, 1}), end_of({}, {0, 0, 1})) << "within the band";
}

// After a few time constants the tread follows by v tau; after the stop it makes up for that.
TEST(EffectSignature, MotorLagDelaysThePathAndKeepsItsEnd) {
  constexpr double kLag_s = 0.1;
  Srv1Robot prompt(noiseless());
  Srv1Robot lagging(noiseless({{"motor_lag.tau", kLag_s}}));
  std::vector<MotionSample> with, without;
  const Motion at_once = prompt.run(driven("forward", 1.5), {}, {}, &without, 0.25);
  const Motion late = lagging.run(driven("forward", 1.5), {}, {}, &with, 0.25);
  for (const int sample : {4, 5, 6}) {  // at 1, 1.25 and 1.5 s
    // The prompt robot lost v / (2 mu g) of time getting up to speed; the lagging one did not slip.
    EXPECT_NEAR(without[sample].X_SB.x - with[sample].X_SB.x, full_speed() * kLag_s,
                full_speed() * 0.03);
  }
  EXPECT_NEAR(late.X_SE.x, at_once.X_SE.x, 1e-3);
  EXPECT_GT(late.duration_s, at_once.duration_s + 2 * kLag_s);
}

TEST(EffectSignature, TimingOffsetIsALongerCommand) {
  const Changes later = {{"timing_offset.offset", 0.0625}};
  const Changes sooner = {{"timing_offset.offset", -0.0625}};
  for (const CommandSpec& c : commands()) {
    EXPECT_EQ(end_of(later, {c.left, c.right, 1}), end_of({}, {c.left, c.right, 1.0625})) << c.name;
    EXPECT_EQ(end_of(sooner, {c.left, c.right, 1}), end_of({}, {c.left, c.right, 0.9375}))
        << c.name;
  }
  for (const double duration : {0.5, 1.5}) {  // the same length whatever the duration
    EXPECT_NEAR(
        end_of(later, driven("forward", duration)).x - end_of({}, driven("forward", duration)).x,
        0.0625 * full_speed(), 2e-4);
  }
  EXPECT_EQ(end_of(sooner, driven("forward", 0.05)), end_of({}, driven("forward", 0)));
}

TEST(EffectSignature, BatterySagSlowsEverySideInProportionToTheSessionsAge) {
  constexpr double kRate = 0.02;
  const Changes sag = {{"battery_sag.rate", kRate}};
  Situation start, later, much_later;
  later.session_time_s = 600;
  much_later.session_time_s = 1e6;
  for (const CommandSpec& c : commands()) {
    const DrivenCommand drive = {c.left, c.right, 1};
    const double left_over = 1 - kRate * 10;
    EXPECT_EQ(end_of(sag, drive, start), end_of({}, drive)) << c.name;
    const Pose slow = end_of({}, {c.left * left_over, c.right * left_over, 1});
    EXPECT_LT(local_difference(slow, end_of(sag, drive, later)).norm(), 1e-9) << c.name;
    // Empty, not driving backward.
    EXPECT_LT(local_difference({}, end_of(sag, drive, much_later)).norm(), 1e-3) << c.name;
  }
}

TEST(EffectSignature, BacklashCostsNothingWithoutAChangeOfDirection) {
  const Changes loose = {{"backlash.travel", 0.01}};
  for (const CommandSpec& c : commands()) {
    const DrivenCommand drive = {c.left, c.right, 1};
    Situation same, first;
    same.last_left = c.left > 0 ? 1 : -1;
    same.last_right = c.right > 0 ? 1 : -1;
    EXPECT_EQ(end_of(loose, drive, same), end_of({}, drive)) << c.name;
    EXPECT_EQ(end_of(loose, drive, first), end_of({}, drive)) << c.name;
  }
}

TEST(EffectSignature, BacklashCostsItsTravelOnceASideReverses) {
  const Changes loose = {{"backlash.travel", 0.01}};
  Situation backed, turned;
  backed.last_left = backed.last_right = -1;
  turned.last_left = -1;
  turned.last_right = 1;
  for (const double duration : {0.5, 1.5}) {
    const DrivenCommand drive = {0.25, 0.25, duration};
    const double without = end_of({}, drive).x;
    EXPECT_NEAR(without - end_of(loose, drive, backed).x, 0.01, 2e-4);
    // The left side alone is late: while it stands, the robot turns as treads at -+ v / 8 would.
    const double speed = 0.25 * full_speed();
    const double angle = CoulombTurn(speed / 2).rate_rad_s * 0.01 / speed;
    EXPECT_NEAR(end_of(loose, drive, turned).theta, angle, 0.15 * angle);
  }
}

// Straight drives of a robot that slips now and then.
std::vector<Pose> simulated_drives(const Changes& changes, int count, std::uint64_t session = 0) {
  Problem problem = tests::empty_problem();
  problem.values = noiseless(changes);
  v1::Task task;
  task.mutable_simulate()->mutable_stream()->set_birth_id(session);
  for (int i = 0; i < count; ++i) {
    v1::PlannedTrial* planned = task.mutable_simulate()->add_plan();
    planned->set_moved(true);
    planned->mutable_trial()->set_session("s");
    planned->mutable_trial()->set_trial(i);
    planned->mutable_trial()->set_command("forward");
    planned->mutable_trial()->set_duration(0.5);
    planned->mutable_trial()->mutable_start();
  }
  const auto prepared = prepare(to_proto(problem));
  EXPECT_TRUE(prepared.ok());
  std::vector<Pose> ends;
  const v1::TaskResult result = evaluate(prepared->get(), task);
  for (const v1::Trial& trial : result.simulate().trials()) {
    ends.push_back(between(from_proto(trial.start()), from_proto(trial.end())));
  }
  return ends;
}

// One of the two sides slips in a share 1 - (1 - p)^2 of the trials; the robot then falls short, by
// at most the loss of both sides, and turns toward the slipping one, left as often as right.
TEST(EffectSignature, SlipEventsShortenAndTurnTheirShareOfTrials) {
  constexpr double p = 0.2, kLoss = 0.5;
  constexpr int n = 600;
  const double clean = end_of({}, driven("forward", 0.5)).x;
  const std::vector<Pose> ends =
      simulated_drives({{"slip_events.probability", p}, {"slip_events.loss", kLoss}}, n);
  ASSERT_EQ(ends.size(), static_cast<std::size_t>(n));
  int events = 0, to_the_left = 0;
  for (const Pose& end : ends) {
    EXPECT_LT(end.x, clean + 1e-4);
    EXPECT_GT(end.x, clean * (1 - kLoss) - 1e-3);
    const bool slipped = std::abs(end.theta) > 1e-3 || end.x < clean - 5e-4;
    events += slipped;
    to_the_left += slipped && end.theta > 0;
  }
  const double share = 1 - (1 - p) * (1 - p);
  EXPECT_NEAR(events, n * share, 4 * std::sqrt(n * share * (1 - share)));
  EXPECT_NEAR(to_the_left, events / 2.0, 4 * std::sqrt(events) / 2);
}

TEST(EffectSignature, SessionGainIsOneForAllDrivesOfASession) {
  constexpr double kSpread = 0.1;
  constexpr int n = 60;
  const double travel = end_of({}, driven("forward", 0.5)).x;
  double squares = 0;
  for (int session = 0; session < n; ++session) {
    const std::vector<Pose> ends = simulated_drives({{"session_gain.spread", kSpread}}, 3,
                                                    static_cast<std::uint64_t>(session));
    ASSERT_EQ(ends.size(), 3u);
    for (const Pose& end : ends) EXPECT_NEAR(end.x, ends.front().x, 1e-4);
    const double gain = ends.front().x / travel - 1;
    squares += gain * gain / n;
  }
  EXPECT_NEAR(std::sqrt(squares), kSpread, 0.3 * kSpread);
}

// Nothing is known of a session that is predicted: the same mean, and a wider spread.
TEST(EffectSignature, SessionGainWidensWhatIsPredicted) {
  const NoiseSettings without = Srv1Robot(noiseless()).foreseen_noise();
  const NoiseSettings with = Srv1Robot(noiseless({{"session_gain.spread", 0.1}})).foreseen_noise();
  EXPECT_EQ(without.drive_common, 0);
  EXPECT_EQ(with.drive_common, 0.1);
  EXPECT_EQ(end_of({{"session_gain.spread", 0.1}}, driven("forward")),
            end_of({}, driven("forward")));
}

}  // namespace gapfarm::drive_effects_test
