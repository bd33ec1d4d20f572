#include "master/command/outputs.h"

#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "common/base/ranges.h"
#include "common/trials/files.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

struct Marker {
  FolderKind kind;
  const char* file;
  const char* label;
};

constexpr Marker kMarkers[] = {
    {FolderKind::kRun, "run.sqlite", "a run"},
    {FolderKind::kDiagnosis, "simulations.sqlite", "a diagnosis"},
    {FolderKind::kDiagnosis, "diagnosis.json", "a diagnosis"},
    {FolderKind::kBlindCheck, "seals.txt", "a blind check"},
    {FolderKind::kOther, "commands.csv", "the log of a run"},
};

// Of the long command that keeps its simulations in the folder; empty: of an older diagnosis, or
// none.
std::string command_in(const fs::path& folder) {
  const auto record = command_status(folder, 0);
  return record && *record ? (*record)->command : std::string();
}

bool same_file(const std::string& a, const std::string& b) {
  std::error_code code;
  if (fs::equivalent(a, b, code)) return true;
  const fs::path left = fs::weakly_canonical(a, code);
  return !code && left == fs::weakly_canonical(b, code) && !code;
}

// The folder that a file would be made in, or the nearest one above that is there.
fs::path standing_folder(const fs::path& path) {
  fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  while (!is_there(folder) && folder.has_parent_path() && folder != folder.parent_path()) {
    folder = folder.parent_path();
  }
  return is_there(folder) ? folder : fs::path(".");
}

// Permissions alone do not decide (root, read-only mounts): tries it.
Status check_writable(const std::string& path) {
  const fs::path folder = standing_folder(path);
  if (!is_folder(folder)) {
    return Error{path + ": " + folder.string() + " is no folder; give another name"};
  }
  std::string trial = (folder / ".gapfarm-XXXXXX").string();
  const int fd = ::mkstemp(trial.data());
  if (fd < 0) {
    return Error{path + ": cannot be written: " + std::strerror(errno) + " in " + folder.string() +
                 "; give another name, or make that folder writable"};
  }
  ::close(fd);
  ::unlink(trial.c_str());
  return {};
}

// Of any run's or command's simulations: hours of work, which no --force is meant for.
bool is_store(const std::string& path) {
  std::array<char, 15> begin = {};
  std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
  return std::string_view(begin.data(), begin.size()) == "SQLite format 3";
}

// Of a run: its store and what it left; and a lock, of a run or of another long command.
constexpr std::string_view kOfRun[] = {"run.sqlite",  "log.txt",   "model.toml",
                                       "report.html", "poses.svg", "fitness.svg"};

bool is_of_run(const std::string& path) {
  std::error_code ignored;
  const fs::path file = fs::weakly_canonical(path, ignored);
  const std::string name = file.filename();
  return name == "run.lock" ||
         (contains(kOfRun, name) && is_there(file.parent_path() / "run.sqlite"));
}

bool is_in_place(const std::string& path) {
  std::error_code code;
  const auto status = fs::status(path, code);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

}  // namespace

Status check_folder(const std::string& folder, FolderKind kind) {
  if (is_there(folder) && !is_folder(folder)) {
    return Error{folder + ": is a file, expected a folder; choose another --out"};
  }
  const std::string command = command_in(folder);
  const bool alone = kind == FolderKind::kDiagnosis || kind == FolderKind::kRun;
  if (alone && !command.empty() && command != "diagnose") {
    return Error{folder + ": holds what `gapfarm " + command +
                 "` simulated, and nothing else belongs there; choose another --out"};
  }
  for (const Marker& marker : kMarkers) {
    if (marker.kind == kind || !is_there(fs::path(folder) / marker.file)) continue;
    const bool of_another = !command.empty() && command != "diagnose";
    if (std::string_view(marker.file) == "simulations.sqlite" && of_another) continue;
    return Error{folder + ": holds " + marker.label +
                 ", and nothing else belongs there; choose another --out"};
  }
  return {};
}

void Outputs::declare(CLI::App& app) {
  app.add_flag("--force", force_, "Replace files that are there already");
}

void Outputs::reads(const std::string& path) {
  if (!path.empty()) inputs_.push_back(path);
}

void Outputs::reads(const TrialLog& log) {
  for (const std::string& file : log.files) reads(file);
}

void Outputs::reads(const Config& config) {
  reads(config.path);
  reads(config.robot_path);
  reads(config.problem.log);
  for (const std::string& file : config.trial_files) reads(file);
}

void Outputs::reads_runs(const std::vector<std::string>& folders) {
  for (const std::string& folder : folders) {
    for (const char* name :
         {"commands.csv", "poses.csv", "wheels.csv", "gyro.csv", "returns.csv"}) {
      reads((fs::path(folder) / name).string());
    }
  }
}

Status Outputs::check(const std::string& path, bool replace, bool own) const {
  if (is_in_place(path)) return {};
  const auto is_this = [&](const std::string& other) { return same_file(path, other); };
  if (std::ranges::any_of(inputs_, is_this)) {
    return Error{path + ": is read by this command, so it cannot be written; give another name"};
  }
  if (is_folder(path) || path.ends_with('/')) {
    return Error{path + ": is a folder, expected a file; give another name"};
  }
  if (is_store(path)) {
    return Error{path + ": is a store of simulations, so it cannot be written; give another name"};
  }
  if (!own && is_of_run(path)) {
    return Error{path +
                 ": belongs to the run in its folder, so it cannot be written; give another "
                 "name"};
  }
  if (std::error_code ignored; !replace && fs::exists(fs::symlink_status(path, ignored))) {
    return Error{path + ": exists already; give another name, or --force to replace it"};
  }
  return check_writable(path);
}

Status Outputs::plan(const std::string& path) {
  if (path.empty() || path == "-") return {};
  std::error_code ignored;
  const fs::path own = fs::weakly_canonical(path, ignored);
  for (const Planned& other : planned_) {
    if (own != "/dev/null" && fs::weakly_canonical(other.path, ignored) == own) {
      return Error{path + ": is to be written twice; give one of the outputs another name"};
    }
  }
  RETURN_IF_ERROR(check(path, force_, false));
  planned_.push_back({path, force_});
  return {};
}

Status Outputs::plan(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    RETURN_IF_ERROR(plan(path));
  }
  return {};
}

Status Outputs::plan_in(const std::string& folder, const std::vector<std::string>& names) {
  RETURN_IF_ERROR(check_folder(folder, FolderKind::kOther));
  for (const std::string& name : names) {
    RETURN_IF_ERROR(plan((fs::path(folder) / name).string()));
  }
  return {};
}

Status Outputs::plan_again(const std::string& path) {
  planned_.push_back({path, true});
  return check(path, true, true);
}

Status Outputs::write(const std::string& path, std::string_view bytes) const {
  const auto planned = std::ranges::find(planned_, path, &Planned::path);
  const bool replace = planned != planned_.end() ? planned->replace : force_;
  return write_file_atomically(path, bytes, replace ? IfThere::kReplace : IfThere::kKeep);
}

Status Outputs::write_model(const std::string& path, const Model& model) const {
  RETURN_IF_ERROR(under(path, check_model(model)));
  return write(path, format_model(model));
}

Status Outputs::write_in(const std::string& folder, const NamedTexts& files) const {
  for (const auto& [name, text] : files) {
    if (!text.empty()) RETURN_IF_ERROR(write((fs::path(folder) / name).string(), text));
  }
  return {};
}

void LongOptions::declare(CLI::App& app, Leaves leaves, bool remote) {
  leaves_ = leaves;
  if (leaves != Leaves::kNothing) outputs.declare(app);
  if (leaves != Leaves::kFolder) {
    app.add_option(
           "--keep", keep,
           "Folder for what is simulated, so that a stopped command goes on (default: "
           "OUT.partial or, without a file, one in ~/.local/state/gapfarm; gone when finished)")
        ->type_name("FOLDER");
  }
  farm.declare(app, remote);
  declare_long_command(app);
}

Result<std::unique_ptr<Farm>> LongOptions::begin(const std::string& command,
                                                 std::vector<ProgressStage> stages,
                                                 const FarmSettings& settings,
                                                 CliContext& context) const {
  if (leaves_ != Leaves::kFolder) {
    LongCommand::begin_if_possible(command, keeping_place(keep, command, out), std::move(stages),
                                   context);
  } else {
    const KeepingPlace place{out, /*passing=*/false, /*forget=*/true};
    RETURN_IF_ERROR(LongCommand::begin(command, place, std::move(stages), context));
  }
  return start_recorded(farm, settings, context);
}

void TracedCommands::declare(CLI::App& app, TraceSettings* to) {
  app.add_option("--command", names, "Commands whose paths to look at; omitted: all");
  trials.declare(app, "Where commands are pieces: the pushes to trace, in place of the config's");
  app.add_option("--only", only,
                 "COLUMN=VALUE[,VALUE...]: leave all other pushes out; may repeat, all must hold");
  app.add_option("--interval", to->interval_s, "Seconds between samples of a path")
      ->check(CLI::Range(0.001, 10.0))
      ->capture_default_str();
}

Result<Config> TracedCommands::open(const std::string& path, TraceSettings* to) const {
  ASSIGN_OR_RETURN(Config config, read_config(path));
  RETURN_IF_ERROR(check_can(config.problem.scenario, kTraces, path));
  to->seed = config.seed;
  const std::vector<CommandSpec>& known = config.problem.commands;
  if (names.empty()) to->commands = known;
  for (const std::string& name : names) {
    const CommandSpec* found = find_by(known, name, &CommandSpec::name);
    if (!found) {
      return Error{"there is no command '" + name + "'" + suggestion(name, command_names(known))};
    }
    to->commands.push_back(*found);
  }
  if (to->commands.empty()) {
    return Error{"the scenario has no commands whose paths could be traced"};
  }
  if (config.problem.pieces.empty()) {
    if (trials.files.empty() && only.empty()) return config;
    return Error{path + ": scenario " + config.problem.scenario +
                 " traces commands and no trials; omit --trials and --only"};
  }
  ASSIGN_OR_RETURN(config, read_config_and_trials(path, trials));
  ASSIGN_OR_RETURN(config.problem.log, select_trials(config.problem.log, only));
  const std::vector<Trial>& pushes = config.problem.log.trials;
  for (std::uint32_t i = 0; i < pushes.size(); ++i) {
    const auto wanted = [&](const CommandSpec& c) { return c.name == pushes[i].command; };
    if (std::ranges::any_of(to->commands, wanted)) to->trials.push_back(i);
  }
  if (to->trials.empty()) return Error{path + ": the log has no push of the pieces asked for"};
  return config;
}

}  // namespace gapfarm
