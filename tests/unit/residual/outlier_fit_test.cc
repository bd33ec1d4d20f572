#include "master/diagnose/correction/outlier_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>

#include "master/diagnose/subject.h"
#include "tests/unit/residual/fields.h"

namespace gapfarm {
namespace {

using tests::draw_log;
using tests::DrawnLog;

// As fast and as wide as draw_log()'s robot.
constexpr double kSpeed_m_s = 0.25, kGauge_m = 0.125;
const NoiseEstimate kTrue = {{0.002, 0.01}, 0.01, 0.015};

struct OutlierLog {
  std::shared_ptr<Study> study;
  OutlierData data;
  Residuals residuals;
  std::vector<bool> learn;
};

Eigen::Vector3d of_side(const LoggedMotion& facts, const Pose& X_WE, bool left) {
  const OutlierDrives robot{OutlierKind::kSide, 0.1, 0, 0, 0, 0, kSpeed_m_s, kGauge_m};
  return local_difference(X_WE, outlier_end(robot, facts, X_WE, 1e-4, left)) / 1e-4;
}

OutlierLog draw_outliers(std::uint64_t seed, std::size_t trials, const OutlierDrives* outliers) {
  const DrawnLog drives = draw_log(
      seed, trials, [](const auto&, const auto&) { return Eigen::Vector3d::Zero().eval(); });
  Stream stream({.run_seed = seed, .purpose = Purpose::kTest, .birth_id = 1});
  auto study = std::make_shared<Study>();
  study->subject = diagnosis_subject(Problem{});
  OutlierLog log{
      study, {*study, drives.data.facts, drives.data.ends}, {}, std::vector<bool>(trials, true)};
  for (std::size_t i = 0; i < trials; ++i) {
    const LoggedMotion& facts = log.data.facts[i];
    const Pose& end = log.data.ends[i];
    const Eigen::Vector3d l = of_side(facts, end, true), r = of_side(facts, end, false);
    ResidualTrial& trial = study->trials.emplace_back();
    trial.X_WS = facts.X_WS;
    trial.X_WP = end;
    trial.left = l;
    trial.right = r;
    Pose went = end;
    if (outliers != nullptr) {
      const double amount = stream.uniform(outliers->least, outliers->most);
      const bool first = stream.bernoulli(0.5);
      const bool is_outlier = may_be_outlier(*outliers, facts) && stream.bernoulli(outliers->share);
      went = is_outlier ? outlier_end(*outliers, facts, end, amount, first)
                        : rest_end(*outliers, facts, end);
    }
    const double both = kTrue.drive_common * stream.normal();
    const double left = both + kTrue.drive_side * stream.normal();
    const double right = both + kTrue.drive_side * stream.normal();
    const Eigen::Matrix3d reading = reading_covariance(trial, kTrue.pose).llt().matrixL();
    const Eigen::Vector3d drawn(stream.normal(), stream.normal(), stream.normal());
    log.residuals.push_back(local_difference(end, went) + left * l + right * r + reading * drawn);
  }
  return log;
}

std::optional<OutlierFit> fit(const OutlierLog& log) {
  return fit_outliers(log.data, log.residuals, log.learn, {{0.003, 0.02}, 0.02, 0.02}, 11);
}

double mean_score(const OutlierLog& log, const OutlierFit& by) {
  double sum = 0;
  for (std::size_t i = 0; i < log.data.size(); ++i) {
    sum += outlier_score(log.data, i, log.residuals[i], by);
  }
  return sum / static_cast<double>(log.data.size());
}

// The kind, how often and how much; and what it scores on a log that it did not see is what the
// truth scores there.
TEST(OutlierFit, FindsWhatOutliersAndHowOften) {
  const OutlierDrives kinds[] = {
      {OutlierKind::kSide, 0.12, -0.55, 0, 0.02, 0, kSpeed_m_s, kGauge_m},
      {OutlierKind::kLate, 0.25, 0.2, 0.22, -0.05, 0, 0, 0},
      {OutlierKind::kTurned, 0.15, -1, 1, 0, 0, 0, 0},
      {OutlierKind::kShifted, 0.06, 0.05, 0.06, 0, 0.4, 0, 0}};
  for (const OutlierDrives& truth : kinds) {
    const OutlierLog log = draw_outliers(11, 500, &truth), fresh = draw_outliers(12, 500, &truth);
    const auto found = fit(log);
    ASSERT_TRUE(found) << static_cast<int>(truth.kind);
    EXPECT_EQ(found->outliers.kind, truth.kind);
    EXPECT_NEAR(found->outliers.share / truth.share, 1, 0.35);
    EXPECT_NEAR(found->outliers.least, truth.least, 0.15 + 0.1 * std::abs(truth.least));
    EXPECT_NEAR(found->outliers.most, truth.most, 0.15 + 0.1 * std::abs(truth.most));
    EXPECT_NEAR(found->outliers.rest, truth.rest, 0.02);
    const OutlierFit perfect{truth, kTrue, 0};
    const NoiseEstimate wide = {{0.004, 0.03}, 0.2, 0.05};
    OutlierFit none = perfect;
    none.outliers.share = 1e-9;
    none.noise = wide;
    const double to_gain = mean_score(fresh, perfect) - mean_score(fresh, none);
    EXPECT_GT(mean_score(fresh, *found) - mean_score(fresh, none), 0.9 * to_gain)
        << static_cast<int>(truth.kind);
  }
}

// Most of those that were read late look late, and hardly another.
TEST(OutlierFit, ReportsWhichTheyWere) {
  const OutlierDrives truth{OutlierKind::kLate, 0.25, 0.3, 0.32, 0, 0, 0, 0};
  const OutlierLog log = draw_outliers(11, 400, &truth);
  const OutlierFit perfect{truth, kTrue, 0};
  double late = 0, marked = 0, both = 0;
  for (std::size_t i = 0; i < log.data.size(); ++i) {
    const LoggedMotion& facts = log.data.facts[i];
    const Pose went =
        log.data.ends[i] * Pose{log.residuals[i][0], log.residuals[i][1], log.residuals[i][2]};
    const Pose on_time = log.data.ends[i];
    const Pose read_late = outlier_end(truth, facts, on_time, 0.31, true);
    const bool was_late =
        local_difference(read_late, went).norm() < local_difference(on_time, went).norm();
    const bool is_marked = outlier_chance(log.data, i, log.residuals[i], perfect) > 0.5;
    late += was_late;
    marked += is_marked;
    both += was_late && is_marked;
  }
  EXPECT_NEAR(marked / 400, 0.25, 0.06);
  EXPECT_GT(both, 0.9 * late);
  EXPECT_GT(both, 0.9 * marked);
}

TEST(OutlierFit, MeasuresTheRobotThatTurns) {
  const OutlierDrives truth{OutlierKind::kSide, 0.2, -0.4, 0, 0, 0, kSpeed_m_s, kGauge_m};
  const auto found = fit(draw_outliers(5, 300, &truth));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->outliers.speed_m_s, kSpeed_m_s, 1e-3);
  EXPECT_NEAR(found->outliers.gauge_m, kGauge_m, 1e-3);
}

// Seeds 22 and 28 of the noise have two hills, and the lower one left room for outliers.
TEST(OutlierFit, InNoiseNothingOutliers) {
  for (std::uint64_t seed = 20; seed < 29; ++seed) {
    EXPECT_FALSE(fit(draw_outliers(seed, 300, nullptr))) << seed;
  }
}

TEST(OutlierFit, TrialsThatNobodyMayLearnFromDoNotCount) {
  OutlierLog log = draw_outliers(21, 300, nullptr);
  for (std::size_t i = 0; i < log.data.size(); i += 10) {
    log.residuals[i] = Eigen::Vector3d(-0.05, 0, 1);
    log.learn[i] = false;
  }
  EXPECT_FALSE(fit(log));
}

}  // namespace
}  // namespace gapfarm
