#include "master/diagnose/correction/fit.h"

#include <gtest/gtest.h>

#include "tests/unit/residual/fields.h"

namespace gapfarm {
namespace {

using tests::draw_log;
using tests::DrawnLog;
using tests::fit_log;
using tests::share_left;

Eigen::Vector3d nothing(const LoggedMotion&, const Pose&) { return Eigen::Vector3d::Zero(); }

// The floor pulls one way, the more the longer one drives.
Eigen::Vector3d pulled(const LoggedMotion& f, const Pose& X_WE) {
  return drive_s(f) *
         (residual_axes(ResidualFrame::kWorld, f.X_WS, X_WE) * Eigen::Vector3d(0.012, -0.006, 0));
}

// Wheels grip less in the middle of the floor.
Eigen::Vector3d slippery(const LoggedMotion& f, const Pose&) {
  const double away2 = std::pow(f.X_WS.x - 1, 2) + std::pow(f.X_WS.y - 1, 2);
  const double bump = std::exp(-away2 / 0.4);
  return drive_s(f) * bump * Eigen::Vector3d(-0.02, 0.004, 0.05);
}

// A camera that sees squares as barrels.
Eigen::Vector3d bent(const LoggedMotion& f, const Pose& X_WE) {
  const auto lens = [](const Pose& X) {
    const Eigen::Vector2d p(X.x - 1, X.y - 1);
    return Eigen::Vector2d(0.05 * p.squaredNorm() * p);
  };
  const Eigen::Vector2d shift = lens(X_WE) - lens(f.X_WS);
  return residual_axes(ResidualFrame::kReadings, f.X_WS, X_WE) *
         Eigen::Vector3d(shift.x(), shift.y(), 0);
}

// Batteries tire.
Eigen::Vector3d tired(const LoggedMotion& f, const Pose&) {
  return drive_s(f) * 2e-5 * f.session_time_s * Eigen::Vector3d(-1, 0, f.left < f.right ? -1 : 1);
}

// Two cameras that disagree where their pictures meet.
Eigen::Vector3d jumps(const LoggedMotion& f, const Pose& X_WE) {
  const double beyond = (X_WE.y > 1.31 ? 1.0 : 0.0) - (f.X_WS.y > 1.31 ? 1.0 : 0.0);
  return residual_axes(ResidualFrame::kReadings, f.X_WS, X_WE) * Eigen::Vector3d(0.05, -0.02, 0) *
         beyond;
}

TEST(ResidualFit, KnownFieldsAreRecoveredOnTrialsThatItDidNotSee) {
  const std::pair<const char*, Eigen::Vector3d (*)(const LoggedMotion&, const Pose&)> fields[] = {
      {"pulled", pulled},
      {"slippery", slippery},
      {"bent", bent},
      {"tired", tired},
      {"jumps", jumps}};
  for (const auto& [name, field] : fields) {
    const DrawnLog log = draw_log(5, 500, field);
    const ResidualFit fit = fit_log(log);
    ASSERT_FALSE(fit.field.empty()) << name;
    EXPECT_LT(share_left(log, fit.unseen), 0.3) << name;
  }
}

// The shape is that of the cause, not of something that varies with it.
TEST(ResidualFit, TheFrameAndCovariatesThatCountAreChosen) {
  const auto first = [](auto field) { return fit_log(draw_log(6, 500, field)).field.at(0); };
  EXPECT_EQ(first(pulled).frame, ResidualFrame::kWorld);
  EXPECT_EQ(first(bent).frame, ResidualFrame::kReadings);
  const ResidualTerm floor = first(slippery);
  EXPECT_EQ(floor.frame, ResidualFrame::kRobot);
  EXPECT_EQ(floor.covariates, (std::vector{tests::covariate("x"), tests::covariate("y")}));
  EXPECT_EQ(first(tired).covariates, std::vector{tests::covariate("time")});
  EXPECT_EQ(first(jumps).frame, ResidualFrame::kReadings);
  EXPECT_EQ(first(jumps).covariates, std::vector{tests::covariate("y")});
}

TEST(ResidualFit, NoiseLeavesNothing) {
  int kept = 0;
  for (std::uint64_t seed = 20; seed < 40; ++seed) {
    kept += !fit_log(draw_log(seed, 300, nothing)).field.empty();
  }
  EXPECT_LE(kept, 2);
}

// Readings on either side of the line are distinguished from each other a few millimetres from it.
TEST(ResidualFit, AnEdgeIsAsSharpAsItsReadings) {
  const DrawnLog log = draw_log(5, 500, jumps);
  const ResidualField field = fit_log(log).field;
  LoggedMotion across;
  across.X_WS = {1, 1.27, 0};
  const auto shift = [&](double y) {
    const Pose end{1, y, 0};
    return residual_shift(field, across, end).head<2>().norm();
  };
  EXPECT_LT(shift(1.29), 0.01);
  for (const double y : {1.34, 1.6, 1.99}) EXPECT_NEAR(shift(y), std::hypot(0.05, 0.02), 0.008);
}

TEST(ResidualFit, ThereIsNoEdgeInNoise) {
  for (std::uint64_t seed = 20; seed < 40; ++seed) {
    const DrawnLog log = draw_log(seed, 300, nothing);
    const std::vector<bool> all(log.data.size(), true);
    for (const char* along : {"x", "y"}) {
      EXPECT_EQ(best_edge(log.data, log.residuals, all, tests::covariate(along)), std::nullopt);
    }
  }
}

// Trials that were seen do not say what they are worth: a field fitted to noise helps them.
TEST(ResidualFit, AFoldDoesNotReportOfItself) {
  const DrawnLog log = draw_log(7, 300, slippery);
  DrawnLog changed = log;
  for (std::size_t i = 0; i < log.data.size(); ++i) {
    if (log.data.fold[i] == 2) changed.residuals[i] = Eigen::Vector3d(0.05, 0.05, 0.5);
  }
  const Residuals before = fit_log(log).unseen, after = fit_log(changed).unseen;
  for (std::size_t i = 0; i < log.data.size(); ++i) {
    if (log.data.fold[i] != 2) continue;
    EXPECT_EQ(before[i], after[i]) << i;
  }
}

// Turned and shifted as a whole, a log shows the same.
TEST(ResidualFit, TheWorldMayBeTurnedAndShifted) {
  for (const auto field : {slippery, bent}) {
    const DrawnLog log = draw_log(8, 400, field);
    DrawnLog moved = log;
    const Pose X_NW{3, -2, std::numbers::pi / 2};
    for (std::size_t i = 0; i < log.data.size(); ++i) {
      moved.data.facts[i].X_WS = X_NW * log.data.facts[i].X_WS;
      moved.data.ends[i] = X_NW * log.data.ends[i];
    }
    const double here = share_left(log, fit_log(log).unseen);
    const double there = share_left(moved, fit_log(moved).unseen);
    EXPECT_NEAR(here, there, 0.03);
  }
}

TEST(ResidualFit, TrialsThatNobodyMayLearnFromDoNotCount) {
  DrawnLog log = draw_log(9, 300, nothing);
  for (std::size_t i = 0; i < log.data.size(); i += 10) {
    log.residuals[i] = Eigen::Vector3d(0.5, 0, 2);
    log.data.learn[i] = false;
  }
  const ResidualField field = fit_log(log).field;
  for (std::size_t i = 0; i < log.data.size(); ++i) {
    const Eigen::Vector3d shift = residual_shift(field, log.data.facts[i], log.data.ends[i]);
    EXPECT_LT((log.data.whiteners[i] * shift).norm(), 1.5);
  }
}

}  // namespace
}  // namespace gapfarm
