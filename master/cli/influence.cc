// gapfarm influence CONFIG: which parameters move the path further than a repeat does.
#include "master/influence/influence.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/config/config.h"
#include "master/cli/inputs.h"
#include "master/cli/long_command.h"
#include "master/cli/outputs.h"
#include "master/cli/traced.h"

namespace gapfarm {
namespace {

struct InfluenceCommand {
  std::string config;
  std::string out;
  std::string distance = "frechet";
  TracedCommands traced;
  InfluenceSettings settings;
  Outputs outputs;
  FarmOptions farm;
};

nlohmann::ordered_json to_json(const InfluenceReport& report, const ParameterTable& table) {
  // JSON knows no infinity.
  const auto number = [](double v) {
    return std::isfinite(v) ? nlohmann::ordered_json(v) : nlohmann::ordered_json();
  };
  nlohmann::ordered_json factors = nlohmann::ordered_json::array();
  for (const FactorInfluence& f : report.factors) {
    factors.push_back({{"parameter", table[f.gene.row].key},
                       {"alone_m", number(f.alone.distance)},
                       {"alone_at", number(f.alone.value)},
                       {"alone_p", number(f.alone.p)},
                       {"alone_influential", f.alone.influential},
                       {"morris_m", number(f.morris.mean)},
                       {"morris_p", number(f.morris.p)},
                       {"morris_influential", f.morris.influential}});
  }
  return {{"horizon_s", number(report.horizon_s)},
          {"repeat_distance_m", number(report.repeat_distance)},
          {"factors", factors}};
}

int run_influence(InfluenceCommand command, CliContext& context) {
  Result<Config> config = command.traced.open(command.config, &command.settings.trace);
  if (config) {
    command.outputs.reads(command.config);
    command.outputs.reads(config->problem.log);
    const Status planned =
        command.outputs.plan_in(command.out, {"influence.csv", "influence.html", "genes.toml"});
    if (!planned) config = planned.error();
  }
  if (!config) {
    context.console.error(config.error());
    return kExitBadUsage;
  }
  show_notes(config->problem.log, context.console);
  for (std::size_t i = 0; i < path_distances().size(); ++i) {
    if (command.distance == path_distances()[i].name) command.settings.distance = i;
  }
  const ParameterTable& table = config->problem.table();
  const std::vector<Gene> genes =
      config->problem.genes.empty() ? all_base_genes(table) : config->problem.genes;
  if (context.dry_run) {
    return say_dry_run(fmt::format("trace what {} parameters of {} do to paths, into {}",
                                   genes.size(), command.config, command.out),
                       {{"out", command.out}, {"parameters", genes.size()}}, command.farm,
                       config->farm, context);
  }
  // The paths are large, and no figure refers to them.
  const KeepingPlace place{command.out, /*passing=*/false, /*forget=*/true};
  if (Status s = LongCommand::begin("influence", place, {{"trace paths"}}, context); !s) {
    return failed(s.error(), context);
  }
  auto farm = start_farm(command.farm, config->farm, context);
  if (!farm) return failed(farm.error(), context);
  const auto asked = context.work->over(**farm);
  const auto report =
      find_influence(*asked, config->problem, genes, command.settings, context.work->hooks());
  if (!report) return failed(report.error(), context);
  const std::filesystem::path out(command.out);
  const std::pair<const char*, std::string> files[] = {
      {"influence.csv", influence_csv(*report, table)},
      {"influence.html", influence_page(*report, table, command.settings,
                                        "Influence of parameters: " + config->problem.scenario)},
      {"genes.toml", influential_genes(*report, table)},
  };
  for (const auto& [name, text] : files) {
    if (Status s = command.outputs.write((out / name).string(), text); !s) {
      return failed(s.error(), context);
    }
  }
  context.console.result(influence_text(*report, table), to_json(*report, table));
  context.console.note("left behind: " + (out / "influence.html").string() +
                       ", influence.csv, genes.toml");
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
  app.add_option("--out", command->out, "Folder for the tables, the page and genes.toml")
      ->required();
  app.add_option("--distance", command->distance, "Between paths")
      ->check(CLI::IsMember({"lettier", "hausdorff", "frechet"}))
      ->capture_default_str();
  app.add_option("--horizon", to.horizon_s,
                 "Seconds of the paths to compare; left out: as long as repeats stay close")
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
  command->traced.declare(app);
  command->outputs.declare(app);
  command->farm.declare(app, true);
  declare_long_command(app);
  app.footer(
      "Examples:\n"
      "  gapfarm influence configs/racquetball.toml --out influence\n"
      "  gapfarm influence configs/srv1.toml --command forward --distance hausdorff --out "
      "influence\n"
      "then put influence/genes.toml into the config that evolve is to search.");
  return [command](CliContext& context) { return run_influence(*command, context); };
}

}  // namespace gapfarm
