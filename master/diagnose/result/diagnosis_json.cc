#include "master/diagnose/result/diagnosis_json.h"

#include <array>
#include <nlohmann/json.hpp>

#include "common/json/json.h"
#include "master/diagnose/result/json_fields.h"
#include "master/io/log_checks/finding.h"

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

const char* bound_name(BoundHit hit) {
  return hit == BoundHit::kNone ? "" : hit == BoundHit::kLower ? "lower" : "upper";
}

constexpr Severity kSeverities[] = {Severity::kNote, Severity::kWarning, Severity::kUnusable};

// Every row of the file, in the order of its fields.
constexpr auto kEstimate = [](auto& v, auto& e) {
  v.field("value", e.value);
  v.field("lo", e.lo);
  v.field("hi", e.hi);
  v.field("unit", e.unit);
  v.if_any("bound", e.bound);
  v.if_any("width_over_bound", e.width_over_bound);
  v.if_any("sd", e.sd);
};
constexpr auto kSessionGainRow = [](auto& v, auto& s) {
  v.field("session", s.session);
  v.field("gain", s.gain);
  v.field("lo", s.lo);
  v.field("hi", s.hi);
};
constexpr auto kEffect = [](auto& v, auto& e) {
  v.field("name", e.name);
  v.field("aliases", e.aliases);
  v.later("alias_reason", e.alias_reason);
  v.field("confidence", e.confidence);
  v.by_key("parameters", e.parameters, &Estimate::key, kEstimate);
  v.field("gap_before", e.gap_before);
  v.field("gap_after", e.gap_after);
  v.if_any("axis", e.axis);
  v.if_any("position_mm_before", e.position_mm_before);
  v.if_any("heading_mrad_before", e.heading_mrad_before);
  v.if_any("position_mm_after", e.position_mm_after);
  v.if_any("heading_mrad_after", e.heading_mrad_after);
  v.field("closed", e.closed);
  v.field("closed_lo", e.closed_lo);
  v.field("closed_hi", e.closed_hi);
  v.list_if_any("sessions", e.sessions, kSessionGainRow);
  v.later("text", e.text);
};
constexpr auto kFigures = [](auto& v, auto& figures) {
  v.field("tuned", figures.tuned);
  v.field("final", figures.final_);
  v.field("floor", figures.floor);
};
constexpr auto kWhere = [](auto& v, auto& w) {
  v.field("command", w.command);
  v.field("component", w.component);
  v.field("kind", w.kind);
  v.field("covariate", w.covariate);
  v.later("size", w.size);
  v.field("share", w.share);
  v.field("p", w.p);
  v.field("text", w.text);
};
constexpr auto kScreened = [](auto& v, auto& s) {
  v.field("effect", s.effect);
  v.field("gain", s.gain);
  v.field("p", s.p);
  v.later("estimate", s.estimate);
  v.later("alias_set", s.alias_set);
  v.if_any("held_out", s.held_out);
  v.if_any("held_out_se", s.held_out_se);
  v.later("note", s.note);
  v.by_key("detectable_from", s.detectable_from);
};
constexpr auto kStep = [](auto& v, auto& step) {
  v.field("explained", step.explained);
  v.by_key("offered", step.offered);
};
constexpr auto kCheck = [](auto& v, auto& check) {
  v.field("covariate", check.covariate);
  v.field("log10_p", check.log10_p);
  v.field("excess", check.excess);
};
constexpr auto kNearMiss = [](auto& v, auto& miss) {
  v.field("effects", miss.effects);
  v.field("gain", miss.gain);
  v.field("left", miss.left);
  v.field("left_on", miss.left_on);
  v.field("text", miss.text);
};
constexpr auto kNext = [](auto& v, auto& next) {
  v.field("text", next.text);
  v.field("separates", next.separates);
  v.later("trials", next.trials);
};
constexpr auto kSanity = [](auto& v, auto& f) {
  v.field("name", f.name);
  v.choice("severity", f.severity, kSeverities, severity_name);
  v.field("text", f.text);
  v.field("remedy", f.remedy);
};
constexpr auto kProvenance = [](auto& v, auto& line) {
  v.field("label", line.first);
  v.field("value", line.second);
};
constexpr auto kTiming = [](auto& v, auto& stage) {
  v.field("stage", stage.first);
  v.field("seconds", stage.second);
};
constexpr auto kCorrelation = [](auto& v, auto& c) {
  v.field("a", c.a);
  v.field("b", c.b);
  v.field("r", c.r);
};
constexpr auto kParameter = [](auto& v, auto& row) {
  v.field("key", row.key);
  v.field("unit", row.unit);
  v.if_any("effect", row.effect);
  v.later("summary", row.summary);
  v.if_any("tuned", row.before);
  v.field("final", row.after);
  v.if_any("lo", row.lo);
  v.if_any("hi", row.hi);
  v.field("lower", row.lower);
  v.field("upper", row.upper);
  v.if_any("choice", row.choice);
  std::string hit = bound_name(bound_hit(row));  // for others: it follows from the rest
  v.if_any("at_bound", hit);
  v.if_any("note", row.note);
};

void read_gap(const Json& json, Fields& root, Diagnosis& diagnosis) {
  if (!json.contains("gap")) return root.complain("gap", Json(), "an object");
  const Json& gap = json["gap"];
  const auto read = [&](const Json& from, const std::string& path, GapFigures& into) {
    Fields fields(from, path, root.error());
    kFigures(fields, into);
  };
  read(gap, "gap", diagnosis.gap);
  if (!gap.is_object()) return;
  if (gap.contains("position_mm")) {
    read(gap["position_mm"], "gap.position_mm", diagnosis.position_mm);
  }
  if (gap.contains("heading_mrad")) {
    read(gap["heading_mrad"], "gap.heading_mrad", diagnosis.heading_mrad);
  }
}

}  // namespace

Json sanity_json(const std::vector<SanityFinding>& findings) {
  return FieldWriter::list(findings, kSanity);
}

Json parameters_json(const std::vector<ParameterRow>& rows) {
  return FieldWriter::list(rows, kParameter);
}

const char* verdict_name(Verdict verdict) {
  for (const auto& [value, name] : kVerdicts) {
    if (value == verdict) return name;
  }
  return "unknown";
}

Json summary_json(const Diagnosis& diagnosis) {
  Json gap = {{"unit", "nats/trial"}};
  gap.update(FieldWriter::written(diagnosis.gap, kFigures));
  gap["position_mm"] = FieldWriter::written(diagnosis.position_mm, kFigures);
  gap["heading_mrad"] = FieldWriter::written(diagnosis.heading_mrad, kFigures);
  Json summary = {{"version", kVersion},
                  {"verdict", verdict_name(diagnosis.verdict)},
                  {"headline", diagnosis.headline},
                  {"action", diagnosis.action},
                  {"findings", diagnosis.findings},
                  {"sanity", sanity_json(diagnosis.sanity)},
                  {"effects", FieldWriter::list(diagnosis.effects, kEffect)},
                  {"gap", std::move(gap)},
                  {"parameters", parameters_json(diagnosis.parameters)},
                  {"correlations", FieldWriter::list(diagnosis.correlations, kCorrelation)},
                  {"where", FieldWriter::list(diagnosis.where, kWhere)},
                  {"unexplained", FieldWriter::list(diagnosis.unexplained, kWhere)},
                  {"screening", FieldWriter::list(diagnosis.screening, kScreened)},
                  {"steps", FieldWriter::list(diagnosis.steps, kStep)},
                  {"checks", FieldWriter::list(diagnosis.checks, kCheck)},
                  {"next_experiment", FieldWriter::list(diagnosis.next, kNext)},
                  {"cautions", diagnosis.cautions},
                  {"provenance", FieldWriter::list(diagnosis.provenance, kProvenance)},
                  {"timing", FieldWriter::list(diagnosis.timing_s, kTiming)}};
  if (diagnosis.residual) summary["residual"] = residual_json(*diagnosis.residual);
  if (!diagnosis.nearest.empty()) {
    summary["nearest"] = FieldWriter::list(diagnosis.nearest, kNearMiss);
  }
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
  root.field("version", version);
  if (error.empty() && version != kVersion) {
    return Error{"diagnosis.json: version is " + json_text(json["version"]) +
                 ", this program reads version " + std::to_string(kVersion)};
  }
  Diagnosis diagnosis;
  std::string verdict;
  root.field("verdict", verdict);
  bool known = false;
  for (const auto& [value, name] : kVerdicts) {
    if (verdict == name) diagnosis.verdict = value, known = true;
  }
  if (error.empty() && !known) {
    root.complain("verdict", json["verdict"], "effect, none, unknown, effect+unknown or unusable");
  }
  if (!error.empty()) return Error{error};
  root.later("headline", diagnosis.headline);
  root.later("action", diagnosis.action);
  root.later("findings", diagnosis.findings);
  root.list("effects", diagnosis.effects, kEffect);
  read_gap(json, root, diagnosis);
  root.list("sanity", diagnosis.sanity, kSanity);
  root.list("where", diagnosis.where, kWhere);
  root.list("unexplained", diagnosis.unexplained, kWhere);
  root.list("screening", diagnosis.screening, kScreened);
  root.list("next_experiment", diagnosis.next, kNext);
  root.list("steps", diagnosis.steps, kStep);
  root.list("checks", diagnosis.checks, kCheck);
  root.later("cautions", diagnosis.cautions);
  root.list("provenance", diagnosis.provenance, kProvenance);
  root.list("timing", diagnosis.timing_s, kTiming);
  root.list("parameters", diagnosis.parameters, kParameter);
  root.list("correlations", diagnosis.correlations, kCorrelation);
  root.list("nearest", diagnosis.nearest, kNearMiss);
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
