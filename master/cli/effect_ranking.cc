#include "master/cli/effect_ranking.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

double degrees(double rad) { return rad * 180 / M_PI; }

// Gains are shown in mm or nats.
double shown(const EffectRanking& ranking, double gain) { return ranking.nats ? gain : 1e3 * gain; }
const char* unit(const EffectRanking& ranking) { return ranking.nats ? "nats" : "mm"; }

std::string parameters_text(const ParameterTable& table, const std::vector<RankedParameter>& all) {
  std::string text;
  for (const RankedParameter& p : all) {
    text += fmt::format("{}{} {:.4g} [{:.3g}, {:.3g}]", text.empty() ? "" : ", ", table[p.row].key,
                        p.value, p.folds.lower, p.folds.upper);
  }
  return text;
}

Json parameters_json(const ParameterTable& table, const std::vector<RankedParameter>& all) {
  Json json = Json::object();
  for (const RankedParameter& p : all) {
    json[table[p.row].key] = {{"value", p.value},
                              {"folds_lo", p.folds.lower},
                              {"folds_hi", p.folds.upper},
                              {"unit", table[p.row].unit}};
  }
  return json;
}

std::string verdict(const EffectRanking& ranking, const EffectRankingPlan& plan) {
  const EffectGain& first = ranking.effects.front();
  if (!first.failure.empty()) return "none: no effect could be simulated";
  const std::string gained = fmt::format(
      "{} gains {:.3g} {} a held-out trial, {:.3g} to {:.3g} at {:.4g} % over all {} effects tried",
      first.effect, shown(ranking, first.gain), unit(ranking), shown(ranking, first.interval.lower),
      shown(ranking, first.interval.upper), 100 * plan.coverage, ranking.effects.size());
  if (ranking.best.empty()) return "none: the best, " + gained + ", which may be chance";
  std::string alike;
  for (const EffectGain& effect : ranking.effects) {
    if (effect.alike) alike += (alike.empty() ? "" : ", ") + effect.effect;
  }
  return gained + (alike.empty() ? "; no other does as well"
                                 : "; these trials do not tell it from " + alike);
}

std::string error_row(const std::string& name, const EndErrors& errors) {
  return fmt::format("  {:<22} {:>8.2f} {:>8.2f} {:>8.2f}", name, 1e3 * errors.mean_m,
                     1e3 * errors.median_position_m, degrees(errors.median_heading_rad));
}

}  // namespace

Json errors_json(const EndErrors& e) {
  return {{"trials", e.trials},
          {"mean_mm", 1e3 * e.mean_m},
          {"median_mm", 1e3 * e.median_m},
          {"median_position_mm", 1e3 * e.median_position_m},
          {"median_heading_deg", degrees(e.median_heading_rad)}};
}

Json ranking_json(const Problem& problem, const EffectRanking& ranking) {
  Json effects = Json::array();
  const auto gain = [&](double value) { return shown(ranking, value); };
  for (const EffectGain& e : ranking.effects) {
    if (!e.failure.empty()) {
      effects.push_back({{"name", e.effect}, {"failure", e.failure}});
      continue;
    }
    effects.push_back({{"name", e.effect},
                       {"gain", gain(e.gain)},
                       {"gain_lo", gain(e.interval.lower)},
                       {"gain_hi", gain(e.interval.upper)},
                       {"behind_best_lo", gain(e.behind_best.lower)},
                       {"behind_best_hi", gain(e.behind_best.upper)},
                       {"alike", e.alike},
                       {"errors", errors_json(e.errors)},
                       {"parameters", parameters_json(problem.table(), e.parameters)}});
  }
  return {{"verdict", ranking.best.empty() ? "none" : ranking.best},
          {"unit", std::string(unit(ranking)) + "/trial"},
          {"groups", ranking.groups},
          {"stay", errors_json(ranking.stay)},
          {"own", errors_json(ranking.own)},
          {"base", errors_json(ranking.base)},
          {"parameters", parameters_json(problem.table(), ranking.parameters)},
          {"effects", effects}};
}

std::string ranking_text(const Problem& problem, const EffectRanking& ranking,
                         const EffectRankingPlan& plan) {
  std::string text =
      fmt::format("{} trials in {} groups, left out in {} parts\n  {:<22} {:>8} {:>8} {:>8}   {}\n",
                  ranking.base.trials, ranking.groups, plan.folds, "held out", "mean mm", "med. mm",
                  "med. deg", fmt::format("gain in {} a trial", unit(ranking)));
  text += error_row("nothing moves", ranking.stay) + "\n";
  text += error_row("config's own values", ranking.own) + "\n";
  text += error_row("base tuned", ranking.base) + "\n";
  for (const EffectGain& e : ranking.effects) {
    if (!e.failure.empty()) {
      text += fmt::format("  {:<22} failed: {}\n", e.effect, e.failure);
      continue;
    }
    text += error_row("+ " + e.effect, e.errors);
    text += fmt::format("   {:.3f} [{:.3f}, {:.3f}]\n", shown(ranking, e.gain),
                        shown(ranking, e.interval.lower), shown(ranking, e.interval.upper));
  }
  text += "base: " + parameters_text(problem.table(), ranking.parameters) + "\n";
  for (const EffectGain& e : ranking.effects) {
    if (e.above_none) {
      text += "+ " + e.effect + ": " + parameters_text(problem.table(), e.parameters) + "\n";
    }
  }
  return text + verdict(ranking, plan) + "\n";
}

}  // namespace gapfarm
