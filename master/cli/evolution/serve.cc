// gapfarm serve [DIR...]: runs and diagnoses in a browser, from their stores alone.

#include <spdlog/fmt/fmt.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "common/score/motion_model.h"
#include "common/trials/files.h"
#include "master/cli/subcommand.h"
#include "master/command/inputs.h"
#include "master/command/page_along.h"
#include "master/farm/planned_trials.h"
#include "master/ground/paths.h"
#include "master/run/run_page.h"
#include "master/serve/http_server.h"
#include "master/serve/site.h"
#include "master/store/database.h"
#include "master/store/run_lock.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPlayedInterval_s = 0.02;
constexpr std::size_t kMostPlayed = 400;  // samples of a path
constexpr double kWindowInterval_s = 0.04;
constexpr double kMostOfWindow = 150;   // samples, each a question of its own
constexpr std::size_t kMostKept = 200;  // answers

// More digits than a screen can show would only be sent.
double micro(double value) { return std::round(1e6 * value) / 1e6; }

Json path_json(const std::vector<PathSample>& path, const Pose& X_WS) {
  Json list = Json::array();
  const std::size_t each = std::max<std::size_t>(1, (path.size() + kMostPlayed - 1) / kMostPlayed);
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i % each != 0 && i + 1 != path.size()) continue;
    const Pose X_SP = between(X_WS, path[i].pose);
    list.push_back({path[i].t_s, micro(X_SP.x), micro(X_SP.y), micro(X_SP.theta)});
  }
  return list;
}

// Where a drive's path was not logged, its end alone.
Json measured_json(const Trial& trial, double duration_s) {
  if (trial.path.size() > 1) return path_json(trial.path, trial.X_WS);
  const Pose X_SE = between(trial.X_WS, trial.X_WE);
  return Json::array({{duration_s, X_SE.x, X_SE.y, X_SE.theta}});
}

// Overrides that take everything random out of `values`, the problem's own.
std::vector<v1::Override> muted(const Problem& problem, ParameterValues values) {
  const ParameterTable& table = problem.table();
  table.without_chance(&values);
  for (std::size_t row = 0; row < table.size(); ++row) {
    const std::string& key = table[row].key;
    const bool noise = key.starts_with("drive_noise_") || key.starts_with("push_noise_") ||
                       key.starts_with("pose_noise_");
    if (noise) values[row] = table[row].lower;
  }
  return overrides_of(problem.values, values);
}

v1::Task drive_task(const Problem& problem, const Trial& trial, const ParameterValues& values) {
  v1::PlannedTrial planned;
  *planned.mutable_trial() = to_proto(trial);
  planned.mutable_trial()->clear_path();
  planned.set_moved(true);
  return simulate_tasks({{planned}}, muted(problem, values), 1, kPlayedInterval_s)[0];
}

// What is shown of one drive, and whose simulation did not end well.
struct Watched {
  Json json;
  std::string failed;

  void put(const char* name, const std::vector<PathSample>& path, const Pose& X_WS,
           const std::string& outcome) {
    if (path.empty()) {
      failed += fmt::format(" {} ends with {}.", name, outcome);
    } else {
      json[name] = path_json(path, X_WS);
    }
  }
};

constexpr const char* kSimulated[] = {"before", "best"};

// What was pushed, by whom: outline in the piece's frame, and the finger's way from its start.
void add_push(const Piece& piece, const Trial& trial, Json* json) {
  for (const Eigen::Vector2d& corner : piece.corners) {
    (*json)["outline"].push_back({micro(corner.x()), micro(corner.y())});
  }
  const Pose X_SW = inverse(trial.X_WS);
  for (const TipSample& tip : trial.tip) {
    const Eigen::Vector2d p_ST = transform(X_SW, {tip.x, tip.y});
    (*json)["finger"].push_back({tip.t_s, micro(p_ST.x()), micro(p_ST.y()), 0});
  }
}

Result<Watched> watch_trial(Farm& farm, const Problem& problem, const Trial& trial,
                            const Genome& best) {
  ASSIGN_OR_RETURN(const auto results,
                   farm.run(farm.add_problem(to_proto(problem)),
                            {drive_task(problem, trial, problem.values),
                             drive_task(problem, trial, problem.values_of(best))}));
  const bool pushed = !problem.pieces.empty();
  const double duration_s = pushed ? trial.tip.empty() ? 0 : trial.tip.back().t_s
                                   : resolved_command(trial, problem.commands).duration_s;
  Watched watched;
  watched.json = {{"duration_s", duration_s}, {"measured", measured_json(trial, duration_s)}};
  if (pushed) add_push(problem.piece(trial.command), trial, &watched.json);
  for (std::size_t k = 0; k < results.size(); ++k) {
    const v1::TaskResult& result = results[k];
    Trial simulated;
    if (result.outcome() == v1::OK) simulated = from_proto(result.simulate().trials(0));
    watched.put(kSimulated[k], simulated.path, simulated.X_WS, v1::Outcome_Name(result.outcome()));
  }
  return watched;
}

Result<Watched> watch_window(Farm& farm, const Problem& problem, const Trial& window,
                             const Genome& best, std::vector<PathSample> measured) {
  const auto samples = static_cast<std::size_t>(
      std::clamp(*window.duration_s / kWindowInterval_s, 10.0, kMostOfWindow));
  ASSIGN_OR_RETURN(const auto simulated,
                   simulate_window(farm, problem, window, {{}, best}, samples));
  Trial trial = window;
  trial.path = std::move(measured);
  Watched watched;
  watched.json = {{"duration_s", *window.duration_s},
                  {"measured", measured_json(trial, *window.duration_s)}};
  for (std::size_t k = 0; k < simulated.size(); ++k) {
    watched.put(kSimulated[k], simulated[k].path, window.X_WS, simulated[k].failed);
  }
  return watched;
}

Result<RunReader::Member> best_of(const RunReader& reader,
                                  std::optional<std::uint64_t> generation) {
  if (!generation) {
    ASSIGN_OR_RETURN(const auto generations, reader.generations());
    if (generations.empty()) return Error{"no generation was completed yet; look again later"};
    generation = generations.back().generation;
  }
  ASSIGN_OR_RETURN(const auto individuals, reader.individuals(*generation));
  if (individuals.empty()) {
    return Error{"the run has no generation " + std::to_string(*generation)};
  }
  if (individuals.front().outcome != "OK") return Error{"nothing of it ended well"};
  return RunReader::Member{*generation, individuals.front()};
}

std::string title_of(const Trial& trial, std::size_t number, bool window) {
  if (window) {
    return fmt::format("Window {} ({}, from {:.2f} s on)", number, trial.session, *trial.t_s);
  }
  return fmt::format("Trial {} ({}, {} of session {})", number, trial.command, trial.trial,
                     trial.session);
}

// The poses between a window's ends, from the log that the run was evolved on or held out.
std::vector<PathSample> logged_window(const RunInfo& info, const Problem& problem,
                                      const Trial& window, bool apart) {
  Config config;
  if (auto read = parse_stored(info, problem)) {
    config = *std::move(read);
  }
  std::vector<std::string> folders = config.trial_files;
  if (apart) {
    const auto plan = read_stages(config);
    if (!plan) return {};
    folders = plan->validation_files;
  }
  const auto log = read_run_folders(folders, problem.ground->robot().channels);
  return log ? measured_window(*log, window) : std::vector<PathSample>();
}

// Simulates on one worker of its own, which begins with the first question.  No run's farm is
// asked.
class DriveShower {
 public:
  explicit DriveShower(CliContext& context) : context_(context) {}

  // JSON for watch.js: paths of [t s, x m, y m, heading rad] from the start, by the config's values
  // ("before") and by the best of the generation ("best"), both without noise.  Errors: no such
  // trial or generation, a drive that does not end well.
  Result<std::string> show(const DriveQuestion& question) {
    ASSIGN_OR_RETURN(const auto reader, RunReader::open(question.run));
    ASSIGN_OR_RETURN(const auto problem, stored_problem(reader));
    // Those that were evolved on, then those that were held out, where they can still be read.
    const std::size_t logged = problem.log.trials.size();
    const auto apart = question.trial < logged ? Result<std::optional<Problem>>(std::nullopt)
                                               : held_out_of(reader.info(), problem);
    const bool beyond = question.trial >= logged;
    const std::size_t extra = apart && *apart ? (*apart)->log.trials.size() : 0;
    if (beyond && question.trial - logged >= extra) {
      return Error{fmt::format("the run has {} {}, those that it held out included, and no {}",
                               logged + extra, problem.ground ? "windows" : "trials",
                               question.trial + 1)};
    }
    ASSIGN_OR_RETURN(const auto best, best_of(reader, question.generation));
    const std::string key =
        fmt::format("{}|{}|{}|{}", question.run.string(), reader.info().problem_hash,
                    question.trial, best.individual.birth_id);
    if (const auto known = shown_.find(key); known != shown_.end()) return known->second;
    if (!farm_) {
      ASSIGN_OR_RETURN(farm_, start_farm({.workers = 1}, {}, context_));
    }
    const Problem& of = beyond ? **apart : problem;
    const Trial& trial = of.log.trials[beyond ? question.trial - logged : question.trial];
    ASSIGN_OR_RETURN(auto drive, of.ground
                                     ? watch_window(*farm_, of, trial, best.individual.genome,
                                                    logged_window(reader.info(), of, trial, beyond))
                                     : watch_trial(*farm_, problem, trial, best.individual.genome));
    Json json = {{"title", title_of(trial, question.trial + 1, of.ground != nullptr) +
                               (beyond ? ", held out" : "")},
                 {"held_out", beyond}};
    json.update(drive.json);
    json["said"] = fmt::format(
        "Best: genome {} of generation {}, {} {}.{}", best.individual.birth_id, best.generation,
        reader.info().fitness,
        best.individual.fitness ? fmt::format("{:.6g}", *best.individual.fitness) : "unknown",
        drive.failed);
    json["note"] = fmt::format(
        "{}{}",
        beyond ? fmt::format("▲ Held out: evolution never saw this {}. ",
                             of.ground ? "window" : "trial")
               : "",
        json["measured"].size() > 1 ? ""
        : of.ground
            ? "Faint: the log of the runs cannot be read (any more), an arc joins the start "
              "to the measured end."
            : "Faint: no path was measured, an arc joins the start to the measured end.");
    if (shown_.size() >= kMostKept) shown_.clear();
    return shown_[key] = json_text(json);
  }

 private:
  CliContext& context_;
  std::unique_ptr<SocketFarm> farm_;
  std::map<std::string, std::string> shown_;  // answers to what was asked
};

constexpr int kPatience_ms = 500;

struct ServeOptions {
  std::vector<std::string> folders = {"."};
  unsigned port = kPagePort;
};

double thread_cpu_now_s() {
  timespec t = {};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Result<int> run_serve(const ServeOptions& options, CliContext& context) {
  for (const std::string& folder : options.folders) {
    if (is_folder(folder)) continue;
    return Error{folder + ": no such folder; name one with runs or diagnoses"};
  }
  // A master commits within milliseconds; who holds a store for longer is not waited for, since
  // everybody else would wait, too.
  set_database_patience_ms(kPatience_ms);
  DriveShower shower(context);
  SiteSources sources;
  sources.folders.assign(options.folders.begin(), options.folders.end());
  sources.unix_now_s = unix_now_s;
  sources.cpu_now_s = thread_cpu_now_s;
  sources.read_run = read_run_report;
  sources.drive = [&](const DriveQuestion& question) { return shower.show(question); };
  Site site(std::move(sources));
  ASSIGN_OR_RETURN(auto server, HttpServer::listen(static_cast<std::uint16_t>(options.port),
                                                   [&](const HttpRequest& request) {
                                                     return site.answer(request);
                                                   }));
  const std::string port = std::to_string(server->port());
  const std::string address = "http://127.0.0.1:" + port + "/";
  const std::string tunnel = "ssh -L " + port + ":127.0.0.1:" + port + " " + host_name();
  context.console.result(
      "serving " + address + "\nfrom another machine: " + tunnel + ", then open " + address + "\n",
      {{"address", address}, {"ssh", tunnel}});
  server->run(context.stop.fd());
  return kExitSignalBase + context.stop.signal();
}

}  // namespace

SubcommandRun setup_serve(CLI::App& app) {
  auto options = std::make_shared<ServeOptions>();
  app.add_option("DIR", options->folders, "Folders; what lies up to four folders beneath is found")
      ->capture_default_str();
  app.add_option("--port", options->port, "On 127.0.0.1; 0: any that is free")
      ->check(CLI::Range(0u, 65535u))
      ->capture_default_str();
  app.footer(
      "Examples:\n"
      "  gapfarm serve\n"
      "  gapfarm serve run diagnosis --port 9000\n"
      "It reads stores and needs no master; nothing can be changed through it.  Ctrl-C ends it.");
  return [options](CliContext& context) { return run_serve(*options, context); };
}

}  // namespace gapfarm
