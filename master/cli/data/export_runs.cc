// gapfarm export runs: simulated beside measured runs, for Foxglove and PlotJuggler.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "master/cli/data/export_command.h"
#include "master/ground/paths.h"
#include "master/io/logs/bags.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kMcapName = "runs.mcap";

struct ShownPoses {
  const char* name;
  std::vector<Pose> DrivenPath::*poses;
};

// As file: only of what was fitted.
std::vector<ShownPoses> shown_poses(const FittedRuns& fitted) {
  std::vector<ShownPoses> shown = {{"measured", &DrivenPath::logged},
                                   {"simulated", &DrivenPath::after}};
  if (fitted.values != fitted.problem.values) shown.push_back({"as_file", &DrivenPath::before});
  return shown;
}

std::string file_of(const std::string& run) {
  std::string name;
  for (const char c : run) {
    const auto byte = static_cast<unsigned char>(c);
    name += byte >= 0x80 || std::isalnum(byte) || c == '-' ? c : '_';
  }
  return (name.empty() ? "run" : name) + ".csv";
}

// Row of a list that holds at a time; null before the first.
const CommandRow* held_at(const std::vector<CommandRow>& rows, double t_s) {
  const auto after = std::ranges::upper_bound(rows, t_s, {}, &CommandRow::t_s);
  return after == rows.begin() ? nullptr : &*(after - 1);
}

// A row a pose; commands and measured speeds as they hold then.
std::string run_csv(const DrivenPath& path, const RunLog& log,
                    const std::vector<ShownPoses>& shown) {
  const LoggedRun& run = log.runs[path.in_log];
  const std::pair<const std::vector<CommandRow>*, const std::vector<std::string>*> lists[] = {
      {&run.commands, &log.channels}, {&run.wheel_speeds, &log.wheel_channels}};
  std::string text = "t";
  for (const ShownPoses& s : shown) text += fmt::format(",{0}/x,{0}/y,{0}/theta", s.name);
  for (const std::string& channel : log.channels) text += ",commands/" + channel;
  for (const std::string& channel : log.wheel_channels) text += ",wheels/" + channel;
  for (std::size_t k = 0; k < path.t_s.size(); ++k) {
    text += fmt::format("\n{}", path.t_s[k]);
    for (const ShownPoses& s : shown) {
      const Pose& X = (path.*s.poses)[k];
      text += fmt::format(",{:.6f},{:.6f},{:.6f}", X.x, X.y, X.theta);
    }
    for (const auto& [rows, channels] : lists) {
      const CommandRow* row = held_at(*rows, path.t_s[k]);
      for (std::size_t c = 0; c < channels->size(); ++c) {
        text += row == nullptr ? std::string(",") : fmt::format(",{}", row->values[c]);
      }
    }
  }
  return text + "\n";
}

Json object_schema(Json properties) {
  return {{"type", "object"}, {"properties", std::move(properties)}};
}

Json numbers_schema(const std::vector<std::string>& names) {
  Json properties = Json::object();
  for (const std::string& name : names) properties[name] = {{"type", "number"}};
  return object_schema(std::move(properties));
}

Json stamp_schema() {
  const Json integer = {{"type", "integer"}};
  return {
      {"type", "object"}, {"title", "time"}, {"properties", {{"sec", integer}, {"nsec", integer}}}};
}

// Foxglove's own message, and the heading for plots.
std::string pose_schema() {
  Json schema = object_schema(
      {{"timestamp", stamp_schema()},
       {"frame_id", {{"type", "string"}}},
       {"pose", object_schema({{"position", numbers_schema({"x", "y", "z"})},
                               {"orientation", numbers_schema({"x", "y", "z", "w"})}})},
       {"yaw", {{"type", "number"}}}});
  schema["title"] = "foxglove.PoseInFrame";
  return json_text(schema);
}

Json stamp_of(std::uint64_t ns) {
  return {{"sec", ns / 1'000'000'000}, {"nsec", ns % 1'000'000'000}};
}

std::string pose_message(const Pose& X, std::uint64_t ns) {
  const Json position = {{"x", X.x}, {"y", X.y}, {"z", 0.0}};
  const Json turn = {
      {"x", 0.0}, {"y", 0.0}, {"z", std::sin(X.theta / 2)}, {"w", std::cos(X.theta / 2)}};
  return json_text(Json{{"timestamp", stamp_of(ns)},
                        {"frame_id", "world"},
                        {"pose", {{"position", position}, {"orientation", turn}}},
                        {"yaw", X.theta}});
}

// Times of MCAP are not below 0: those of logs that begin there are moved.
std::uint64_t ns_of(double t_s, double first_s) {
  return static_cast<std::uint64_t>(std::llround((t_s - std::min(0.0, first_s)) * 1e9));
}

void add_rows(const std::string& topic, const std::vector<CommandRow>& rows,
              const std::vector<std::string>& names, double first_s, McapWriter* mcap) {
  if (rows.empty() || names.empty()) return;
  Json schema = numbers_schema(names);
  schema["properties"]["timestamp"] = stamp_schema();
  const auto channel = mcap->add_channel(topic, "gapfarm.Numbers", json_text(schema));
  for (const CommandRow& row : rows) {
    const std::uint64_t ns = ns_of(row.t_s, first_s);
    Json message = {{"timestamp", stamp_of(ns)}};
    for (std::size_t c = 0; c < names.size(); ++c) message[names[c]] = row.values[c];
    mcap->add_message(channel, ns, json_text(message));
  }
}

void add_run(const DrivenPath& path, const RunLog& log, const std::vector<ShownPoses>& shown,
             McapWriter* mcap) {
  const LoggedRun& run = log.runs[path.in_log];
  double first_s = path.t_s.front();
  for (const auto* rows : {&run.commands, &run.wheel_speeds}) {
    if (!rows->empty()) first_s = std::min(first_s, rows->front().t_s);
  }
  const std::string folder = "/" + path.run + "/";
  for (const ShownPoses& s : shown) {
    const auto channel = mcap->add_channel(folder + s.name, "foxglove.PoseInFrame", pose_schema());
    for (std::size_t k = 0; k < path.t_s.size(); ++k) {
      const std::uint64_t ns = ns_of(path.t_s[k], first_s);
      mcap->add_message(channel, ns, pose_message((path.*s.poses)[k], ns));
    }
  }
  add_rows(folder + "commands", run.commands, log.channels, first_s, mcap);
  add_rows(folder + "wheels", run.wheel_speeds, log.wheel_channels, first_s, mcap);
}

}  // namespace

Result<int> export_runs(ExportCommand& command, CliContext& context) {
  Console& console = context.console;
  if (command.out.empty()) return Error{"runs: name a folder to write to with --out"};
  ASSIGN_OR_RETURN(const auto fitted, open_fitted(command.source, command.runs, console));
  if (!fitted.problem.windows()) {
    return Error{command.source + ": scenario " + fitted.problem.scenario +
                 " has no runs; gapfarm predict compares its trials"};
  }
  const auto channels = fitted.problem.channels();
  ASSIGN_OR_RETURN(auto log, read_run_folders(fitted.folders, channels));
  log.channels.assign(channels.begin(), channels.end());
  command.outputs.reads(command.source);
  command.outputs.reads(fitted.robot_path);
  command.outputs.reads_runs(fitted.folders);
  std::vector<std::string> names = {kMcapName};
  for (const LoggedRun& run : log.runs) names.push_back(file_of(session_of(run)));
  RETURN_IF_ERROR(command.outputs.plan_in(command.out, names));
  if (context.dry_run) {
    return print_dry_run(fmt::format("simulate {} runs", log.runs.size()),
                         {{"out", command.out}, {"runs", log.runs.size()}}, command.farm, {},
                         context);
  }
  ASSIGN_OR_RETURN(auto farm, start_farm(command.farm, {}, context));
  ASSIGN_OR_RETURN(const auto paths, drive_paths(*farm, fitted.problem, fitted.values, log, 0));
  const std::vector<ShownPoses> shown = shown_poses(fitted);
  McapWriter mcap;
  Outputs::NamedTexts files;
  for (const DrivenPath& path : paths.runs) {
    add_run(path, log, shown, &mcap);
    files.emplace_back(file_of(path.run), run_csv(path, log, shown));
  }
  files.emplace_back(kMcapName, mcap.finish());
  RETURN_IF_ERROR(command.outputs.write_in(command.out, files));
  std::string text = fmt::format(
      "{} run{} in {}: {}, and a table each; ends are {:.3g} m off (median)", paths.runs.size(),
      paths.runs.size() == 1 ? "" : "s", command.out, kMcapName, paths.after_m);
  if (shown.size() > 2) text += fmt::format(", as the file says {:.3g} m", paths.before_m);
  console.result(text + "\n", {{"out", command.out},
                               {"runs", paths.runs.size()},
                               {"simulated_m", paths.after_m},
                               {"as_file_m", paths.before_m}});
  return kExitDone;
}

}  // namespace gapfarm
