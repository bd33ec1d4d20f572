// gapfarm evolve CONFIG: evolve parameters against a trial log.
#include <spdlog/fmt/fmt.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "common/json/fields.h"
#include "common/trials/files.h"
#include "master/cli/evolution/evolution.h"
#include "master/cli/evolution/search_start.h"
#include "master/cli/subcommand.h"
#include "master/run/run.h"
#include "master/run/run_page.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

// A run's words, to its user.
class OnConsole : public RunWatcher {
 public:
  explicit OnConsole(Console& console) : console_(console) {}
  void note(std::string_view text) override { console_.note(text); }
  void error(const Error& error) override { console_.error(error); }
  void progress(std::string_view text, bool news) override {
    if (text.empty()) return console_.clear_progress();
    console_.progress(text, news);
  }
  void read(const TrialLog& log) override { show_notes(log, console_); }

 private:
  Console& console_;
};

void declare_overrides(EvolutionOverrides& overrides, CLI::App& app) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  app.add_option("--generations", overrides.generations, "Stop after so many generations")
      ->check(CLI::Range(std::uint64_t{1}, kMost, "1+"));
  app.add_option("--evaluations", overrides.evaluations,
                 "Stop after the generation in which so many evaluations are reached")
      ->check(CLI::Range(std::uint64_t{1}, kMost, "1+"));
  app.add_option("--time", overrides.time_s, "Stop after so many seconds")
      ->check(CLI::PositiveNumber);
  app.add_option("--target", overrides.target_fitness, "Stop at this fitness");
  app.add_option("--population", overrides.population, "Individuals")
      ->check(CLI::Range(2, 1000000, "2+"));
}

Result<std::unique_ptr<Farm>> open_farm(const RunStore& store, const Config& config,
                                        const EvolutionOptions& options, Log& log,
                                        const std::function<void(const FarmEvent&)>& keep,
                                        CliContext& context) {
  SocketFarmOptions base;
  base.epoch = store.epoch();
  const RunInfo& run = store.info();
  if (run.fingerprint == build_info().fingerprint) {
    base.admittance.numeric_class = run.numeric_class;
  } else {
    context.console.note("another build made this run (gapfarm " + run.program_version +
                         ", build " + run.fingerprint +
                         "): from here on its numbers are this build's");
  }
  base.shuffle_seed = options.shuffle;
  report_to(log, base);
  base.on_event = [keep, next = base.on_event](const FarmEvent& event) {
    keep(event);
    if (next) next(event);
  };
  ASSIGN_OR_RETURN(auto farm, start_farm(options.farm, config.farm, context, base));
  for (const std::string& endpoint : farm->endpoints()) {
    if (endpoint.rfind("ipc://", 0) != 0) {
      context.console.note("listening for workers: gapfarm-worker --connect " + endpoint);
    }
  }
  return std::unique_ptr<Farm>(std::move(farm));
}

// Where workers of --workers-on find the master that listens there.
Result<std::string> endpoint_of_fleet(const std::vector<std::string>& endpoints) {
  for (const std::string& endpoint : endpoints) {
    if (endpoint.rfind("tcp://", 0) == 0) return reachable(endpoint, host_name());
  }
  return Error{"--workers-on needs an endpoint that workers reach; give --listen tcp://*:PORT"};
}

void add_validation(const RunSummary& summary, const Problem& problem, std::string& text,
                    Json& json) {
  if (summary.validated.empty()) return;
  text += fmt::format("validation on {} {} held out, {}:\n", summary.held_out,
                      problem.windows() ? "windows" : "trials", fitness_name(problem.fitness.kind));
  for (const ScoreRow& row : summary.validated) {
    text += fmt::format("  {:<24} {}\n", row.name,
                        row.score ? fmt::format("{:.6g}", *row.score) : "does not end well");
    json["validation"].push_back({{"name", row.name}, {"fitness", number_or_null(row.score)}});
  }
}

void show(const RunSummary& summary, const RunStore& store, const Problem& problem,
          Console& console) {
  const EvolveSummary& evolved = summary.evolved;
  const FitnessKind kind = problem.fitness.kind;
  Json json = {
      {"run", store.run().string()},        {"state", summary.stopped() ? "stopped" : "finished"},
      {"stop_reason", evolved.text},        {"generations", evolved.generations},
      {"evaluations", evolved.evaluations}, {"wall_s", evolved.wall_s},
      {"fitness", fitness_name(kind)},      {"best_fitness", nullptr}};
  std::string text = evolved.text;
  if (evolved.best && evolved.best->standing.outcome == v1::OK) {
    const double best = fitness_of_cost(kind, evolved.best->standing.cost);
    text += fmt::format("; best {} {:.6g}", fitness_name(kind), best);
    json["best_fitness"] = best;
  }
  text += fmt::format(" after {} generations, {} evaluations, {}\n", evolved.generations,
                      evolved.evaluations, format_duration(evolved.wall_s));
  add_validation(summary, problem, text, json);
  for (const std::string& file : summary.files) json["files"].push_back(file);
  if (!summary.files.empty()) {
    text += fmt::format("wrote: {}\n", fmt::join(summary.files, ", "));
  }
  if (!summary.stopped()) json["given_up"] = summary.given_up;
  console.result(text, json);
}

struct EvolveCommand {
  std::string config;
  TrialOptions trials;
  std::string out;
  std::string from;
  std::optional<std::uint64_t> seed;
  EvolutionOptions options;
};

std::string what_evolves(const Problem& problem) {
  const FitnessSettings& fitness = problem.fitness;
  const std::string parameters = std::to_string(problem.genes.size()) + " parameters ";
  if (!is_value(fitness.kind)) {
    return parameters + "on " + std::to_string(problem.log.trials.size()) + " trials";
  }
  if (!fitness.objectives.empty()) {
    return parameters + "to the front of " +
           joined(fitness.objectives, " and ", &SearchedObjective::name);
  }
  return parameters + "to the " + (higher_is_better(fitness.kind) ? "greatest" : "least") +
         " value";
}

Result<int> print_plan(const EvolveCommand& command, const Config& config, CliContext& context) {
  const std::size_t genes = config.problem.genes.size(), trials = config.problem.log.trials.size();
  const std::string would =
      fmt::format("evolve {} into {}, seed {}, population {}, at most {} generations",
                  what_evolves(config.problem), command.out, config.seed,
                  config.evolution.population, config.evolution.generations);
  return print_evolution_dry_run(would,
                                 {{"out", command.out},
                                  {"genes", genes},
                                  {"trials", trials},
                                  {"seed", config.seed},
                                  {"population", config.evolution.population},
                                  {"generations", config.evolution.generations}},
                                 command.options, config.farm, context);
}

Result<int> run_evolve(EvolveCommand command, CliContext& context) {
  RETURN_IF_ERROR(command.options.complete());
  const std::unique_ptr<Log> log = command.options.farm.open_log();
  const NotesGoTo notes(*log, context.console);
  ASSIGN_OR_RETURN(
      const auto config,
      open_config(command.config, command.trials, context.console, [&](Config& read) -> Status {
        command.options.overrides.apply(read.evolution);
        if (command.seed) read.seed = *command.seed;
        RETURN_IF_ERROR(check_runnable(read));
        if (!command.from.empty())
          RETURN_IF_ERROR(begin_at(command.from, read, command.config, context.console));
        RETURN_IF_ERROR(check_farm(command.options.farm, read.farm));
        return command.options.plan(command.out, read, command.from);
      }));
  show_warnings(config.problem, config.trial_files, context.console);
  if (context.dry_run) {
    RETURN_IF_ERROR(RunStore::check_free(command.out));
    return print_plan(command, config, context);
  }
  context.console.note(command.out + ": evolving " + what_evolves(config.problem) + ", seed " +
                       std::to_string(config.seed));
  return begin_run(command.out, config, command.options, command.options.overrides, *log, context);
}

}  // namespace

void EvolutionOptions::declare(CLI::App& app) {
  declare_overrides(overrides, app);
  outputs.declare(app);
  farm.declare(app, true);
  fleet.declare(app, "--workers-on");
  page.declare(app);
  declare_long_command(app);
  app.add_option("--shuffle", shuffle,
                 "Hand jobs out in an order shuffled by this seed; the results do not change")
      ->group("");  // for tests
}

Result<int> print_evolution_dry_run(std::string would, Json facts, const EvolutionOptions& options,
                                    const FarmSettings& settings, CliContext& context) {
  if (!options.fleet.system.empty()) {
    ASSIGN_OR_RETURN(const std::string endpoint, endpoint_of_fleet(options.farm.listen));
    ASSIGN_OR_RETURN(const FleetLoopOptions loop,
                     fleet_of(options.fleet, endpoint, options.farm.keys, options.farm.insecure));
    const FleetLimits& limits = loop.fleet.limits;
    std::string submission =
        Fleet(loop.fleet, {}, {}).submission_text(limits.max_workers / limits.workers_per_job);
    facts["submission"] = submission;
    submission.pop_back();
    would += fmt::format("\nwould submit up to {} workers by\n{}", limits.max_workers, submission);
  }
  return print_dry_run(would, std::move(facts), options.farm, settings, context);
}

Status EvolutionOptions::complete() {
  if (fleet.system.empty()) return {};
  RETURN_IF_ERROR(fleet.check());
  if (farm.workers < 0) farm.workers = 0;
  if (farm.listen.empty()) {
    farm.listen = {fleet.system == "local" ? "tcp://127.0.0.1:*" : "tcp://*:*"};
  }
  return {};
}

Status EvolutionOptions::plan(const std::string& out, const Config& config,
                              const std::string& from) {
  RETURN_IF_ERROR(check_folder(out, FolderKind::kRun));
  // RunStore::create() says that a run is there, or that no folder can be.
  if (!is_there(out) || is_there(run_store_file(out))) return {};
  ASSIGN_OR_RETURN(const auto stages, read_stages(config));
  outputs.reads(config);
  outputs.reads(from);
  for (const auto* files : {&config.trial_files, &stages.validation_files}) {
    for (const std::string& file : *files) outputs.reads(file);
    outputs.reads_runs(*files);
  }
  std::vector<std::string> names = output_files(config.problem);
  names.push_back("log.txt");
  for (const std::string& name : names) {
    RETURN_IF_ERROR(outputs.plan((std::filesystem::path(out) / name).string()));
  }
  return {};
}

Result<int> begin_run(const std::string& out, const Config& config, const EvolutionOptions& options,
                      const EvolutionOverrides& overrides, Log& log, CliContext& context) {
  if (context.stop.requested()) return kExitSignalBase + context.stop.signal();
  const bool folder_was_there = is_there(out);
  ASSIGN_OR_RETURN(RunStore store, RunStore::create(out, run_info(config, overrides)));
  const int code = run_evolution(store, config, options, log, context);
  const auto checkpoint = store.checkpoint();
  if (code == kExitFailed && checkpoint && !*checkpoint) {
    if (Status s = RunStore::discard(std::move(store), !folder_was_there); !s) {
      context.console.error(s.error());
    }
  }
  return code;
}

int run_evolution(RunStore& store, const Config& config, const EvolutionOptions& options, Log& log,
                  CliContext& context) {
  context.begun = true;  // a run folder was made or opened
  const std::string run = store.run().string();
  log.set({"run", run});
  // Without it the run goes on all the same.
  if (Status s = context.console.keep((store.run() / "log.txt").string()); !s) {
    context.console.error(s.error());
  }
  log.copy_to(context.console.kept());
  OnConsole watcher(context.console);
  std::shared_ptr<void> page;
  std::unique_ptr<OwnedChild> beside;
  const auto farm = [&](const auto& keep) -> Result<std::unique_ptr<Farm>> {
    ASSIGN_OR_RETURN(page, open_page(options.page, store.run(), context));
    auto made = open_farm(store, config, options, log, keep, context);
    if (!made || options.fleet.system.empty()) return made;
    ASSIGN_OR_RETURN(const std::string endpoint, endpoint_of_fleet((*made)->endpoints()));
    ASSIGN_OR_RETURN(beside, start_workers_beside(options.fleet, endpoint, options.farm.keys,
                                                  options.farm.insecure));
    return made;
  };
  const auto summary = evolve_run(
      store, {config, config.problem, log, farm, [&] { return context.stop.requested(); }},
      watcher);
  if (!summary) return failed(summary.error(), context);
  show(*summary, store, config.problem, context.console);
  if (summary->stopped()) {
    context.console.note("continue with: gapfarm resume " + shell_quoted(run));
    return kExitResumable;
  }
  const auto& best = summary->evolved.best;
  if (best && best->standing.outcome != v1::OK) {
    const std::string why = summary->failure.empty() ? "" : ": " + summary->failure;
    context.console.note("there is no model" + why + "; what happened: gapfarm status " +
                         shell_quoted(run));
    return kExitFailed;
  }
  if (summary->given_up == 0) return kExitDone;
  context.console.note(fmt::format(
      "{} given up; which and why: gapfarm status {}",
      summary->given_up == 1 ? "1 task was" : std::to_string(summary->given_up) + " tasks were",
      shell_quoted(run)));
  return kExitQuarantined;
}

SubcommandRun setup_evolve(CLI::App& app) {
  auto command = std::make_shared<EvolveCommand>();
  app.add_option("CONFIG", command->config, "Config file (TOML)")->required();
  command->trials.declare(app);
  command->trials.needed = false;
  app.add_option("--out", command->out, "Run folder to make")->required();
  app.add_option("--seed", command->seed, "In place of the config's");
  app.add_option("--from", command->from,
                 "Run, model or CSV table of genes whose values the search begins at")
      ->type_name("RUN|MODEL|TABLE");
  command->options.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm evolve configs/demo.toml --out run/demo\n"
      "  gapfarm evolve configs/srv1.toml --trials monday.csv tuesday.csv --out run/srv1\n"
      "  gapfarm evolve configs/demo.toml --from candidates.csv --out run/again\n"
      "  gapfarm evolve configs/demo.toml --out run/big --workers-on slurm --max 200 --wall-time "
      "4:00:00");
  return [command](CliContext& context) { return run_evolve(*command, context); };
}

}  // namespace gapfarm
