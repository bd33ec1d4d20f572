#include "common/config/model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "common/config/config.h"
#include "common/random/stream.h"
#include "tests/unit/trials/trial_text.h"

namespace gapfarm::model_test {

using testing::HasSubstr;
using testing::StartsWith;

Model random_model(std::uint64_t seed) {
  Stream stream({seed, Purpose::kTest, 0, 0, 0});
  Model model = *nominal_model("srv1");
  const ParameterTable& table = model.table();
  model.intervals.resize(table.size());
  for (std::size_t row = 0; row < table.size(); ++row) {
    const Parameter& parameter = table[row];
    double value = stream.uniform(parameter.lower, parameter.upper);
    if (parameter.kind != ParameterKind::kReal) value = std::round(value);
    model.values[row] = value;
    if (row % 3 == 0) model.intervals[row] = Interval{value - 1.0 / 3, value + 1e-9};
  }
  model.commands[1].duration_s = 0.1 + 0.2;
  model.fitness.kind = FitnessKind::kEnergyScore;
  model.fitness.outlier_share = 1.0 / 7;
  model.spread = {SpreadKind::kSampled, 99};
  model.score = -1.0 / 3;
  model.data = {"0123abcd", 519, {"a \"quoted\" name.dat", "b\\c.csv"}};
  model.origin = {"runs/1.db", std::numeric_limits<std::uint64_t>::max(), 41, 4100};
  return model;
}

// A tracked robot that is no SRV-1, with a lag of its own.
constexpr const char* kOwnRobot = R"(name = "tank"
drive = "tracked"
commands = ["left", "right"]
wheel_separation = 0.4
full_surface_speed = 0.6
mass = 12.0
lag = 0.1
[wheels.left]
contact_length = 0.35
radius = 0.1
[wheels.right]
contact_length = 0.35
radius = 0.1
)";

TEST(Model, KeepsARobotOfTrialsFromRest) {
  TemporaryFolder folder;
  folder.write("tank.toml", kOwnRobot);
  const auto config = parse_config(
      "scenario = \"srv1\"\n[robot]\nfile = \"tank.toml\"\n[parameters]\nmass = 20.0\n"
      "[genes]\ncontact_length = \"table\"\n",
      folder / "config.toml");
  ASSERT_TRUE(config.ok()) << config.error().message;
  const Problem& problem = config->problem;
  const std::size_t lag = problem.table().row("motor_lag.tau");
  EXPECT_EQ(problem.values[row_of(Srv1::kMass)], 20);
  EXPECT_EQ(problem.values[row_of(Srv1::kTrackGauge)], 0.4);
  EXPECT_EQ(problem.values[lag], 0.1);
  EXPECT_EQ(problem.genes[0].upper, 0.7);
  // With the file's lag, and as another base that has none.
  for (const double tau : {0.1, 0.0}) {
    ParameterValues values = problem.values;
    values[lag] = tau;
    const Model model = model_of_problem(problem, values);
    ASSERT_TRUE(write_model(model, folder / "model.toml").ok());
    const auto again = read_model(folder / "model.toml");
    ASSERT_TRUE(again.ok()) << again.error().message;
    EXPECT_EQ(again->values, values);
    EXPECT_EQ(again->robot_file, kOwnRobot);
    EXPECT_EQ(problem_hash(to_proto(problem_of(*again))),
              problem_hash(to_proto(problem_of(model))));
  }
}

TEST(Model, ReadsBackToTheBit) {
  TemporaryFolder folder;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Model model = random_model(seed);
    ASSERT_TRUE(write_model(model, folder / "model.toml").ok());
    const auto again = read_model(folder / "model.toml");
    ASSERT_TRUE(again.ok()) << again.error().message;
    ASSERT_EQ(again->values.size(), model.values.size());
    EXPECT_EQ(std::memcmp(again->values.data(), model.values.data(),
                          model.values.size() * sizeof(double)),
              0);
    EXPECT_EQ(again->intervals, model.intervals);
    EXPECT_EQ(again->commands[1].duration_s, model.commands[1].duration_s);
    EXPECT_EQ(again->fitness.outlier_share, model.fitness.outlier_share);
    EXPECT_EQ(again->score, model.score);
    EXPECT_EQ(again->data.files, model.data.files);
    EXPECT_EQ(again->origin.seed, model.origin.seed);
    EXPECT_EQ(again->fingerprint, model.fingerprint);
    EXPECT_EQ(format_model(*again), format_model(model));
  }
}

TEST(Model, WritesUnitsAndOnlyEffectsThatAct) {
  Model model = *nominal_model("srv1");
  std::string text = format_model(model);
  EXPECT_THAT(text, HasSubstr("mass = { value = 0.35, unit = \"kg\" }"));
  EXPECT_THAT(text, HasSubstr("[noise]\ndrive_noise_common"));
  EXPECT_THAT(text, Not(HasSubstr("[effects.")));
  model.values[model.table().row("battery_sag.rate")] = 0.004;
  text = format_model(model);
  EXPECT_THAT(text, HasSubstr("[effects.battery_sag]"));
  EXPECT_THAT(text, HasSubstr("rate = { value = 0.004, unit = \"1/min\" }"));
  EXPECT_THAT(text, Not(HasSubstr("[effects.motor_lag]")));
}

TEST(Model, IsReportedFromAConfig) {
  EXPECT_TRUE(is_model(format_model(*nominal_model("srv1"))));
  EXPECT_FALSE(is_model("seed = 1\n"));
  EXPECT_FALSE(is_model("\x01"));
  const auto model = parse_model("seed = 1\n", "c.toml");
  ASSERT_FALSE(model.ok());
  EXPECT_THAT(model.error().message, HasSubstr("found no key 'model', expected a model"));
}

TEST(Model, BareValuesAndHeldOutRowsWillDo) {
  const auto model = parse_model("model = 1\n[parameters]\nmass = 0.4\n", "m.toml");
  ASSERT_TRUE(model.ok()) << model.error().message;
  EXPECT_EQ(model->values[row_of(Srv1::kMass)], 0.4);
  EXPECT_EQ(model->values[row_of(Srv1::kFriction)], srv1_table()[row_of(Srv1::kFriction)].nominal);
  EXPECT_TRUE(model->intervals.empty());
  const Problem problem = problem_of(*model);
  EXPECT_EQ(problem.values, model->values);
  EXPECT_EQ(problem.commands.size(), 6u);
}

TEST(Model, RefusesWhatCannotBeMeant) {
  const auto error = [](const std::string& text) {
    const auto model = parse_model("model = 1\n" + text, "m.toml");
    return model.ok() ? "no error" : model.error().message;
  };
  EXPECT_THAT(error("[parameters]\nmass = { value = 350, unit = \"g\" }\n"),
              StartsWith("m.toml:3:18: mass is 350, but it must be"));
  EXPECT_THAT(error("[parameters]\nmass = { value = 0.3, unit = \"g\" }\n"),
              HasSubstr("m.toml:3:30: unit of mass is 'g', expected 'kg'; convert the value"));
  EXPECT_THAT(error("[parameters]\nmass = { unit = \"kg\" }\n"), HasSubstr("mass has no value"));
  EXPECT_THAT(error("[parameters]\nmass = { value = 0.3, lo = 0.2 }\n"), HasSubstr("one end"));
  EXPECT_THAT(error("[parameters]\nmas = 0.3\n"), HasSubstr("did you mean 'mass'?"));
  EXPECT_THAT(error("[effects.motor_lag]\nta = 0.3\n"), HasSubstr("did you mean 'tau'?"));
  EXPECT_THAT(error("scenario = \"srv\"\n"), HasSubstr("did you mean 'srv1'?"));
  const auto other = parse_model("model = 2\n", "m.toml");
  ASSERT_FALSE(other.ok());
  EXPECT_THAT(other.error().message, HasSubstr("another format version"));
}

TEST(Model, IsNotWrittenWhenItWouldNotReadBack) {
  TemporaryFolder folder;
  Model model = *nominal_model("srv1");
  model.values[row_of(Srv1::kMass)] = std::numeric_limits<double>::quiet_NaN();
  const Status status = write_model(model, folder / "model.toml");
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("mass is nan"));
  EXPECT_FALSE(std::filesystem::exists(folder / "model.toml"));
}

}  // namespace gapfarm::model_test
