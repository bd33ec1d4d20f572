// A config as a run has it, with its trials.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "common/config/config.h"
#include "common/problem/problem.h"
#include "common/trials/read.h"

namespace gapfarm::tests {

inline Config config_of_run(const std::string& text, const std::string& path) {
  auto config = parse_config(text, path);
  EXPECT_TRUE(config.ok()) << config.error().message;
  if (!config) return {};
  auto log = read_trial_files(config->trial_files, command_names(config->problem.commands));
  EXPECT_TRUE(log.ok()) << log.error().message;
  if (log) config->problem.log = *std::move(log);
  return *std::move(config);
}

}  // namespace gapfarm::tests
