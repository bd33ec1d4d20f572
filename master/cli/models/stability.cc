// gapfarm stability CONFIG: where tiny changes of the start change the outcome least.
#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "common/json/fields.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"

namespace gapfarm {
namespace {

struct StabilityCommand : LongOptions {
  std::string config;
  TracedCommands traced;
  StabilitySettings settings;
};

std::string spread_text(const std::optional<double>& spread) {
  return spread ? fmt::format("{:.4g} m", *spread) : std::string("does not end well");
}

std::string tried_csv(const StabilityReport& report, const Problem& problem) {
  std::string text = "spread_m";
  for (const Gene& gene : problem.genes) text += "," + problem.table()[gene.row].key;
  text += "\n";
  for (const StablePoint& point : report.tried) {
    text += fmt::format("{}", point.spread);
    for (const Gene& gene : problem.genes) text += fmt::format(",{}", point.values[gene.row]);
    text += "\n";
  }
  return text;
}

Result<int> run_stability(StabilityCommand command, CliContext& context) {
  ASSIGN_OR_RETURN(Config config, command.traced.open(command.config, &command.settings.trace));
  std::erase_if(config.problem.genes, [&](const Gene& gene) {
    const std::string& key = config.problem.table()[gene.row].key;
    const bool is_noise = key.find("noise") != std::string::npos;
    if (is_noise) {
      context.console.note(
          "not searched: " + key +
          ", noise by which the spread is measured, and least where there is none");
    }
    return is_noise;
  });
  RETURN_IF_ERROR(check_evolvable(config));
  command.outputs.reads(config);
  RETURN_IF_ERROR(command.outputs.plan_in(command.out, {"model.toml", "stability.csv"}));
  show_notes(config.problem.log, context.console);
  command.settings.evolution = config.evolution;
  if (context.dry_run) {
    const std::size_t genes = config.problem.genes.size();
    return print_dry_run(
        fmt::format("search {} parameters of {} for the least spread over {} repeats, into {}",
                    genes, command.config, command.settings.repeats, command.out),
        {{"out", command.out}, {"genes", genes}, {"repeats", command.settings.repeats}},
        command.farm, config.farm, context);
  }
  ASSIGN_OR_RETURN(const auto asked,
                   command.begin("stability", {{"trace paths"}}, config.farm, context));
  ASSIGN_OR_RETURN(const auto report,
                   find_stability(*asked, config.problem, command.settings, context.work->hooks()));
  const std::filesystem::path out(command.out);
  RETURN_IF_ERROR(
      command.outputs.write((out / "stability.csv").string(), tried_csv(report, config.problem)));
  Model model = model_of_problem(config.problem, report.best);
  model.kind = "stable";
  RETURN_IF_ERROR(command.outputs.write_model((out / "model.toml").string(), model));
  const ParameterTable& table = config.problem.table();
  std::string text = fmt::format(
      "spread of the ends over {} repeats, {} points tried\n"
      "  the config's own values  {}, on fresh repeats {}\n"
      "  the most stable found    {}, on fresh repeats {}\n",
      command.settings.repeats, report.evaluations, spread_text(report.standard_spread),
      spread_text(report.standard_fresh), spread_text(report.best_spread),
      spread_text(report.best_fresh));
  if (!report.beats_standard) {
    text +=
        "No point does better on fresh repeats than the config's own values, which these are.\n";
  }
  Json values = Json::object();
  for (const Gene& gene : config.problem.genes) {
    values[table[gene.row].key] = report.best[gene.row];
    text += fmt::format("  {:<22} {}\n", table[gene.row].key,
                        table.format(gene.row, report.best[gene.row]));
  }
  context.console.result(text, {{"repeats", command.settings.repeats},
                                {"evaluations", report.evaluations},
                                {"config_spread_m", number_or_null(report.standard_spread)},
                                {"config_fresh_m", number_or_null(report.standard_fresh)},
                                {"best_spread_m", number_or_null(report.best_spread)},
                                {"best_fresh_m", report.best_fresh},
                                {"beats_config", report.beats_standard},
                                {"best", values}});
  context.console.note("wrote: " + (out / "model.toml").string() + ", stability.csv");
  return kExitDone;
}

}  // namespace

SubcommandRun setup_stability(CLI::App& app) {
  auto command = std::make_shared<StabilityCommand>();
  app.add_option("CONFIG", command->config, "Its [genes] say what to search, its [optimiser] how")
      ->required();
  app.add_option("--out", command->out, "Folder for model.toml and stability.csv")->required();
  app.add_option("--repeats", command->settings.repeats, "Runs with tiny changes at each point")
      ->check(CLI::Range(2, 10000))
      ->capture_default_str();
  app.add_option("--evaluations", command->settings.evaluations,
                 "Points to try; the last generation is completed")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->traced.declare(app, &command->settings.trace);
  command->declare(app, LongOptions::Leaves::kFolder, true);
  app.footer(
      "The tiny changes are the scenario's own noise: of the start and launch in racquetball, of "
      "the\n"
      "drive in srv1, of a reading of the start in push (pose_noise_position and _heading; spread\n"
      "over the piece's corners and the log's pushes).\n\n"
      "Examples:\n"
      "  gapfarm stability configs/racquetball_stability.toml --out stable\n"
      "  gapfarm stability configs/push_stability.toml --trials pushes.csv --only start=0.15 \\\n"
      "      --out stable");
  return [command](CliContext& context) { return run_stability(*command, context); };
}

}  // namespace gapfarm
