// gapfarm influence CONFIG: which parameters move the path further than a repeat does.

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "master/cli/subcommand.h"
#include "master/command/outputs.h"

namespace gapfarm {
namespace {

struct InfluenceCommand : LongOptions {
  std::string config;
  std::string distance = "frechet";
  TracedCommands traced;
  InfluenceSettings settings;
};

Json to_json(const InfluenceReport& report, const ParameterTable& table) {
  Json factors = Json::array();
  for (const FactorInfluence& f : report.factors) {
    factors.push_back({{"parameter", table[f.gene.row].key},
                       {"alone_m", f.alone.distance},
                       {"alone_at", f.level},
                       {"alone_p", f.alone.p},
                       {"alone_influential", f.alone.influential},
                       {"morris_m", f.morris.distance},
                       {"morris_p", f.morris.p},
                       {"morris_influential", f.morris.influential}});
  }
  return {{"horizon_s", report.horizon_s},
          {"repeat_distance_m", report.repeat_distance},
          {"factors", factors}};
}

Result<int> run_influence(InfluenceCommand command, CliContext& context) {
  ASSIGN_OR_RETURN(const Config config,
                   command.traced.open(command.config, &command.settings.trace));
  command.outputs.reads(config);
  RETURN_IF_ERROR(command.outputs.plan_in(command.out, {"influence.csv", "genes.toml"}));
  if (const auto& horizon = command.settings.horizon_s;
      horizon && *horizon < command.settings.trace.interval_s) {
    return Error{
        fmt::format("--horizon {} s is shorter than --interval, {} s, so no pose lies in it",
                    *horizon, command.settings.trace.interval_s)};
  }
  show_notes(config.problem.log, context.console);
  for (std::size_t i = 0; i < kPathDistances.size(); ++i) {
    if (command.distance == kPathDistances[i].name) command.settings.distance = i;
  }
  const ParameterTable& table = config.problem.table();
  const std::vector<Gene> genes =
      config.problem.genes.empty() ? all_base_genes(table) : config.problem.genes;
  if (context.dry_run) {
    return print_dry_run(fmt::format("trace what {} parameters of {} do to paths, into {}",
                                     genes.size(), command.config, command.out),
                         {{"out", command.out}, {"parameters", genes.size()}}, command.farm,
                         config.farm, context);
  }
  ASSIGN_OR_RETURN(const auto asked,
                   command.begin("influence", {{"trace paths"}}, config.farm, context));
  ASSIGN_OR_RETURN(const auto report, find_influence(*asked, config.problem, genes,
                                                     command.settings, context.work->hooks()));
  RETURN_IF_ERROR(
      command.outputs.write_in(command.out, {{"influence.csv", influence_csv(report, table)},
                                             {"genes.toml", influential_genes(report, table)}}));
  context.console.result(influence_text(report, table), to_json(report, table));
  context.console.note("wrote: " + (std::filesystem::path(command.out) / "influence.csv").string() +
                       ", genes.toml");
  return kExitDone;
}

}  // namespace

SubcommandRun setup_influence(CLI::App& app) {
  auto command = std::make_shared<InfluenceCommand>();
  InfluenceSettings& to = command->settings;
  app.add_option("CONFIG", command->config,
                 "The standard; its [genes] say what to vary and how far, without them every base "
                 "parameter varies over its range")
      ->required();
  app.add_option("--out", command->out, "Folder for influence.csv and genes.toml")->required();
  app.add_option("--distance", command->distance, "Between paths")
      ->check(CLI::IsMember({"lettier", "hausdorff", "frechet"}))
      ->capture_default_str();
  app.add_option("--horizon", to.horizon_s,
                 "Seconds of the paths to compare; omitted: as long as repeats stay close")
      ->check(CLI::PositiveNumber);
  app.add_option("--repeats", to.repeats, "Noisy runs of each level")
      ->check(CLI::Range(4, 10000))
      ->capture_default_str();
  app.add_option("--levels", to.levels, "Levels of a real parameter")
      ->check(CLI::Range(2, 64))
      ->capture_default_str();
  app.add_option("--trajectories", to.trajectories, "Random walks of Morris's method")
      ->check(CLI::Range(4, 100000))
      ->capture_default_str();
  command->traced.declare(app, &to.trace);
  command->declare(app, LongOptions::Leaves::kFolder, true);
  app.footer(
      "Examples:\n"
      "  gapfarm influence configs/racquetball.toml --out influence\n"
      "  gapfarm influence configs/srv1.toml --command forward --distance hausdorff --out "
      "influence\n"
      "then put influence/genes.toml into the config that evolve is to search.");
  return [command](CliContext& context) { return run_influence(*command, context); };
}

}  // namespace gapfarm
