// gapfarm effects: the catalogue.
#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "master/cli/subcommand.h"
#include "master/command/inputs.h"
#include "master/experiments/blind_check/cases/sizing.h"

namespace gapfarm {
namespace {

const char* stage_name(EffectStage stage) {
  constexpr const char* kNames[] = {"drive", "floor", "camera"};
  return kNames[static_cast<std::size_t>(stage)];
}

std::string value_text(const Parameter& p, double value) {
  if (!p.choices.empty()) return p.choices[static_cast<std::size_t>(value)];
  return fmt::format("{:.4g}", value);
}

std::string range_text(const Parameter& p, bool strength) {
  const std::string text = p.choices.empty() ? fmt::format("{:.4g} to {:.4g}", p.lower, p.upper)
                                             : joined(p.choices, " or ");
  return text + (strength ? ", neutral " : ", default ") + value_text(p, p.nominal);
}

std::string listing(std::span<const Effect> effects) {
  std::string text;
  for (const Effect& effect : effects) {
    text += fmt::format("{} ({}): {}\n", effect.name, stage_name(effect.stage), effect.summary);
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const Parameter& p = effect.parameters[i];
      text += fmt::format("    {:<12} {:<6} {}; {}\n", p.key, p.unit, p.summary,
                          range_text(p, i < effect.strengths));
    }
  }
  return text;
}

Json to_json(std::span<const Effect> effects) {
  Json all = Json::array();
  for (const Effect& effect : effects) {
    Json parameters = Json::array();
    for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
      const Parameter& p = effect.parameters[i];
      Json entry = {
          {"key", p.key},         {"unit", p.unit},
          {"summary", p.summary}, {i < effect.strengths ? "neutral" : "default", p.nominal},
          {"lower", p.lower},     {"upper", p.upper}};
      if (!p.choices.empty()) entry["choices"] = p.choices;
      parameters.push_back(std::move(entry));
    }
    all.push_back({{"name", effect.name},
                   {"stage", stage_name(effect.stage)},
                   {"summary", effect.summary},
                   {"parameters", std::move(parameters)}});
  }
  return all;
}

// Of the config's scenario, or of tracked robots.  A second one of a kind does what the first does.
Result<std::vector<Effect>> catalogue_of(const std::string& config_path) {
  const std::span<const Effect> tracked = srv1_effects();
  if (config_path.empty()) return std::vector<Effect>(tracked.begin(), tracked.end());
  ASSIGN_OR_RETURN(const Config config, read_config(config_path));
  const ParameterTable& table = config.problem.table();
  return mapped(*effects_named(table), [&](std::size_t e) { return table.effects()[e]; });
}

Result<int> run_effects(const std::string& config, CliContext& context) {
  ASSIGN_OR_RETURN(const std::vector<Effect> effects, catalogue_of(config));
  const std::string none = "its scenario has no catalogue of effects\n";
  context.console.result(effects.empty() ? config + ": " + none : listing(effects),
                         to_json(effects));
  return kExitDone;
}

}  // namespace

SubcommandRun setup_effects(CLI::App& app) {
  auto config = std::make_shared<std::string>();
  app.add_option("CONFIG", *config, "Whose catalogue (default: of tracked robots)");
  app.footer(
      "Examples:\n"
      "  gapfarm effects\n"
      "  gapfarm effects configs/push.toml --json");
  return [config](CliContext& context) { return run_effects(*config, context); };
}

}  // namespace gapfarm
