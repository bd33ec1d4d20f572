#include "master/diagnose/fit/free_commands.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "common/random/stream.h"

namespace gapfarm::free_commands_test {
namespace {

constexpr double kSpeed_m_s = 0.28, kGauge_m = 0.16;

// A constant twist for the duration, as treads that do not slide along make it.
Twist twist_of(const CommandSpec& c) {
  return Twist((c.left + c.right) / 2, 0, (c.right - c.left) / kGauge_m) * kSpeed_m_s *
         c.duration_s;
}

// Drives whose ends and derivatives by each side's gain are exact; a cell each.
Study drives(const std::vector<CommandSpec>& commands) {
  Study study;
  study.free_commands = true;
  study.speed_m_s = kSpeed_m_s;
  for (const CommandSpec& c : commands) {
    ResidualTrial t;
    t.cell = study.cells.size();
    study.cells.push_back({c, MotionKind::kWide, 1, 1, 1, 1});
    t.X_WS = {0.4, 0.7, 1.1};
    t.X_WP = t.X_WS * exp(twist_of(c));
    const auto end_with = [&](double left, double right) {
      CommandSpec other = c;
      other.left *= left;
      other.right *= right;
      return t.X_WS * exp(twist_of(other));
    };
    constexpr double kStep = 1e-5;
    t.left = local_difference(t.X_WP, end_with(1 + kStep, 1)) / kStep;
    t.right = local_difference(t.X_WP, end_with(1, 1 + kStep)) / kStep;
    study.trials.push_back(t);
    study.whitener.push_back(Eigen::Vector3d(1 / 0.004, 1 / 0.004, 1 / 0.02).asDiagonal());
  }
  return study;
}

// Random duties with all their mirror images: left to right, front to back, and both.
std::vector<CommandSpec> mirrored_commands() {
  Stream stream({.run_seed = 3});
  std::vector<CommandSpec> commands;
  for (int i = 0; i < 12; ++i) {
    const double a = stream.uniform(-1, 1), b = stream.uniform(-1, 1), s = stream.uniform(0.5, 2);
    for (const auto& [left, right] :
         {std::pair(a, b), std::pair(b, a), std::pair(-a, -b), std::pair(-b, -a)}) {
      commands.push_back({"forward", left, right, s});
    }
  }
  return commands;
}

TEST(FreeCommands, AreReportedByHowFewTrialsRepeat) {
  std::vector<Cell> cells(10);
  for (Cell& cell : cells) cell.trials = 1;
  EXPECT_TRUE(commands_are_free(cells));
  for (Cell& cell : cells) cell.trials = 12;
  EXPECT_FALSE(commands_are_free(cells));
  for (std::size_t i = 0; i < 3; ++i) cells[i].trials = 1;
  EXPECT_FALSE(commands_are_free(cells)) << "three odd ones among 87";
  EXPECT_FALSE(commands_are_free({}));
}

TEST(FreeCommands, WaysKnowWholeTurns) {
  const std::vector<CommandSpec> commands = {{"a", 1, 1, 2},      {"b", -0.4, 0.5, 1},
                                             {"c", 0.2, 1, 2},    {"d", -1, 0.6, 2},
                                             {"e", 0.3, -0.9, 3}, {"f", 0, 0, 1}};
  const Study study = drives(commands);
  for (std::size_t i = 0; i < commands.size(); ++i) {
    EXPECT_LT((motion_of(study, i) - twist_of(commands[i])).norm(), 2e-3) << commands[i].name;
  }
  EXPECT_GT(std::abs(motion_of(study, 3)[2]), std::numbers::pi);
}

TEST(FreeCommands, DisturbancesAreCarriedToTheEnd) {
  const std::vector<CommandSpec> commands = {{"a", 1, 1, 2}, {"b", -0.4, 0.5, 1}, {"c", 0.2, 1, 2}};
  const Study study = drives(commands);
  constexpr double kStep = 1e-5;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const ResidualTrial& t = study.trials[i];
    const CarriedToEnd carried = carried_to_end(study, i);
    for (int k = 0; k < 3; ++k) {
      const Twist d = kStep * Twist::Unit(k);
      const Pose pushed = t.X_WS * exp(Twist(twist_of(commands[i]) + d));
      EXPECT_LT((local_difference(t.X_WP, pushed) / kStep - carried.rate.col(k)).norm(), 1e-4);
      const Pose shifted = t.X_WS * Pose{d[0], d[1], d[2]} * exp(twist_of(commands[i]));
      EXPECT_LT((local_difference(t.X_WP, shifted) / kStep - carried.start.col(k)).norm(), 1e-3);
    }
  }
}

// A motor faster than the other breaks the symmetry of left and right, a centre of mass ahead that
// of front and back: no misfit may absorb them.  What changes all speeds alike it may.
TEST(FreeCommands, MisfitsLeaveWhatBreaksASymmetry) {
  const Study study = drives(mirrored_commands());
  std::vector<Eigen::Vector3d> apart, both, ahead;
  for (std::size_t i = 0; i < study.size(); ++i) {
    const ResidualTrial& t = study.trials[i];
    apart.push_back(t.right - t.left);
    both.push_back(t.right + t.left);
    ahead.push_back(carried_to_end(study, i).rate.col(1) * std::abs(motion_of(study, i)[2]));
  }
  double absorbed = 0;
  const std::vector<Eigen::VectorXd> misfits = smooth_misfits(study);
  ASSERT_FALSE(misfits.empty());
  for (const Eigen::VectorXd& misfit : misfits) {
    for (const auto* odd : {&apart, &ahead}) {
      const Eigen::VectorXd column = study.whiten(*odd);
      EXPECT_LT(std::abs(misfit.dot(column)), 1e-3 * misfit.norm() * column.norm());
    }
    const Eigen::VectorXd column = study.whiten(both);
    absorbed = std::max(absorbed, std::abs(misfit.dot(column)) / misfit.norm() / column.norm());
  }
  EXPECT_GT(absorbed, 0.5);
}

TEST(FreeCommands, MisfitsAreAHundredthOfTheMotion) {
  const Study study = drives(mirrored_commands());
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * study.size()));
  for (const Eigen::VectorXd& misfit : smooth_misfits(study)) variance += misfit.cwiseAbs2();
  for (std::size_t i = 0; i < study.size(); ++i) {
    const Twist motion = motion_of(study, i);
    const double heading = 0.02 * std::sqrt(variance[static_cast<Eigen::Index>(3 * i + 2)]);
    EXPECT_LT(heading, 0.012 + 0.04 * std::abs(motion[2]));
    EXPECT_GT(heading, 0.002 * std::abs(motion[2]));
  }
}

TEST(FreeCommands, EveryTrialIsOfOneClass) {
  const Study study = drives(mirrored_commands());
  const auto classes = drive_classes(study);
  EXPECT_EQ(classes.size(), 4u);
  for (std::size_t i = 0; i < study.size(); ++i) {
    double sum = 0;
    for (const auto& in : classes) sum += in[i];
    EXPECT_EQ(sum, 1);
  }
}

}  // namespace
}  // namespace gapfarm::free_commands_test
