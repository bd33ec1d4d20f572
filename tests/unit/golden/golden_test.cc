// Stored hashes of what every scenario answers: whoever changes a bit of the simulation sees it
// here.  Compiled twice, at -O2 and at -O0, against the same hashes.
//
// The last bit of a sine depends on the C library and on the CPU that it runs on, so hashes are
// kept by arithmetic class.  On a machine of a class that is not listed the tests are skipped, and
// say what would be stored.
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/hash.h"
#include "common/parameters/table.h"
#include "tests/unit/worker/ground_problem.h"
#include "tests/unit/worker/problems.h"
#include "tests/unit/worker/push_problem.h"
#include "worker/evaluate.h"

namespace gapfarm::golden_test {

// Of the functions that the simulation calls from the C library.
std::string arithmetic_class() {
  Hasher hasher;
  Stream stream({.run_seed = 1, .purpose = Purpose::kTest});
  for (int i = 0; i < 2000; ++i) {
    const double x = stream.uniform(-4, 4), y = stream.uniform(-4, 4);
    hasher.add(std::sin(x)).add(std::cos(x)).add(std::atan2(x, y)).add(std::exp(x));
    hasher.add(std::log(std::abs(x))).add(std::pow(std::abs(x), y)).add(std::tan(x));
    hasher.add(std::acos(x / 4)).add(std::asin(y / 4)).add(std::hypot(x, y)).add(std::lgamma(x));
  }
  return hasher.finish().substr(0, 8);
}

enum class Asked { kPredictions, kMeans, kPaths };

void add_answers(const Problem& problem, Asked asked, Hasher& hasher) {
  const auto prepared = prepare(to_proto(problem));
  ASSERT_TRUE(prepared.ok()) << prepared.error().message;
  std::vector<v1::Task> tasks;
  if (asked == Asked::kPaths) {
    for (const CommandSpec& command : problem.commands) {
      v1::TraceTask* trace = tasks.emplace_back().mutable_trace();
      trace->mutable_command()->set_name(command.name);
      trace->mutable_command()->set_duration(command.duration_s);
      trace->set_interval(0.1);
    }
  } else {
    tasks.emplace_back().mutable_predict()->set_means_only(asked == Asked::kMeans);
  }
  for (const v1::Task& task : tasks) {
    const v1::TaskResult result = evaluate(prepared->get(), task);
    hasher.add(static_cast<std::uint64_t>(result.outcome()));
    for (const v1::Predicted& p : result.predict().predictions()) {
      hasher.add(p.end().x()).add(p.end().y()).add(p.end().theta()).add(p.log_score());
      for (const double c : p.cov()) hasher.add(c);
    }
    for (const v1::TraceSample& s : result.trace().samples()) {
      hasher.add(s.t()).add(s.pose().x()).add(s.pose().y()).add(s.pose().theta());
    }
  }
}

// The problem as it is.
std::string golden(const Problem& problem, Asked asked = Asked::kPredictions) {
  Hasher hasher;
  add_answers(problem, asked, hasher);
  return hasher.finish();
}

// Then its means with each effect of its catalogue at 0.6 of its range.
std::string golden_with_effects(const Problem& problem) {
  const ParameterTable& table = problem.table();
  Hasher hasher;
  add_answers(problem, Asked::kPredictions, hasher);
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    Problem with = problem;
    for (std::size_t k = 0; k < table.effects()[e].parameters.size(); ++k) {
      const std::size_t row = table.effect_row(e) + k;
      const Parameter& p = table[row];
      const double value = p.lower + 0.6 * (p.upper - p.lower);
      with.values[row] = p.kind == ParameterKind::kReal ? value : std::floor(value);
    }
    add_answers(with, Asked::kMeans, hasher);
  }
  return hasher.finish();
}

struct Golden {
  const char* arithmetic;
  const char* scenario;
  const char* hash;
};

constexpr Golden kStored[] = {
    {"7234afc4", "treads", "6c0d21a59b41bdc55b4deb04b53fd79e"},
    {"7234afc4", "wheels", "27b6bb8b216c69175fd1170598e7fcbc"},
    {"7234afc4", "push", "313f912563fac94ba61900e8b107f876"},
    {"7234afc4", "racquetball", "03c980b4d323b1759d7fb9b3e8389633"},
    {"7234afc4", "ground", "92e5b0826bacaafdb17577359b4ccdd5"},
};

void expect_stored(const std::string& scenario, const std::string& hash) {
  const std::string arithmetic = arithmetic_class();
  for (const Golden& stored : kStored) {
    if (arithmetic != stored.arithmetic || scenario != stored.scenario) continue;
    EXPECT_EQ(hash, stored.hash)
        << "what " << scenario
        << " simulates has changed; when that is meant, store the new hash "
           "and say so in CHANGELOG.md";
    return;
  }
  GTEST_SKIP() << "nothing is stored for this machine: {\"" << arithmetic << "\", \"" << scenario
               << "\", \"" << hash << "\"},";
}

Problem wheels() {
  Problem problem = tests::small_problem(3);
  problem.values[row_of(Srv1::kRobot)] = 1;
  return problem;
}

Problem racquetball() {
  Problem problem;
  problem.scenario = "racquetball";
  problem.values = problem.table().nominal();
  problem.commands = default_commands("racquetball");
  return problem;
}

Problem ground() {
  Problem problem = tests::ground_problem();
  tests::take_runs(problem, {tests::driven_run(problem, problem.values, 4)});
  return problem;
}

TEST(Golden, Treads) { expect_stored("treads", golden_with_effects(tests::small_problem(6))); }
TEST(Golden, Wheels) { expect_stored("wheels", golden(wheels(), Asked::kMeans)); }
TEST(Golden, Pushes) { expect_stored("push", golden_with_effects(tests::push_problem())); }
TEST(Golden, Racquetball) { expect_stored("racquetball", golden(racquetball(), Asked::kPaths)); }
TEST(Golden, Ground) { expect_stored("ground", golden(ground())); }

}  // namespace gapfarm::golden_test
