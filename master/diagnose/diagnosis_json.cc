#include "master/diagnose/diagnosis_json.h"

#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "common/json/json.h"
#include "master/diagnose/json_fields.h"
#include "master/sanity/words.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr std::array<std::pair<Verdict, const char*>, 5> kVerdicts = {
    {{Verdict::kEffect, "effect"},
     {Verdict::kNone, "none"},
     {Verdict::kUnknown, "unknown"},
     {Verdict::kEffectAndUnknown, "effect+unknown"},
     {Verdict::kUnusable, "unusable"}}};

Json effect_json(const NamedEffect& effect) {
  Json parameters = Json::object();
  for (const Estimate& e : effect.parameters) {
    parameters[e.key] = {{"value", e.value}, {"lo", e.lo}, {"hi", e.hi}, {"unit", e.unit}};
  }
  Json json = {{"name", effect.name},
               {"aliases", effect.aliases},
               {"alias_reason", effect.alias_reason},
               {"confidence", effect.confidence},
               {"parameters", std::move(parameters)},
               {"gap_before", effect.gap_before},
               {"gap_after", effect.gap_after}};
  if (!effect.axis.empty()) json["axis"] = effect.axis;
  if (effect.position_mm_before) json["position_mm_before"] = *effect.position_mm_before;
  if (effect.heading_mrad_before) json["heading_mrad_before"] = *effect.heading_mrad_before;
  if (effect.position_mm_after) json["position_mm_after"] = *effect.position_mm_after;
  if (effect.heading_mrad_after) json["heading_mrad_after"] = *effect.heading_mrad_after;
  json["closed"] = effect.closed;
  json["closed_lo"] = effect.closed_lo;
  json["closed_hi"] = effect.closed_hi;
  json["text"] = effect.text;
  return json;
}

Json figures_json(const GapFigures& figures) {
  return {{"tuned", figures.tuned}, {"final", figures.final_}, {"floor", figures.floor}};
}

Json where_json(const std::vector<Where>& findings) {
  Json list = Json::array();
  for (const Where& w : findings) {
    list.push_back({{"command", w.command},
                    {"component", w.component},
                    {"kind", w.kind},
                    {"covariate", w.covariate},
                    {"size", w.size},
                    {"share", w.share},
                    {"p", w.p},
                    {"text", w.text}});
  }
  return list;
}

Json screening_json(const std::vector<Screened>& screening) {
  Json list = Json::array();
  for (const Screened& s : screening) {
    Json row = {{"effect", s.effect},
                {"gain", s.gain},
                {"p", s.p},
                {"estimate", s.estimate},
                {"alias_set", s.alias_set}};
    if (s.held_out) row["held_out"] = *s.held_out;
    if (s.held_out_se) row["held_out_se"] = *s.held_out_se;
    row["note"] = s.note;
    list.push_back(std::move(row));
  }
  return list;
}

Json steps_json(const std::vector<SelectionRecord>& steps) {
  Json list = Json::array();
  for (const SelectionRecord& step : steps) {
    Json offered = Json::object();
    for (const auto& [effect, gain] : step.offered) offered[effect] = gain;
    list.push_back({{"explained", step.explained}, {"offered", std::move(offered)}});
  }
  return list;
}

Json checks_json(const std::vector<ResidualCheck>& checks) {
  Json list = Json::array();
  for (const ResidualCheck& c : checks) {
    list.push_back({{"covariate", c.covariate}, {"log10_p", c.log10_p}, {"excess", c.excess}});
  }
  return list;
}

NamedEffect read_effect(const Json& json, const std::string& path, std::string& error) {
  NamedEffect effect;
  Fields fields(json, path, error);
  fields.read("name", effect.name);
  fields.read("aliases", effect.aliases);
  fields.read_if_there("alias_reason", effect.alias_reason);
  fields.read("confidence", effect.confidence);
  fields.for_each("parameters", [&](const Json& item, const std::string& where, const auto& key) {
    Estimate& estimate = effect.parameters.emplace_back();
    estimate.key = key;
    Fields parameter(item, where, error);
    parameter.read("value", estimate.value);
    parameter.read("lo", estimate.lo);
    parameter.read("hi", estimate.hi);
    parameter.read("unit", estimate.unit);
  });
  fields.read("gap_before", effect.gap_before);
  fields.read("gap_after", effect.gap_after);
  fields.read_if_there("axis", effect.axis);
  fields.read_if_there("position_mm_before", effect.position_mm_before);
  fields.read_if_there("heading_mrad_before", effect.heading_mrad_before);
  fields.read_if_there("position_mm_after", effect.position_mm_after);
  fields.read_if_there("heading_mrad_after", effect.heading_mrad_after);
  fields.read("closed", effect.closed);
  fields.read("closed_lo", effect.closed_lo);
  fields.read("closed_hi", effect.closed_hi);
  fields.read_if_there("text", effect.text);
  return effect;
}

GapFigures read_figures(const Json& json, const std::string& path, std::string& error) {
  GapFigures figures;
  Fields fields(json, path, error);
  fields.read("tuned", figures.tuned);
  fields.read("final", figures.final_);
  fields.read("floor", figures.floor);
  return figures;
}

void read_findings(Fields& root, const char* key, std::vector<Where>& findings) {
  root.for_each(key, [&](const Json& item, const std::string& path, const auto&) {
    Where& w = findings.emplace_back();
    Fields fields(item, path, root.error());
    fields.read("command", w.command);
    fields.read("component", w.component);
    fields.read("kind", w.kind);
    fields.read("covariate", w.covariate);
    fields.read_if_there("size", w.size);
    fields.read("share", w.share);
    fields.read("p", w.p);
    fields.read("text", w.text);
  });
}

void read_screening(Fields& root, Diagnosis& diagnosis) {
  root.for_each("screening", [&](const Json& item, const std::string& path, const auto&) {
    Screened& s = diagnosis.screening.emplace_back();
    Fields fields(item, path, root.error());
    fields.read("effect", s.effect);
    fields.read("gain", s.gain);
    fields.read("p", s.p);
    fields.read_if_there("estimate", s.estimate);
    fields.read_if_there("alias_set", s.alias_set);
    fields.read_if_there("held_out", s.held_out);
    fields.read_if_there("held_out_se", s.held_out_se);
    fields.read_if_there("note", s.note);
  });
}

void read_gap(const Json& json, Fields& root, Diagnosis& diagnosis) {
  if (!json.contains("gap")) return root.complain("gap", Json(), "an object");
  const Json& gap = json["gap"];
  diagnosis.gap = read_figures(gap, "gap", root.error());
  if (!gap.is_object()) return;
  const auto figures = [&](const char* key, GapFigures& into) {
    if (gap.contains(key)) into = read_figures(gap[key], std::string("gap.") + key, root.error());
  };
  figures("position_mm", diagnosis.position_mm);
  figures("heading_mrad", diagnosis.heading_mrad);
}

void read_sanity(Fields& root, Diagnosis& diagnosis) {
  root.for_each("sanity", [&](const Json& item, const std::string& path, const auto&) {
    SanityFinding& f = diagnosis.sanity.emplace_back();
    std::string severity = "unusable";
    Fields fields(item, path, root.error());
    fields.read("name", f.name);
    fields.read("text", f.text);
    fields.read("remedy", f.remedy);
    fields.read_if_there("severity", severity);
    for (Severity s : {Severity::kNote, Severity::kDoubt, Severity::kUnusable}) {
      if (severity == severity_name(s)) f.severity = s;
    }
  });
}

// The lists that FORMATS leaves to us.
void read_remainder(Fields& root, Diagnosis& diagnosis) {
  root.for_each("next_experiment", [&](const Json& item, const std::string& path, const auto&) {
    NextExperiment& next = diagnosis.next.emplace_back();
    Fields fields(item, path, root.error());
    fields.read("text", next.text);
    fields.read("separates", next.separates);
    fields.read_if_there("trials", next.trials);
  });
  root.for_each("steps", [&](const Json& item, const std::string& path, const auto&) {
    SelectionRecord& step = diagnosis.steps.emplace_back();
    Fields fields(item, path, root.error());
    fields.read("explained", step.explained);
    fields.for_each("offered", [&](const Json&, const std::string&, const auto& effect) {
      Fields gains(item["offered"], path + ".offered", root.error());
      gains.read(effect.c_str(), step.offered.emplace_back(effect, 0).second);
    });
  });
  root.for_each("checks", [&](const Json& item, const std::string& path, const auto&) {
    ResidualCheck& check = diagnosis.checks.emplace_back();
    Fields fields(item, path, root.error());
    fields.read("covariate", check.covariate);
    fields.read("log10_p", check.log10_p);
    fields.read("excess", check.excess);
  });
  root.read_if_there("cautions", diagnosis.cautions);
  root.for_each("provenance", [&](const Json& item, const std::string& path, const auto&) {
    auto& [label, value] = diagnosis.provenance.emplace_back();
    Fields fields(item, path, root.error());
    fields.read("label", label);
    fields.read("value", value);
  });
  root.for_each("timing", [&](const Json& item, const std::string& path, const auto&) {
    auto& [stage, seconds] = diagnosis.timing_s.emplace_back();
    Fields fields(item, path, root.error());
    fields.read("stage", stage);
    fields.read("seconds", seconds);
  });
}

}  // namespace

Json sanity_json(const std::vector<SanityFinding>& findings) {
  Json list = Json::array();
  for (const SanityFinding& f : findings) {
    list.push_back({{"name", f.name},
                    {"severity", severity_name(f.severity)},
                    {"text", f.text},
                    {"remedy", f.remedy}});
  }
  return list;
}

const char* verdict_name(Verdict verdict) {
  for (const auto& [value, name] : kVerdicts) {
    if (value == verdict) return name;
  }
  return "unknown";
}

Json summary_json(const Diagnosis& diagnosis) {
  Json effects = Json::array();
  for (const NamedEffect& effect : diagnosis.effects) effects.push_back(effect_json(effect));
  Json gap = {{"unit", "nats/trial"}};
  gap.update(figures_json(diagnosis.gap));
  gap["position_mm"] = figures_json(diagnosis.position_mm);
  gap["heading_mrad"] = figures_json(diagnosis.heading_mrad);
  Json next = Json::array();
  for (const NextExperiment& n : diagnosis.next) {
    next.push_back({{"text", n.text}, {"separates", n.separates}, {"trials", n.trials}});
  }
  Json provenance = Json::array();
  for (const auto& [label, value] : diagnosis.provenance) {
    provenance.push_back({{"label", label}, {"value", value}});
  }
  Json timing = Json::array();
  for (const auto& [stage, seconds] : diagnosis.timing_s) {
    timing.push_back({{"stage", stage}, {"seconds", seconds}});
  }
  Json summary = {{"version", kVersion},
                  {"verdict", verdict_name(diagnosis.verdict)},
                  {"headline", diagnosis.headline},
                  {"action", diagnosis.action},
                  {"findings", diagnosis.findings},
                  {"sanity", sanity_json(diagnosis.sanity)},
                  {"effects", std::move(effects)},
                  {"gap", std::move(gap)},
                  {"parameters", parameters_json(diagnosis.parameters)},
                  {"correlations", correlations_json(diagnosis.correlations)},
                  {"where", where_json(diagnosis.where)},
                  {"unexplained", where_json(diagnosis.unexplained)},
                  {"screening", screening_json(diagnosis.screening)},
                  {"steps", steps_json(diagnosis.steps)},
                  {"checks", checks_json(diagnosis.checks)},
                  {"next_experiment", std::move(next)},
                  {"cautions", diagnosis.cautions},
                  {"provenance", std::move(provenance)},
                  {"timing", std::move(timing)}};
  if (diagnosis.residual) summary["residual"] = residual_json(*diagnosis.residual);
  if (!diagnosis.nearest.empty()) summary["nearest"] = nearest_json(diagnosis.nearest);
  if (!diagnosis.drives.empty()) summary["drives"] = drives_json(diagnosis.drives);
  if (!diagnosis.shown.empty()) summary["pictures"] = pictures_json(diagnosis);
  return summary;
}

std::string to_json(const Diagnosis& diagnosis) {
  std::string text = json_text(summary_json(diagnosis), 2);
  text.resize(text.size() - 2);  // the closing "\n}", so that the trials follow, a line each
  const Json table = trials_json(diagnosis);
  text +=
      ",\n  \"trials\": {\n    \"columns\": " + json_text(table["columns"]) + ",\n    \"rows\": [";
  const char* separator = "\n";
  for (const Json& row : table["rows"]) {
    text += separator + ("      " + json_text(row));
    separator = ",\n";
  }
  return text + "\n    ]\n  }\n}\n";
}

Result<Diagnosis> parse_diagnosis(std::string_view text) {
  const Json json = parse_json(text);
  if (json.is_discarded()) return Error{"diagnosis.json: not JSON; is the file complete?"};
  std::string error;
  Fields root(json, "", error);
  double version = 0;
  root.read("version", version);
  if (error.empty() && version != kVersion) {
    return Error{"diagnosis.json: version is " + json_text(json["version"]) +
                 ", this program reads version " + std::to_string(kVersion)};
  }
  Diagnosis diagnosis;
  std::string verdict;
  root.read("verdict", verdict);
  bool known = false;
  for (const auto& [value, name] : kVerdicts) {
    if (verdict == name) diagnosis.verdict = value, known = true;
  }
  if (error.empty() && !known) {
    root.complain("verdict", json["verdict"], "effect, none, unknown, effect+unknown or unusable");
  }
  if (!error.empty()) return Error{error};
  root.read_if_there("headline", diagnosis.headline);
  root.read_if_there("action", diagnosis.action);
  root.read_if_there("findings", diagnosis.findings);
  root.for_each("effects", [&](const Json& item, const std::string& path, const auto&) {
    diagnosis.effects.push_back(read_effect(item, path, error));
  });
  read_gap(json, root, diagnosis);
  read_sanity(root, diagnosis);
  read_findings(root, "where", diagnosis.where);
  read_findings(root, "unexplained", diagnosis.unexplained);
  read_screening(root, diagnosis);
  read_remainder(root, diagnosis);
  read_parameters(root, &diagnosis.parameters);
  read_correlations(root, &diagnosis.correlations);
  read_nearest(root, &diagnosis.nearest);
  if (!error.empty()) return Error{error};
  if (json.contains("residual")) {
    if (Status s = read_residual(json["residual"], &diagnosis.residual); !s) return s.error();
  }
  if (json.contains("drives")) {
    if (Status s = read_drives(json["drives"], &diagnosis.drives); !s) return s.error();
  }
  if (json.contains("pictures")) {
    if (Status s = read_pictures(json["pictures"], &diagnosis); !s) return s.error();
  }
  if (json.contains("trials")) {
    auto trials = parse_trials(json["trials"], diagnosis.shown);
    if (!trials) return trials.error();
    diagnosis.trials = std::move(*trials);
  }
  return diagnosis;
}

}  // namespace gapfarm
