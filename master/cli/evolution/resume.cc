// gapfarm resume RUN: continue a run from its last generation, or from an earlier one.
#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/trials/files.h"
#include "master/cli/evolution/evolution.h"
#include "master/cli/evolution/search_start.h"
#include "master/cli/subcommand.h"
#include "master/run/run.h"

namespace gapfarm {
namespace {

struct ResumeCommand {
  std::string run;
  std::string out;  // of a branch; empty: the run itself goes on
  BranchOptions branch;
  EvolutionOptions options;
};

bool is_written_after(const std::string& path, const std::string& began) {
  struct stat file;
  return stat(path.c_str(), &file) == 0 && S_ISREG(file.st_mode) &&
         utc_text(static_cast<double>(file.st_mtime), kStoredTime) > began;
}

// A run goes on with the files that it began with.  What a program declares may be as it was, and
// what it computes another thing.
void note_changes(const Config& config, const RunInfo& info, Console& console) {
  const auto note = [&](const std::string& path, const std::string& as_it_was) {
    const auto text = read_text_file(path);
    if (path.empty() || !text || *text == as_it_was) return;
    console.note(path +
                 " has changed since the run began, which goes on with it as it was; `gapfarm "
                 "evolve` takes the file as it is");
  };
  note(config.path, info.config_text);
  note(config.robot_path, config.problem.robot_file);
  for (const std::string& file : config.trial_files) {
    if (!is_written_after(file, info.created)) continue;
    console.note(file +
                 " was written after the run began, which goes on with the log that it read then");
  }
  if (!config.problem.external) return;
  const ExternalCommand& command = config.problem.external->command;
  for (const std::string& argument : command.argv) {
    const std::string path = std::filesystem::path(command.folder) / argument;
    if (!is_written_after(path, info.created)) continue;
    console.note(path +
                 " was written after the run began: unless it computes the same, scores of "
                 "before and of now cannot be compared; begin another run by `gapfarm evolve`");
  }
}

// An error where the program of a user's that the run needs is not what it began with.
Status check_program(const Config& config, const std::string& run) {
  if (!config.problem.external) return {};
  const ExternalProgram& program = *config.problem.external;
  ASSIGN_OR_RETURN(const std::string introduction, start_program(program.command));
  if (introduction == program.introduction) return {};
  return Error{run + ": the program '" + program.command.argv[0] + "' in '" +
               program.command.folder +
               "' declares other things than when the run began; put it back as it was, or begin "
               "another run by `gapfarm evolve`"};
}

// An error where the run has no such generation to go on from.
Status check_generation(const ResumeCommand& command, const std::vector<StoredGeneration>& done) {
  const auto& asked = command.branch.generation;
  if (!asked || contains(done, *asked, &StoredGeneration::generation)) return {};
  const std::string last = done.empty() ? "none" : std::to_string(done.back().generation);
  return Error{command.run + ": has no generation " + std::to_string(*asked) + ", the last is " +
               last + "; give an earlier one to --generation"};
}

// An error where a limit that is given had ended the run before the generation to go on from.
Status check_limits(const ResumeCommand& command, const std::vector<StoredGeneration>& done) {
  if (done.empty()) return {};
  const std::uint64_t last = command.branch.generation.value_or(done.back().generation);
  const EvolutionOverrides& given = command.options.overrides;
  double wall_s = 0;
  for (const StoredGeneration& g : done) {
    if (g.generation >= last) break;
    wall_s += g.wall_s;
    const auto at = [&](const char* option, const auto& limit, auto spent) {
      if (!limit || spent < *limit) return Status();
      return Status(Error{fmt::format(
          "{}: --{} {} was reached at generation {}, and generation {} is done; give more, or go "
          "back by --generation {}",
          command.run, option, *limit, g.generation, last, g.generation)});
    };
    RETURN_IF_ERROR(at("generations", given.generations, g.generation));
    RETURN_IF_ERROR(at("evaluations", given.evaluations, g.evaluations));
    RETURN_IF_ERROR(at("time", given.time_s, wall_s));
  }
  return {};
}

// Of the run as it is, before anything is written; what cannot be read is for others to report.
Status check_begin(const ResumeCommand& command) {
  const auto reader = RunReader::open(command.run);
  if (!reader) return {};
  const auto config = stored_config(reader->info(), command.options.overrides);
  const auto done = reader->generations();
  if (!config || !done) return {};
  RETURN_IF_ERROR(check_generation(command, *done));
  RETURN_IF_ERROR(check_limits(command, *done));
  RETURN_IF_ERROR(under(command.run, check_runnable(*config)));
  return check_program(*config, command.run);
}

// By its reader: a store of an older version stays as it is.
Result<int> print_resume(const ResumeCommand& command, CliContext& context) {
  ASSIGN_OR_RETURN(const auto reader, RunReader::open(command.run));
  ASSIGN_OR_RETURN(const auto generations, reader.generations());
  ASSIGN_OR_RETURN(const Config config, stored_config(reader.info(), command.options.overrides));
  note_changes(config, reader.info(), context.console);
  const std::uint64_t last = generations.empty() ? 0 : generations.back().generation;
  const std::uint64_t from = std::min(command.branch.generation.value_or(last), last);
  return print_evolution_dry_run(
      "go on with " + command.run + " after generation " + std::to_string(from) + " to at most " +
          std::to_string(config.evolution.generations),
      {{"run", command.run}, {"generation", from}, {"generations", config.evolution.generations}},
      command.options, config.farm, context);
}

Result<int> run_branch(ResumeCommand& command, CliContext& context) {
  const std::unique_ptr<Log> log = command.options.farm.open_log();
  const NotesGoTo notes(*log, context.console);
  ASSIGN_OR_RETURN(const auto reader, RunReader::open(command.run));
  const auto overrides =
      EvolutionOverrides::from_json(merged_overrides(reader.info(), command.options.overrides));
  ASSIGN_OR_RETURN(Config config, stored_config(reader.info(), overrides));
  note_changes(config, reader.info(), context.console);
  RETURN_IF_ERROR(branch_off(reader, command.branch, config));
  RETURN_IF_ERROR(check_runnable(config));
  RETURN_IF_ERROR(check_program(config, command.run));
  RETURN_IF_ERROR(check_farm(command.options.farm, config.farm));
  RETURN_IF_ERROR(command.options.plan(command.out, config, ""));
  const std::string does = "branch off " + search_start_text(run_info(config, overrides)) +
                           " into " + command.out + ", at most " +
                           std::to_string(config.evolution.generations) + " generations";
  if (context.dry_run) {
    return print_evolution_dry_run(does,
                                   {{"run", command.run},
                                    {"out", command.out},
                                    {"generation", config.evolution.start.generation},
                                    {"genes", config.problem.genes.size()},
                                    {"generations", config.evolution.generations}},
                                   command.options, config.farm, context);
  }
  context.console.note(command.out + ": " + does);
  return begin_run(command.out, config, command.options, overrides, *log, context);
}

Result<int> run_resume(ResumeCommand command, CliContext& context) {
  RETURN_IF_ERROR(command.options.complete());
  if (!command.out.empty()) return run_branch(command, context);
  if (!command.branch.fixed.empty() || !command.branch.freed.empty()) {
    return Error{"--fix and --free make a run of its own and leave " + command.run +
                 " as it is; name its folder by --out"};
  }
  RETURN_IF_ERROR(check_begin(command));
  if (context.dry_run) return print_resume(command, context);
  const std::unique_ptr<Log> log = command.options.farm.open_log();
  const NotesGoTo notes(*log, context.console);
  ASSIGN_OR_RETURN(RunStore store, RunStore::open(command.run));
  context.begun = true;
  const Result<Config> config = stored_config(store.info(), command.options.overrides);
  if (!config) return stopped_by(store, {command.run + ": " + config.error().message});
  note_changes(*config, store.info(), context.console);
  if (command.branch.generation) {
    const auto kept = store.truncate_after(*command.branch.generation);
    if (!kept) return stopped_by(store, kept.error());
    if (!kept->empty()) context.console.note("later generations are kept in " + kept->string());
  }
  // Once it has begun with them they are the run's, also for whoever goes on with it next.
  if (Status s = store.set_overrides(merged_overrides(store.info(), command.options.overrides));
      !s) {
    return stopped_by(store, s.error());
  }
  return run_evolution(store, *config, command.options, *log, context);
}

}  // namespace

SubcommandRun setup_resume(CLI::App& app) {
  auto command = std::make_shared<ResumeCommand>();
  app.add_option("RUN", command->run, "Folder of the run")->required();
  app.add_option("--generation", command->branch.generation,
                 "Continue after this generation; later ones are moved to a file of their own");
  app.add_option("--fix", command->branch.fixed,
                 "GENE=VALUE: go on in --out with this gene fixed; may repeat")
      ->type_name("GENE=VALUE");
  app.add_option("--free", command->branch.freed,
                 "KEY or KEY=LOWER,UPPER: go on in --out with this parameter a gene; may repeat")
      ->type_name("KEY");
  app.add_option("--out", command->out,
                 "Go on in this new run folder, from the run's population; RUN stays as it is");
  command->options.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm resume run/demo\n"
      "  gapfarm resume run/demo --generations 200    # evolve a finished run further\n"
      "  gapfarm resume run/demo --generation 20      # from an earlier generation\n"
      "  gapfarm resume run/demo --fix friction=0.5 --out run/fixed");
  return [command](CliContext& context) { return run_resume(*command, context); };
}

}  // namespace gapfarm
