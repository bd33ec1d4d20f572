#include "master/experiments/compare/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "common/base/ranges.h"
#include "common/config/config.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"
#include "tests/immediate_farm.h"
#include "tests/temporary_folder.h"

namespace gapfarm::compare_test {

using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

constexpr const char* kBase =
    "[fitness]\nkind = \"robust_mahalanobis\"\n"
    "[genes]\nfriction = [0.1, 1.5]\nfull_speed = [0.1, 0.6]\nmass = [0.2, 0.6]\n"
    "[evolution]\npopulation = 10\n";

Variant variant(const std::string& name, const std::string& more) {
  return {name, parse_config(kBase + more, name + ".toml").value()};
}

// Least, 0, in the middle of the box.
template <class Genes>
double sphere(const Genes& genes) {
  double cost = 0;
  for (const double g : genes) cost += (g - 0.5) * (g - 0.5);
  return cost;
}

class SphereFarm : public tests::ImmediateFarm {
 public:
  std::string add_problem(const v1::Problem& problem) override { return problem_hash(problem); }

 private:
  Result<v1::TaskResult> answer_task(const std::string&, const v1::Task& task) override {
    v1::TaskResult result;
    result.set_outcome(v1::OK);
    result.mutable_evaluate()->set_fitness(sphere(task.evaluate().point().genome()));
    return result;
  }
};

std::vector<ComparedRun> run_all(std::span<const Variant> variants, const CompareOptions& options) {
  SphereFarm farm;
  return compare(farm, variants, options).value();
}

TEST(Compare, GivesEveryRunTheSameEvaluations) {
  const std::vector<Variant> variants = {variant("ga", ""),
                                         variant("cma", "[optimiser]\nkind = \"cma_es\"\n"),
                                         variant("local", "[optimiser]\nkind = \"local\"\n")};
  CompareOptions options;
  options.seeds = 3;
  options.evaluations = 157;
  const auto runs = run_all(variants, options);
  ASSERT_THAT(runs, SizeIs(9));
  for (const ComparedRun& run : runs) {
    EXPECT_EQ(run.evaluations, 157U);
    EXPECT_LE(run.improvements.back().evaluations, 157U);
    for (std::size_t i = 1; i < run.improvements.size(); ++i) {
      EXPECT_LT(run.improvements[i].fitness, run.improvements[i - 1].fitness);
      EXPECT_GT(run.improvements[i].evaluations, run.improvements[i - 1].evaluations);
    }
  }
}

// Runs in step are the runs that each would be alone.
TEST(Compare, RunsAreThoseOfEvolve) {
  const std::vector<Variant> variants = {variant("ga", ""),
                                         variant("de", "[optimiser]\nkind = \"de_simplex\"\n")};
  CompareOptions options;
  options.seeds = 2;
  options.evaluations = 200;
  const auto runs = run_all(variants, options);
  for (const ComparedRun& run : runs) {
    const Config& config = variants[run.variant].config;
    auto alone =
        make_optimiser(optimiser_setup(config.evolution, config.problem, run.seed)).value();
    while (alone->evaluations() < 200) {
      alone->tell(mapped(alone->ask(), [](const Candidate& c) {
        return Score{v1::OK, sphere(c.genome)};
      }));
    }
    EXPECT_LE(alone->best().standing.cost, run.improvements.back().fitness);
    EXPECT_NEAR(alone->best().standing.cost, run.improvements.back().fitness, 1e-2);
  }
}

TEST(Compare, VariantsOfOneNameAreNamedByTheirPaths) {
  std::vector<Variant> variants;
  for (const char* path : {"p/a.toml", "q/a.toml", "q/a.toml", "b.toml"}) {
    variants.push_back(variant(path[2] == 'a' ? "a" : "b", ""));
    variants.back().config.path = path;
  }
  name_apart(variants);
  EXPECT_THAT(mapped(variants, [](const Variant& v) { return v.name; }),
              testing::ElementsAre("p/a.toml", "q/a.toml", "q/a.toml (2)", "b"));
}

TEST(Compare, ASpaceWithoutAnythingNewEndsARun) {
  Variant small{"small", parse_config("[genes]\nsub_steps = [1, 3]\n[evolution]\npopulation = 4\n",
                                      "small.toml")
                             .value()};
  CompareOptions options;
  options.seeds = 1;
  const auto runs = run_all(std::vector{small}, options);
  EXPECT_EQ(runs.front().evaluations, 3U);
}

std::vector<ComparedRun> hand_made() {
  // Reaching 1.0 after 10, 30 and never; and always after 5.
  return {{0, 1, {{1, 5}, {10, 0.5}}, 100}, {0, 2, {{1, 4}, {30, 1.0}}, 100},
          {0, 3, {{2, 3}, {50, 2.0}}, 100}, {1, 1, {{5, 0.1}}, 100},
          {1, 2, {{5, 0.2}}, 100},          {1, 3, {{5, 0.3}}, 100}};
}

TEST(Summary, CountsWhatTheTargetTook) {
  const std::vector<Variant> variants = {variant("slow", ""), variant("fast & <good>", "")};
  CompareOptions options;
  options.seeds = 3;
  options.evaluations = 100;
  const auto runs = hand_made();
  ComparisonSummary s = summarise_comparison(variants, runs, options, 1.0);
  EXPECT_EQ(s.variants[0].successes, 2U);
  EXPECT_EQ(s.variants[0].median_to_target, 20);
  EXPECT_EQ(s.variants[0].expected_to_target, (10 + 30 + 100) / 2.0);
  EXPECT_EQ(s.variants[0].median, 1.0);
  EXPECT_EQ(s.variants[1].successes, 3U);
  EXPECT_EQ(s.variants[1].expected_to_target, 5);
  EXPECT_EQ(s.variants[1].mean_rank, 1);
  EXPECT_EQ(s.variants[0].mean_rank, 2);
  EXPECT_NEAR(s.pair_p[0][1], 0.1, 1e-12) << "three against three, apart";
  EXPECT_EQ(s.variants[0].convergence.front().median, std::nullopt)
      << "a run had no score after one evaluation";
  EXPECT_NEAR(s.all.p, 0.0833, 1e-3);

  s.baselines = {{"constant velocity", 0.7}, {"nothing", std::nullopt}};
  EXPECT_THAT(comparison_text(s), HasSubstr("constant velocity"));
  EXPECT_THAT(summary_csv(s), HasSubstr("fast & <good>,3,0.2"));
  EXPECT_THAT(runs_csv(s, runs), HasSubstr("slow,3,100,2,\n"));
  const std::string page = comparison_page(s, "Test", {{"file", "<b>.toml"}});
  EXPECT_THAT(page, HasSubstr("fast &amp; &lt;good&gt;"));
  EXPECT_THAT(page, HasSubstr("<td>nothing</td><td>-</td><td></td><td></td><td></td><td></td>"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("<b>.toml")));
}

class ComparisonFile : public testing::Test {
 protected:
  ComparisonFile() { folder_.write("base.toml", kBase); }

  Result<Comparison> read(const std::string& text) const {
    return read_comparison(folder_.write("compare.toml", text));
  }

  const TemporaryFolder folder_;
};

TEST_F(ComparisonFile, MergesVariantsInTheFilesOrder) {
  const auto comparison = read(
      "[compare]\nconfig = \"base.toml\"\nseeds = 7\nevaluations = 50\ntarget_fitness = 0.5\n"
      "[variants.zebra]\nevolution.selection = \"rank\"\n"
      "[variants.\"a b\"]\noptimiser.kind = \"random\"\ngenes.friction = [0.2, 0.3]\n");
  ASSERT_TRUE(comparison.ok()) << comparison.error().message;
  EXPECT_EQ(comparison->seeds, 7U);
  EXPECT_EQ(comparison->evaluations, 50U);
  ASSERT_THAT(comparison->variants, SizeIs(2));
  EXPECT_EQ(comparison->variants[0].name, "zebra");
  const Config& zebra = comparison->variants[0].config;
  EXPECT_EQ(zebra.evolution.selection, SelectionKind::kRank);
  EXPECT_EQ(zebra.evolution.population, 10U) << "what a variant omits is the base's";
  const Config& other = comparison->variants[1].config;
  EXPECT_EQ(other.evolution.optimiser.kind, OptimiserKind::kRandomSearch);
  EXPECT_THAT(other.problem.genes, SizeIs(3));
}

TEST_F(ComparisonFile, MistakesNameTheVariant) {
  const auto wrong =
      read("[compare]\nconfig = \"base.toml\"\n[variants.x]\noptimiser.kind = \"cma\"\n");
  ASSERT_FALSE(wrong.ok());
  EXPECT_THAT(wrong.error().message, HasSubstr("variant \"x\""));
  EXPECT_THAT(wrong.error().message, HasSubstr("cma_es"));
  EXPECT_THAT(read("[compare]\nconfig = \"base.toml\"\n").error().message,
              HasSubstr("no variants"));
  EXPECT_THAT(read("[compare]\n[variants.x]\n").error().message, HasSubstr("no config"));
  EXPECT_THAT(read("[compare]\nconfig = \"base.toml\"\nseed = 3\n[variants.x]\n").error().message,
              HasSubstr("seeds"));
}

}  // namespace gapfarm::compare_test
