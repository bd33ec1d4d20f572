// gapfarm import FORMAT FILES: other programs' logs to the trial format.
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/suggest.h"
#include "common/base/try.h"
#include "common/problem/problem.h"
#include "common/trials/files.h"
#include "common/trials/format.h"
#include "common/trials/read.h"
#include "common/trials/write.h"
#include "master/cli/data/import_runs.h"
#include "master/cli/subcommand.h"
#include "master/command/inputs.h"
#include "master/command/outputs.h"

namespace gapfarm {
namespace {

struct ImportFormat {
  const char* name;
  TextFormat format;
  const char* scenario;  // whose commands the log is in
};

// Drives of ground robots, in any of the formats of master/io/logs.
constexpr const char* kRuns = "runs";

constexpr ImportFormat kFormats[] = {{"bbautotune", TextFormat::kBbautotune, "srv1"}};

struct ImportOptions {
  std::string format;
  std::vector<std::string> files;
  std::string out;
  std::string map;
  bool print_map = false;
  Outputs outputs;
  TrialOptions reading;
};

const ImportFormat* find_format(const std::string& name) {
  for (const ImportFormat& format : kFormats) {
    if (name == format.name) return &format;
  }
  return nullptr;
}

// OK when every file is what the user says it is.
Status check_formats(const ImportOptions& options, const ImportFormat& wanted) {
  for (const std::string& file : options.files) {
    ASSIGN_OR_RETURN(const std::string text, read_text_file(file));
    const TextFormat found = sniff_format(text);
    if (found != wanted.format) return wrong_format(file, found, format_name(wanted.format));
  }
  return {};
}

Result<TrialLog> read_logs(const ImportOptions& options) {
  const ImportFormat* format = find_format(options.format);
  if (!format) {
    std::vector<std::string> known;
    for (const ImportFormat& row : kFormats) known.emplace_back(row.name);
    known.emplace_back(kRuns);
    return Error{"unknown format '" + options.format + "'" + suggestion(options.format, known)};
  }
  RETURN_IF_ERROR(check_formats(options, *format));
  std::vector<std::string> commands;
  for (const CommandSpec& command : default_commands(format->scenario)) {
    commands.push_back(command.name);
  }
  return read_trial_files(options.files, commands, options.reading.read);
}

Result<int> run_import(ImportOptions& options, CliContext& context) {
  Console& console = context.console;
  if (options.out.empty() && !options.print_map) {
    return Error{"--out is missing, expected where to write; --out trials.csv"};
  }
  if (options.format == kRuns) {
    return import_runs({options.files, options.out, options.map, options.print_map},
                       options.outputs, context);
  }
  const bool to_stdout = options.out == "-";
  ASSIGN_OR_RETURN(const TrialLog log, read_logs(options));
  show_notes(log, console);
  if (to_stdout && console.json()) {
    return Error{"--json and --out - both want standard output; name a file"};
  }
  if (to_stdout) {
    console.print(format_trials(log));
    return kExitDone;
  }
  options.outputs.reads(log);
  ASSIGN_OR_RETURN(const auto files, trial_files(log, options.out));
  for (const TrialFile& file : files) {
    RETURN_IF_ERROR(options.outputs.plan(file.path));
  }
  context.begun = true;
  for (const TrialFile& file : files) {
    RETURN_IF_ERROR(options.outputs.write(file.path, file.text));
  }
  std::set<std::string> sessions;
  for (const Trial& trial : log.trials) sessions.insert(trial.session);
  console.result(std::to_string(log.trials.size()) + " trials in " +
                     std::to_string(sessions.size()) + " sessions written to " + options.out + "\n",
                 {{"out", options.out},
                  {"trials", log.trials.size()},
                  {"sessions", sessions.size()},
                  {"read", log.files},
                  {"notes", log.notes}});
  return kExitDone;
}

}  // namespace

SubcommandRun setup_import(CLI::App& app) {
  auto options = std::make_shared<ImportOptions>();
  app.add_option("FORMAT", options->format,
                 "bbautotune: its trials; runs: drives of a ground robot as a table (separated by "
                 "commas, semicolons or tabs), TUM, Motive, "
                 "rostopic or ros2 topic echo, PlotJuggler, .bag, .db3 or .mcap")
      ->required();
  app.add_option("FILES", options->files, "Logs; each becomes a session or a run")->required();
  app.add_option("-o,--out", options->out,
                 "Trial log to write, - for standard output; of runs: a folder");
  app.add_option(
      "--map", options->map,
      "Of runs: TOML that says which column is what, with unit, scale, offset, sign and gear");
  app.add_flag("--print-map", options->print_map, "Of runs: print columns and map; write nothing");
  options->outputs.declare(app);
  options->reading.declare_reading(app);
  app.footer(
      "Examples:\n"
      "  gapfarm import bbautotune logs/*.dat --out trials.csv\n"
      "  gapfarm import runs drive.bag --out drive\n"
      "  gapfarm import runs drive.csv --print-map > map.toml\n"
      "  gapfarm import runs drive.csv --map map.toml --out drive");
  return [options](CliContext& context) { return run_import(*options, context); };
}

}  // namespace gapfarm
