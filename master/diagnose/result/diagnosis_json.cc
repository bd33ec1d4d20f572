#include "master/diagnose/result/diagnosis_json.h"

#include <array>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/json/fields.h"
#include "common/json/matrix.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {

static void to_json(Json& json, const PathSample& s) {
  json = {s.t_s, s.pose.x, s.pose.y, s.pose.theta};
}

template <>
struct FieldForm<PathSample> {
  using Written = std::vector<double>;
  static const char* set(const Written& v, PathSample& to) {
    if (v.size() != 4) return "[t s, x m, y m, heading rad]";
    to = {v[0], {v[1], v[2], v[3]}};
    return nullptr;
  }
};

namespace {

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
constexpr auto kEstimate = [](auto& v, auto& row) {
  FIELDS(value, lo, hi, unit);
  IF_ANY(bound, width_over_bound, sd);
};
constexpr auto kSessionGainRow = [](auto& v, auto& row) { FIELDS(session, gain, lo, hi); };
constexpr auto kEffect = [](auto& v, auto& row) {
  FIELDS(name, aliases);
  LATER(alias_reason);
  FIELDS(confidence);
  v.by_key("parameters", row.parameters, &Estimate::key, kEstimate);
  FIELDS(gap_before, gap_after);
  IF_ANY(axis, position_mm_before, heading_mrad_before, position_mm_after, heading_mrad_after);
  FIELDS(closed, closed_lo, closed_hi);
  v.list_if_any("sessions", row.sessions, kSessionGainRow);
  LATER(text);
};
constexpr auto kFigures = [](auto& v, auto& row) {
  FIELDS(tuned);
  v.field("final", row.final_);
  FIELDS(floor);
};
constexpr auto kWhere = [](auto& v, auto& row) {
  FIELDS(command, component, kind, covariate);
  LATER(size);
  FIELDS(share, p, text);
};
constexpr auto kScreened = [](auto& v, auto& row) {
  FIELDS(effect, gain, p);
  LATER(estimate, alias_set, note);
  v.by_key("detectable_from", row.detectable_from);
};
constexpr auto kStep = [](auto& v, auto& row) {
  FIELDS(explained);
  v.by_key("offered", row.offered);
};
constexpr auto kCheck = [](auto& v, auto& row) { FIELDS(covariate, log10_p, excess); };
constexpr auto kNearMiss = [](auto& v, auto& row) { FIELDS(effects, gain, left, left_on, text); };
constexpr auto kNext = [](auto& v, auto& row) {
  FIELDS(text, separates);
  LATER(trials);
};
constexpr auto kSanity = [](auto& v, auto& row) {
  FIELDS(name);
  v.choice("severity", row.severity, kSeverities, severity_name);
  FIELDS(text, remedy);
};
constexpr auto kProvenance = [](auto& v, auto& row) {
  v.field("label", row.first);
  v.field("value", row.second);
};
constexpr auto kTiming = [](auto& v, auto& row) {
  v.field("stage", row.first);
  v.field("seconds", row.second);
};
constexpr auto kCorrelation = [](auto& v, auto& row) { FIELDS(a, b, r); };
constexpr auto kParameter = [](auto& v, auto& row) {
  FIELDS(key, unit);
  IF_ANY(effect);
  LATER(summary);
  v.if_any("tuned", row.before);
  v.field("final", row.after);
  IF_ANY(lo, hi);
  FIELDS(lower, upper);
  IF_ANY(choice);
  std::string hit = bound_name(bound_hit(row));  // for others: it follows from the rest
  v.if_any("at_bound", hit);
  IF_ANY(note);
};

// Paths as [t s, x m, y m, heading rad] from the start.
constexpr auto kDrive = [](auto& v, auto& row) {
  FIELDS(trial, why);
  IF_ANY(measured, tuned);
  v.if_any("final", row.final_);
};
constexpr auto kShown = [](auto& v, auto& row) { FIELDS(key, label, matches); };
constexpr auto kLabels = [](auto& v, auto& row) { IF_ANY(ends, residuals, x, y); };
// How they describe the trials, where not of driven commands.
constexpr auto kPictures = [](auto& v, auto& row) {
  kLabels(v, row.labels);
  v.list_if_any("shown", row.shown, kShown);
};
constexpr auto kGap = [](auto& v, auto& row) {
  std::string unit = "nats/trial";
  v.later("unit", unit);
  kFigures(v, row.gap);
  v.object_if_any("position_mm", row.position_mm, kFigures);
  v.object_if_any("heading_mrad", row.heading_mrad, kFigures);
};
constexpr auto kDiagnosis = [](auto& v, auto& row) {
  LATER(headline, action, findings);
  v.list("sanity", row.sanity, kSanity);
  v.list("effects", row.effects, kEffect);
  v.object("gap", row, kGap);
  v.list("parameters", row.parameters, kParameter);
  v.list("correlations", row.correlations, kCorrelation);
  v.list("where", row.where, kWhere);
  v.list("unexplained", row.unexplained, kWhere);
  v.list("screening", row.screening, kScreened);
  v.list("steps", row.steps, kStep);
  v.list("checks", row.checks, kCheck);
  v.list("next_experiment", row.next, kNext);
  LATER(cautions);
  v.list("provenance", row.provenance, kProvenance);
  v.list("timing", row.timing_s, kTiming);
};
constexpr auto kLast = [](auto& v, auto& row) {
  v.list_if_any("nearest", row.nearest, kNearMiss);
  v.list_if_any("drives", row.drives, kDrive);
  v.object_if_any("pictures", row, kPictures);
};

constexpr const char* kAllCommands = "all";

std::vector<std::string> covariate_names() {
  return mapped(residual_covariates(), [](const auto& c) { return std::string(c.name); });
}

constexpr auto kTerm = [](auto& v, auto& row) {
  v.name_of("frame", row.frame, residual_frame_names());
  FIELDS(by_drive);
  v.name_of("covariates", row.covariates, covariate_names());
  FIELDS(lengths, centres);
  v.by_key("weights", row.weights, &ResidualWeights::command, &ResidualWeights::shifts);
};
constexpr auto kOutliers = [](auto& v, auto& row) {
  OutlierDrives values = row;  // what is written may not be pointed into
  v.name_of("kind", values.kind, outlier_kind_names());
  for (const auto& [key, value] : outlier_values(values)) v.field(key, *value);
  if constexpr (!std::is_const_v<std::remove_reference_t<decltype(row)>>) row = values;
};
constexpr auto kFound = [](auto& v, auto& row) {
  FIELDS(text, gained, gained_lo, gained_hi, gap_before, gap_after, closed, closed_lo, closed_hi);
};

Json residual_json(const FoundResidual& residual) {
  Json json = {{"kept", !residual.correction.empty()}};
  json.update(FieldWriter::written(residual, kFound));
  ResidualField terms = residual.correction.field;
  for (ResidualTerm& term : terms) {
    for (ResidualWeights& w : term.weights)
      w.command = w.command.empty() ? kAllCommands : w.command;
  }
  json["terms"] = FieldWriter::list(terms, kTerm);
  if (residual.correction.outliers) {
    json["strays"] = FieldWriter::written(*residual.correction.outliers, kOutliers);
    json["strays"]["chances"] = residual.chances;
  }
  return json;
}

// Whatever a model would refuse is refused here, too; its commands are those that have weights.
Status read_residual(const Json& json, std::optional<FoundResidual>* residual) {
  std::string error;
  FoundResidual found;
  FieldReader fields(json, "residual", &error);
  kFound(fields, found);
  fields.list("terms", found.correction.field, kTerm);
  if (json.contains("strays")) {
    FieldReader outliers(json["strays"], "residual.strays", &error);
    kOutliers(outliers, found.correction.outliers.emplace());
    outliers.field("chances", found.chances);
    const auto is_chance = [](double chance) { return chance >= 0 && chance <= 1; };
    if (!std::ranges::all_of(found.chances, is_chance))
      outliers.complain("chances", found.chances, "numbers in [0, 1]");
  }
  if (!error.empty()) return Error{"diagnosis.json: " + error};
  std::vector<std::string> commands;
  for (ResidualTerm& term : found.correction.field) {
    for (ResidualWeights& w : term.weights) {
      if (w.command == kAllCommands) w.command.clear();
      if (!w.command.empty()) commands.push_back(w.command);
    }
  }
  Status sound = check_residual(found.correction.field, commands);
  if (sound && found.correction.outliers) sound = check_outliers(*found.correction.outliers);
  if (!sound) return Error{"diagnosis.json: " + sound.error().message};
  *residual = std::move(found);
  return {};
}

}  // namespace

Json sanity_json(const std::vector<SanityFinding>& findings) {
  return FieldWriter::list(findings, kSanity);
}

Json parameters_json(const std::vector<ParameterRow>& rows) {
  return FieldWriter::list(rows, kParameter);
}

Json drives_json(const std::vector<ShownDrive>& drives) {
  return FieldWriter::list(drives, kDrive);
}

const char* verdict_name(Verdict verdict) {
  return find_by(kVerdicts, verdict, &std::pair<Verdict, const char*>::first)->second;
}

Json summary_json(const Diagnosis& diagnosis) {
  Json summary = {{"version", kVersion}, {"verdict", verdict_name(diagnosis.verdict)}};
  summary.update(FieldWriter::written(diagnosis, kDiagnosis));
  if (diagnosis.residual) summary["residual"] = residual_json(*diagnosis.residual);
  summary.update(FieldWriter::written(diagnosis, kLast));
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
  FieldReader root(json, "", &error);
  double version = 0;
  root.field("version", version);
  if (error.empty() && version != kVersion) {
    return Error{"diagnosis.json: version is " + json_text(json["version"]) +
                 ", this program reads version " + std::to_string(kVersion)};
  }
  Diagnosis diagnosis;
  std::string verdict;
  root.field("verdict", verdict);
  const auto* known = find_by(kVerdicts, verdict, &std::pair<Verdict, const char*>::second);
  if (error.empty() && known == nullptr) {
    root.complain("verdict", json["verdict"], "effect, none, unknown, effect+unknown or unusable");
  }
  if (!error.empty()) {
    return Error{"diagnosis.json: " + error + "; was this written by gapfarm diagnose?"};
  }
  diagnosis.verdict = known->first;
  kDiagnosis(root, diagnosis);
  kLast(root, diagnosis);
  if (!error.empty()) return Error{"diagnosis.json: " + error};
  if (json.contains("residual")) {
    if (Status s = read_residual(json["residual"], &diagnosis.residual); !s) return s.error();
  }
  if (json.contains("trials")) {
    ASSIGN_OR_RETURN(diagnosis.trials, parse_trials(json["trials"], diagnosis.shown));
  }
  return diagnosis;
}

}  // namespace gapfarm
