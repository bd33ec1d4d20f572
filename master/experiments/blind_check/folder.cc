#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/clock.h"
#include "common/json/fields.h"
#include "common/json/json.h"
#include "common/process/child.h"
#include "common/trials/files.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/experiments/blind_check/blind_check.h"

namespace gapfarm {
namespace {

constexpr double kGrace_s = 5;  // between asking and making a child end
constexpr int kTick_ms = 100;   // after which an end is seen

struct Child {
  const ChildJob* job = nullptr;
  pid_t pid = 0;
  double started_s = 0;
  std::optional<double> asked_s;  // to end, beyond its limit
};

Result<Child> start_job(const ChildJob& job) {
  const int log = open(job.log_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (log < 0) return Error{job.log_path + ": cannot be written: " + std::strerror(errno)};
  ChildSetup setup;
  setup.arguments = job.argv;
  setup.out = setup.err = log;
  setup.leads_group = true;
  const Result<pid_t> pid = start_child(setup);
  close(log);
  if (!pid) return Error{"cannot start " + job.argv[0] + ": " + pid.error().message};
  return Child{&job, *pid, monotonic_seconds(), {}};
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

ChildEnd end_of(const Child& child, int status, const rusage& used,
                const ChildrenOptions& options) {
  ChildEnd end;
  end.wall_s = monotonic_seconds() - child.started_s;
  end.cpu_s = seconds_of(used.ru_utime) + seconds_of(used.ru_stime);
  if (child.asked_s) {
    end.state = ChildState::kTimedOut;
    end.text = "did not end within " + std::to_string(std::lround(options.time_limit_s)) + " s";
  } else if (WIFEXITED(status)) {
    end.status = WEXITSTATUS(status);
    if (!options.done(end.status)) {
      end.state = ChildState::kFailed;
      end.text = end_text(status);
    }
  } else {
    end.state = ChildState::kCrashed;
    end.status = WTERMSIG(status);
    end.text = end_text(status);
  }
  return end;
}

// The children that run now.
class Crowd {
 public:
  explicit Crowd(const ChildrenOptions& options) : options_(options) {}
  ~Crowd() {
    for (const Child& child : children_) kill(-child.pid, SIGTERM);
    const double until = monotonic_seconds() + kGrace_s;
    for (const Child& child : children_) {
      int status = 0;
      await_child(child.pid, until - monotonic_seconds(), &status);
      kill(-child.pid, SIGKILL);  // what is left of it
    }
  }
  Crowd& operator=(Crowd&&) = delete;

  std::size_t size() const { return children_.size(); }
  void add(const Child& child) { children_.push_back(child); }

  // Reports the children that ended; returns how many.
  std::size_t reap() {
    std::size_t ended = 0;
    for (std::size_t i = 0; i < children_.size();) {
      int status = 0;
      rusage used = {};
      if (wait4(children_[i].pid, &status, WNOHANG, &used) != children_[i].pid) {
        ++i;
        continue;
      }
      const Child child = children_[i];
      children_.erase(children_.begin() + static_cast<long>(i));
      kill(-child.pid, SIGKILL);
      ++ended;
      const ChildEnd end = end_of(child, status, used, options_);
      options_.on_end(*child.job, end);
    }
    return ended;
  }

  void enforce_limit() {
    const double now = monotonic_seconds();
    for (Child& child : children_) {
      if (!child.asked_s && now - child.started_s > options_.time_limit_s) {
        child.asked_s = now;
        kill(-child.pid, SIGTERM);
      } else if (child.asked_s && now - *child.asked_s > kGrace_s) {
        kill(-child.pid, SIGKILL);
      }
    }
  }

 private:
  const ChildrenOptions& options_;
  std::vector<Child> children_;
};

constexpr auto kOutOfReach = [](auto& v, auto& row) { FIELDS(effect, level, size); };
constexpr auto kCheckState = [](auto& v, auto& row) {
  FIELDS(asked);
  v.list("out_of_reach", row.out_of_reach, kOutOfReach);
};
constexpr auto kChildEnd = [](auto& v, auto& row) { FIELDS(status, wall_s, cpu_s, text); };

std::vector<std::string> diagnose_command(const OpenCase& open, std::size_t number,
                                          const CheckPaths& paths,
                                          const DiagnoseSettings& settings) {
  std::vector<std::string> arguments = settings.command;
  arguments.insert(
      arguments.end(),
      {settings.config_path, "--trials", open.trials, "--out", paths.diagnosis(open.id),
       "--workers", std::to_string(settings.workers), "--seed", std::to_string(number)});
  // In a case's folder nothing lies but the case: its paths need no mark.
  const std::filesystem::path recorded =
      std::filesystem::path(open.trials).parent_path() / "paths.csv";
  std::error_code code;
  if (std::filesystem::exists(recorded, code)) {
    arguments.insert(arguments.end(), {"--paths", recorded.string()});
  }
  if (!settings.model_path.empty()) {
    arguments.insert(arguments.end(), {"--model", settings.model_path});
  }
  if (!open.excluded.empty()) {
    // An effect that passes for another one is no stranger while the other one is there.
    arguments.insert(arguments.end(), {"--exclude", open.excluded});
    for (const char* alias : effect_diagnosis(open.excluded).aliases) arguments.emplace_back(alias);
  }
  return arguments;
}

Status write_outcome(const ChildEnd& end, const std::string& path) {
  Json json = {{"outcome", child_state_name(end.state)}};
  json.update(FieldWriter::written(end, kChildEnd));
  return write_file_atomically(path, json_text(json, 1) + "\n");
}

// A diagnosis that was cut short goes on with what it simulated; nothing else of it stays.
Status make_empty(const std::string& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  std::vector<std::filesystem::path> others;
  for (const auto& entry : std::filesystem::directory_iterator(folder, code)) {
    if (entry.path().filename() != "simulations.sqlite") others.push_back(entry.path());
  }
  for (const std::filesystem::path& other : others) std::filesystem::remove_all(other, code);
  if (code) return Error{folder + ": cannot be made: " + code.message()};
  return {};
}

}  // namespace

const char* child_state_name(ChildState state) {
  static constexpr const char* kNames[] = {"done", "failed", "crashed", "timeout"};
  return kNames[static_cast<std::size_t>(state)];
}

Status run_children(const std::vector<ChildJob>& jobs, const ChildrenOptions& options) {
  Crowd crowd(options);
  std::size_t started = 0;
  std::size_t ended = 0;
  while (ended < jobs.size()) {
    if (options.stop && options.stop->requested()) return stop_requested();
    while (started < jobs.size() && crowd.size() < std::max(1u, options.at_once)) {
      ASSIGN_OR_RETURN(const Child child, start_job(jobs[started]));
      crowd.add(child);
      ++started;
    }
    pollfd stop = {options.stop ? options.stop->fd() : -1, POLLIN, 0};
    poll(&stop, 1, kTick_ms);
    ended += crowd.reap();
    crowd.enforce_limit();
    options.on_tick(ended);
  }
  return {};
}

Status write_check_state(const CheckState& state, const std::string& path) {
  Json json = {{"version", 1}};
  json.update(FieldWriter::written(state, kCheckState));
  return write_file_atomically(path, json_text(json, 1) + "\n");
}

Result<CheckState> read_check_state(const std::string& path) {
  ASSIGN_OR_RETURN(const std::string text, read_text_file(path));
  const Json json = parse_json(text);
  if (!json.is_object() || !json.value("asked", Json()).is_string()) {
    return Error{path + ": is not the state of a blind check; choose another --out"};
  }
  return FieldReader::read<CheckState>(json, kCheckState);
}

Status diagnose_cases(const std::vector<OpenCase>& cases, const CheckPaths& paths,
                      const DiagnoseSettings& settings, const BlindCheckHooks& hooks) {
  std::vector<ChildJob> jobs;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const std::string& id = cases[i].id;
    if (std::filesystem::exists(paths.outcome(id))) continue;
    RETURN_IF_ERROR(make_empty(paths.diagnosis(id)));
    jobs.push_back({id, diagnose_command(cases[i], i + 1, paths, settings),
                    paths.diagnosis(id) + "/output.txt"});
  }
  if (jobs.size() < cases.size()) {
    hooks.note(std::to_string(cases.size() - jobs.size()) + " cases are diagnosed already");
  }
  hooks.stages.began(2);
  Status written;
  ChildrenOptions options;
  options.at_once = settings.jobs;
  options.time_limit_s = settings.time_limit_s;
  options.stop = hooks.stop;
  // 3: some tasks were given up, but there is an answer.
  options.done = [](int status) { return status == 0 || status == 3; };
  options.on_end = [&](const ChildJob& job, const ChildEnd& end) {
    if (Status s = write_outcome(end, paths.outcome(job.id)); !s) written = s;
    if (end.state != ChildState::kDone) {
      hooks.note(job.id + ": the diagnosis " + end.text + "; see " + job.log_path);
    }
  };
  options.on_tick = [&](std::size_t ended) { hooks.diagnosed(ended, jobs.size()); };
  RETURN_IF_ERROR(run_children(jobs, options));
  return written;
}

ChildEnd read_outcome(const std::string& path) {
  const Result<std::string> text = read_text_file(path);
  const Json json = text ? parse_json(*text) : Json();
  auto end = FieldReader::read<ChildEnd>(json, kChildEnd);
  if (!json.is_object()) {
    end.state = ChildState::kFailed;
    end.text = "has no outcome";
    return end;
  }
  const std::string name = json.value("outcome", "");
  for (const ChildState state :
       {ChildState::kDone, ChildState::kFailed, ChildState::kCrashed, ChildState::kTimedOut}) {
    if (name == child_state_name(state)) end.state = state;
  }
  return end;
}

std::optional<Diagnosis> read_reported(const std::string& folder, ChildEnd& end) {
  if (end.state != ChildState::kDone) return std::nullopt;
  const Result<std::string> text = read_text_file(folder + "/diagnosis.json");
  Result<Diagnosis> reported = text ? parse_diagnosis(*text) : text.error();
  if (reported && reported->verdict == Verdict::kUnusable) {
    reported = Error{"its log is unusable"};
  }
  if (!reported) {
    end.text = "left no readable diagnosis (" + reported.error().message + ")";
    return std::nullopt;
  }
  reported->trials.clear();  // of hundreds of cases, and nobody asks for them
  reported->drives.clear();
  return std::move(*reported);
}

}  // namespace gapfarm
