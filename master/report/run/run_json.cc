#include <nlohmann/json.hpp>

#include "common/json/json.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/diagnose/result/json_fields.h"
#include "master/report/run/run_report.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;

constexpr auto kScore = [](auto& v, auto& row) {
  v.field("name", row.name);
  v.if_any("score", row.score);
  v.if_any("position_mm", row.position_mm);
  v.if_any("heading_mrad", row.heading_mrad);
};

}  // namespace

std::string to_json(const RunOutcome& outcome) {
  Diagnosis table;
  table.trials = outcome.trials;
  const Json json = {{"version", kVersion},
                     {"validation", FieldWriter::list(outcome.validation, kScore)},
                     {"baselines", FieldWriter::list(outcome.baselines, kScore)},
                     {"trials", trials_json(table)}};
  return json_text(json);
}

Result<RunOutcome> parse_run_outcome(const std::string& text) {
  const Json json = parse_json(text);
  if (json.is_discarded() || !json.is_object() || json.value("version", 0) != kVersion ||
      !json.contains("trials")) {
    return Error{"the run's outcome cannot be read; was it kept by another program?"};
  }
  RunOutcome outcome;
  std::string error;
  Fields root(json, "", error);
  root.list("validation", outcome.validation, kScore);
  root.list("baselines", outcome.baselines, kScore);
  if (!error.empty()) return Error{error};
  auto trials = parse_trials(json["trials"], {});
  if (!trials) return trials.error();
  outcome.trials = std::move(*trials);
  return outcome;
}

}  // namespace gapfarm
