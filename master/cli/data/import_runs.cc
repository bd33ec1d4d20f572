#include "master/cli/data/import_runs.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/try.h"
#include "common/trials/files.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/to_runs.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

Result<std::vector<Recording>> read_all(const std::vector<std::string>& files) {
  std::vector<Recording> recordings;
  for (const std::string& file : files) {
    ASSIGN_OR_RETURN(Recording recording, read_recording(file));
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

Result<LogMap> read_map(const std::string& path, const std::vector<Recording>& recordings) {
  if (path.empty()) return guess_map(recordings);
  ASSIGN_OR_RETURN(const std::string text, read_text_file(path));
  return parse_map(text, path);
}

// What there is, for somebody who has to write a map.
std::string columns_text(const std::vector<Recording>& recordings) {
  std::string text;
  for (const Recording& recording : recordings) {
    for (const LogTable& table : recording.tables) {
      text += "# " + printable(table.source) + " (" + printable(table.type) + ", " +
              std::to_string(table.rows()) + " rows):";
      for (std::size_t i = 0; i < table.columns.size(); ++i) {
        const std::string unit = table.unit_of(table.columns[i]);
        text += (i == 0 ? " " : ", ") + printable(table.columns[i]) +
                (unit.empty() ? "" : " [" + printable(unit) + "]");
      }
      text += "\n";
    }
  }
  return text;
}

// Commands that were not logged, but what the wheels did: that drives the simulation as well.
void drive_by_wheels(LogMap& map) {
  if (!map.commands.columns.empty() || map.wheels.columns.empty()) return;
  map.commands = std::move(map.wheels);
  map.wheels = {};
  map.notes.push_back(
      "the log holds measured wheel speeds and no commands: they stand as commands; say "
      "measured = true in the robot's table");
}

Status check_map(const LogMap& map, const std::vector<Recording>& recordings) {
  const bool poses = !map.poses.columns.empty(), commands = !map.commands.columns.empty();
  if (poses && commands) return {};
  return Error{recordings.front().file + ":1: found no columns that are clearly " +
               (poses      ? "commands"
                : commands ? "poses"
                           : "poses or commands") +
               ", expected poses (t, x, y, heading) and commands (left and right, v and omega, "
               "throttle and steering, ...); write them into a map: gapfarm import runs FILES "
               "--print-map > map.toml lists the columns, --map map.toml uses it"};
}

Status write_files(const std::string& out, const RunFiles& files, const std::string& map,
                   Outputs& outputs) {
  const Outputs::NamedTexts all = {{"commands.csv", files.commands},
                                   {"poses.csv", files.poses},
                                   {"wheels.csv", files.wheels},
                                   {"map.toml", map}};
  std::vector<std::string> names;
  for (const auto& [name, text] : all) {
    if (!text.empty()) names.push_back(name);
  }
  RETURN_IF_ERROR(outputs.plan_in(out, names));
  return outputs.write_in(out, all);
}

}  // namespace

Result<int> import_runs(const ImportRunsOptions& options, Outputs& outputs, CliContext& context) {
  Console& console = context.console;
  for (const std::string& file : options.files) outputs.reads(file);
  if (!options.map.empty()) outputs.reads(options.map);
  ASSIGN_OR_RETURN(const std::vector<Recording> recordings, read_all(options.files));
  ASSIGN_OR_RETURN(LogMap map, read_map(options.map, recordings));
  if (options.map.empty()) drive_by_wheels(map);
  for (const std::string& note : map.notes) console.note(printable(note));
  const std::string map_text =
      (options.map.empty() ? "# Guessed from names and numbers; correct it and give it by --map.\n"
                           : "") +
      format_map(map);
  if (options.print_map) {
    console.result(columns_text(recordings) + map_text, {{"map", map_text}});
    return kExitDone;
  }
  RETURN_IF_ERROR(check_map(map, recordings));
  ASSIGN_OR_RETURN(const ImportedRuns runs, to_runs(recordings, map));
  for (const std::string& line : runs.report) console.note(printable(line));
  if (runs.log.runs.empty()) {
    return Error{options.files.front() +
                 ":1: found no run with both poses and commands, expected one; give the "
                 "files of both, in the same order"};
  }
  RETURN_IF_ERROR(write_files(options.out, format_runs(runs.log), map_text, outputs));
  const std::string done = std::to_string(runs.log.runs.size()) + " runs written to " +
                           options.out + " (commands.csv, poses.csv, map.toml)\n";
  console.result((options.map.empty() ? map_text + "\n" : "") + done,
                 {{"out", options.out},
                  {"runs", runs.log.runs.size()},
                  {"channels", runs.log.channels},
                  {"clock_start_s", runs.clock_start_s},
                  {"report", runs.report},
                  {"map", map_text}});
  return kExitDone;
}

}  // namespace gapfarm
