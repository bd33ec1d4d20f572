// Runs of a user's program, in a folder of their own.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/integration/run_program.h"

namespace gapfarm {

class ProgramRuns : public ::testing::Test {
 protected:
  Finished evolve(const std::string& config, const std::string& run, const std::string& generations,
                  const std::string& workers = "2") const {
    return gapfarm_command({"evolve", config, "--out", folder_ / run, "--generations", generations,
                            "--workers", workers});
  }
  // A script in the folder; $G is gapfarm.
  Finished shell(const std::string& script) const {
    return run_program("/bin/sh", {"-c", "cd \"$D\" && " + script},
                       {"G=" GAPFARM_BIN_DIR "/gapfarm", "D=" + folder_.path().string()});
  }
  std::string screen(const std::string& run) const {
    return gapfarm_command({"status", folder_ / run}).out;
  }
  nlohmann::json status(const std::string& run) const { return status_of(folder_ / run); }

  const TemporaryFolder folder_;
};

}  // namespace gapfarm
