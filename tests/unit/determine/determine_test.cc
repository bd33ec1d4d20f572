#include "master/experiments/determine/determine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/config/config.h"
#include "common/random/stream.h"

namespace gapfarm::determine_test {

using testing::HasSubstr;

Problem three_genes(std::size_t trials) {
  Problem problem = parse_config(
                        "[genes]\nmass = [0.1, 1.1]\ntrack_gauge = [0.05, 0.15]\n"
                        "contact_length = [0.02, 0.12]\nwheel_shape = \"table\"\n",
                        "d.toml")
                        .value()
                        .problem;
  problem.log.trials.resize(trials);
  return problem;
}

// Genes in the table's order: mass, contact_length, track_gauge, wheel_shape.
LikelihoodOf quadratic(const Eigen::Matrix3d& information, const Eigen::Vector3d& top,
                       std::size_t trials, double roughness = 0) {
  return [=](const std::vector<Genome>& genomes) -> Result<std::vector<double>> {
    std::vector<double> scores;
    Stream stream({.run_seed = 1});
    for (const Genome& genome : genomes) {
      const Eigen::Vector3d d = Eigen::Vector3d(genome[0], genome[1], genome[2]) - top;
      scores.push_back((-0.5 * d.dot(information * d) + roughness * stream.normal()) /
                       static_cast<double>(trials));
    }
    return scores;
  };
}

const GeneDetermined& of(const DetermineReport& report, std::size_t i) { return report.genes[i]; }

TEST(Determine, ReadsTheCovarianceOffTheCurvature) {
  const Problem problem = three_genes(50);
  const Eigen::Vector3d deviations(0.02, 0.05, 0.4);
  const Eigen::Matrix3d information = deviations.cwiseAbs2().cwiseInverse().asDiagonal();
  const Eigen::Vector3d top(0.4, 0.5, 0.6);
  const auto report = determine(problem, {0.4, 0.5, 0.6, 0.5}, quadratic(information, top, 50), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_EQ(report->genes.size(), 3U) << "a choice has no curvature";
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(of(*report, static_cast<std::size_t>(i)).deviation, deviations[i], 1e-6);
  }
  EXPECT_TRUE(of(*report, 0).determined);
  EXPECT_TRUE(of(*report, 1).determined);
  EXPECT_FALSE(of(*report, 2).determined) << "its interval is wider than its range";
  EXPECT_NEAR(of(*report, 0).value, 0.5, 1e-9);
  EXPECT_NEAR(of(*report, 0).interval_95.lower, 0.5 - 1.96 * 0.02, 1e-6);
  EXPECT_EQ(of(*report, 2).interval_95.upper, 0.15);
  EXPECT_FALSE(report->outside);
  EXPECT_NEAR(report->roughness, 0, 1e-9);
  EXPECT_THAT(determine_text(*report, problem.table()), HasSubstr("NOT DETERMINED"));
  EXPECT_THAT(determine_csv(*report, problem.table()), HasSubstr("\nmass,0.5"));
}

TEST(Determine, SaysWhereAnIntervalIsCutOffByTheRange) {
  const Problem problem = three_genes(50);
  const Eigen::Matrix3d information = 400 * Eigen::Matrix3d::Identity();
  const auto report =
      determine(problem, {0.9, 0.5, 0.5, 0.5}, quadratic(information, {0.93, 0.5, 0.5}, 50), {});
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(of(*report, 0).determined);
  EXPECT_TRUE(of(*report, 0).at_bound);
  EXPECT_FALSE(of(*report, 1).at_bound);
}

// Only the difference of two genes matters: each alone would look determined.
TEST(Determine, SeesGenesThatMakeUpForOneAnother) {
  const Problem problem = three_genes(50);
  const Eigen::Vector3d along(1, -1, 0), third(0, 0, 1);
  const Eigen::Matrix3d information =
      1e4 * along * along.transpose() + 1e3 * third * third.transpose();
  const auto report =
      determine(problem, {0.5, 0.5, 0.5, 0.5}, quadratic(information, {0.5, 0.5, 0.5}, 50), {});
  ASSERT_TRUE(report.ok());
  EXPECT_FALSE(of(*report, 0).determined);
  EXPECT_FALSE(of(*report, 1).determined);
  EXPECT_TRUE(of(*report, 2).determined);
  ASSERT_EQ(report->compensations.size(), 1U);
  EXPECT_GT(report->compensations[0].correlation, 0.99);
  EXPECT_THAT(determine_text(*report, problem.table()), HasSubstr("make up for one another"));
}

TEST(Determine, AveragesOverARoughSimulation) {
  const Problem problem = three_genes(100);
  const Eigen::Vector3d deviations(0.02, 0.03, 0.03);
  const Eigen::Matrix3d information = deviations.cwiseAbs2().cwiseInverse().asDiagonal();
  DetermineSettings settings;
  settings.points_a_term = 20;
  const auto report = determine(problem, {0.5, 0.5, 0.5, 0.5},
                                quadratic(information, {0.5, 0.5, 0.5}, 100, 0.1), settings);
  ASSERT_TRUE(report.ok());
  EXPECT_NEAR(report->roughness, 0.1, 0.02);
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(of(*report, static_cast<std::size_t>(i)).deviation / deviations[i], 1, 0.15);
  }
}

// The box finds its own width, over three orders of magnitude.
TEST(Determine, LooksAsCloseAsTheLikelihoodIsSharp) {
  const Problem problem = three_genes(50);
  const Eigen::Vector3d deviations(0.0005, 0.01, 0.1);
  const Eigen::Vector3d top(0.4, 0.5, 0.6);
  // Quadratic near the top only: beyond some deviations it flattens out.
  const auto bent = [&](const std::vector<Genome>& genomes) -> Result<std::vector<double>> {
    std::vector<double> scores;
    for (const Genome& genome : genomes) {
      const Eigen::Vector3d d =
          (Eigen::Vector3d(genome[0], genome[1], genome[2]) - top).cwiseQuotient(deviations);
      scores.push_back(-50 * std::log1p(d.squaredNorm() / 100) / 50);
    }
    return scores;
  };
  const auto report = determine(problem, {0.4, 0.5, 0.6, 0.5}, bent, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_TRUE(report->reliable);
  for (std::size_t i = 0; i < 3; ++i) {
    const double wanted = deviations[static_cast<Eigen::Index>(i)];
    EXPECT_NEAR(of(*report, i).deviation / wanted, 1, 0.15);
    EXPECT_TRUE(of(*report, i).determined);
  }
}

TEST(Determine, ReportsWhenNothingCanBeReadOff) {
  const Problem problem = three_genes(50);
  const auto noise = [](const std::vector<Genome>& genomes) -> Result<std::vector<double>> {
    Stream stream({.run_seed = 3});
    std::vector<double> scores;
    for (std::size_t i = 0; i < genomes.size(); ++i) scores.push_back(stream.normal());
    return scores;
  };
  const auto report = determine(problem, {0.5, 0.5, 0.5, 0.5}, noise, {});
  ASSERT_TRUE(report.ok());
  EXPECT_FALSE(report->reliable);
  EXPECT_THAT(determine_text(*report, problem.table()), HasSubstr("unclear"));
}

TEST(Determine, ReportsWhenThePointIsNoMaximumOrAtABound) {
  const Problem problem = three_genes(50);
  const Eigen::Matrix3d information = 1e4 * Eigen::Matrix3d::Identity();
  const auto report =
      determine(problem, {0.999, 0.5, 0.5, 0.5}, quadratic(information, {0.3, 0.5, 0.5}, 50), {});
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->outside);
  EXPECT_TRUE(of(*report, 0).at_bound);
  EXPECT_THAT(determine_text(*report, problem.table()), HasSubstr("evolve further"));
}

// What an evolution leaves is seldom the very top.
TEST(Determine, PutsIntervalsAboutTheTopAndNotAboutTheModel) {
  const Problem problem = three_genes(50);
  const Eigen::Vector3d deviations(0.01, 0.02, 0.05), top(0.4, 0.5, 0.6);
  const Eigen::Matrix3d information = deviations.cwiseAbs2().cwiseInverse().asDiagonal();
  const auto report =
      determine(problem, {0.47, 0.46, 0.6, 0.5}, quadratic(information, top, 50), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_FALSE(report->outside);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const GeneDetermined& gene = of(*report, i);
    const auto share = [&](double value) { return encode_gene(problem.table(), gene.gene, value); };
    EXPECT_NEAR(share(gene.interval_95.lower), top[k] - 1.96 * deviations[k], 1e-6);
    EXPECT_NEAR(share(gene.interval_95.upper), top[k] + 1.96 * deviations[k], 1e-6);
  }
  EXPECT_NEAR(report->rise, 0.5 * (49 + 4), 1e-6);
  EXPECT_THAT(determine_text(*report, problem.table()), HasSubstr("26.5 nats above the model"));
}

// One gene without a curvature of its own leaves the others what they are.
TEST(Determine, AGeneThatHardlyMattersHidesNoOther) {
  const Problem problem = three_genes(50);
  Eigen::Matrix3d information = Eigen::Vector3d(1e6, 1e5, 0).asDiagonal();
  information(0, 2) = information(2, 0) = -3e4;  // no maximum along some direction
  const auto report =
      determine(problem, {0.5, 0.5, 0.5, 0.5}, quadratic(information, {0.5, 0.5, 0.5}, 50), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_TRUE(of(*report, 0).determined);
  EXPECT_TRUE(of(*report, 1).determined);
  EXPECT_FALSE(of(*report, 2).determined);
}

TEST(Determine, RefusesWhatItCannotAnswer) {
  Problem problem = three_genes(50);
  const auto failing = [](const std::vector<Genome>& genomes) -> Result<std::vector<double>> {
    return std::vector<double>(genomes.size(), NAN);
  };
  EXPECT_THAT(determine(problem, {0.5, 0.5, 0.5, 0.5}, failing, {}).error().message,
              HasSubstr("end well"));
  problem.genes = {problem.genes.back()};
  EXPECT_THAT(determine(problem, {0.5}, failing, {}).error().message, HasSubstr("nothing"));
}

}  // namespace gapfarm::determine_test
