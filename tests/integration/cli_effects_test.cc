// gapfarm effects: the catalogue in words and for programs.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "common/effects/catalogue.h"
#include "tests/integration/run_program.h"

namespace gapfarm::cli_effects_test {

using ::testing::HasSubstr;

TEST(CliEffects, ListsEveryRowWithItsParameters) {
  const Finished list = gapfarm_command({"effects"});
  EXPECT_EQ(list.exit_code, 0) << list.err;
  const Finished machine = gapfarm_command({"effects", "--json"});
  const auto json = nlohmann::json::parse(machine.out);
  ASSERT_EQ(json.size(), srv1_effects().size());
  for (std::size_t e = 0; e < json.size(); ++e) {
    const Effect& effect = srv1_effects()[e];
    EXPECT_THAT(list.out, HasSubstr(effect.name + " ("));
    EXPECT_EQ(json[e]["name"], effect.name);
    ASSERT_EQ(json[e]["parameters"].size(), effect.parameters.size());
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      EXPECT_EQ(json[e]["parameters"][i]["upper"], effect.parameters[i].upper) << effect.name;
    }
  }
}

TEST(CliEffects, ListsTheCatalogueOfTheConfigsScenario) {
  const Finished push = gapfarm_command({"effects", GAPFARM_SOURCE_DIR "/configs/push.toml"});
  EXPECT_EQ(push.exit_code, 0) << push.err;
  EXPECT_THAT(push.out, HasSubstr("friction_anisotropy ("));
  EXPECT_THAT(push.out, testing::Not(HasSubstr("motor_asymmetry")));
  const Finished ball =
      gapfarm_command({"effects", GAPFARM_SOURCE_DIR "/configs/racquetball.toml"});
  EXPECT_EQ(ball.exit_code, 0) << ball.err;
  EXPECT_THAT(ball.out, HasSubstr("has no catalogue of effects"));
  const Finished missing = gapfarm_command({"effects", "none.toml"});
  EXPECT_EQ(missing.exit_code, 2);
}

}  // namespace gapfarm::cli_effects_test
