// What a subcommand is.  Adding one takes its file with a setup function, that function's
// declaration here, and a row in the table of subcommands.cc.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <span>

#include "common/base/result.h"
#include "master/command/context.h"

namespace gapfarm {

// Runs after the command line was parsed; gives an ExitCode.  An error is shown by the caller.
using SubcommandRun = std::function<Result<int>(CliContext&)>;

struct Subcommand {
  const char* name;
  const char* summary;  // one line
  const char* group;    // heading in `gapfarm --help`
  // Declares options and examples on `app` and returns what to run; the options live in it.
  SubcommandRun (*setup)(CLI::App& app);
};

std::span<const Subcommand> subcommands();

SubcommandRun setup_blind_check(CLI::App& app);
SubcommandRun setup_check(CLI::App& app);
SubcommandRun setup_compare(CLI::App& app);
SubcommandRun setup_completion(CLI::App& app);
SubcommandRun setup_crossfit(CLI::App& app);
SubcommandRun setup_determine(CLI::App& app);
SubcommandRun setup_diagnose(CLI::App& app);
SubcommandRun setup_drive(CLI::App& app);
SubcommandRun setup_effects(CLI::App& app);
SubcommandRun setup_evolve(CLI::App& app);
SubcommandRun setup_export(CLI::App& app);
SubcommandRun setup_horizons(CLI::App& app);
SubcommandRun setup_import(CLI::App& app);
SubcommandRun setup_influence(CLI::App& app);
SubcommandRun setup_init(CLI::App& app);
SubcommandRun setup_keys(CLI::App& app);
SubcommandRun setup_plan(CLI::App& app);
SubcommandRun setup_predict(CLI::App& app);
SubcommandRun setup_replay(CLI::App& app);
SubcommandRun setup_report(CLI::App& app);
SubcommandRun setup_resume(CLI::App& app);
SubcommandRun setup_robot(CLI::App& app);
SubcommandRun setup_serve(CLI::App& app);
SubcommandRun setup_simulate(CLI::App& app);
SubcommandRun setup_stability(CLI::App& app);
SubcommandRun setup_status(CLI::App& app);

}  // namespace gapfarm
