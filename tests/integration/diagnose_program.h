// gapfarm simulate and gapfarm diagnose, one after the other, as tests of diagnoses run them.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/integration/run_program.h"

namespace gapfarm {

// configs/NAME, which simulates at 120 Hz, at another rate: tests need not be as slow, or quick.
inline std::string shipped_config(const std::string& name, int step_rate_hz) {
  std::string text = text_of(std::string(GAPFARM_SOURCE_DIR) + "/configs/" + name);
  const std::string rate = "step_rate = 120";
  const std::size_t at = text.find(rate);
  EXPECT_NE(at, text.npos) << name;
  if (at == text.npos) return text;
  return text.replace(at, rate.size(), "step_rate = " + std::to_string(step_rate_hz));
}

// A log of so many trials with these effects ("effect.key=value").
inline void simulate_log(const std::string& config, const std::string& log, int trials,
                         const std::vector<std::string>& set, const std::string& seed = "3") {
  std::vector<std::string> arguments = {"simulate", config,     "--out",
                                        log,        "--trials", std::to_string(trials),
                                        "--seed",   seed,       "--force"};
  for (const std::string& s : set) arguments.insert(arguments.end(), {"--set", s});
  const Finished made = gapfarm_command(arguments);
  EXPECT_EQ(made.exit_code, 0) << made.err;
}

// What diagnosis.json says; the report is whole.  `out` holds nothing else afterwards.
inline nlohmann::json diagnose_log(const std::string& config, const std::string& log,
                                   const std::string& out,
                                   const std::vector<std::string>& more = {}) {
  std::filesystem::remove_all(out);
  std::vector<std::string> arguments = {"diagnose", config, "--trials", log, "--out", out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const Finished finished = gapfarm_command(arguments);
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_NE(text_of(out + "/report.html").find("</html>"), std::string::npos);
  return nlohmann::json::parse(text_of(out + "/diagnosis.json"), nullptr, false);
}

}  // namespace gapfarm
