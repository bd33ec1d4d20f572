#include <nlohmann/json.hpp>

#include "common/json/json.h"
#include "master/diagnose/diagnosis_json.h"
#include "master/diagnose/json_fields.h"
#include "master/report/run_report.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 1;

Json scores_json(const std::vector<ScoreRow>& rows) {
  Json list = Json::array();
  for (const ScoreRow& row : rows) {
    Json json = {{"name", row.name}};
    if (row.score) json["score"] = *row.score;
    if (row.position_mm) json["position_mm"] = *row.position_mm;
    if (row.heading_mrad) json["heading_mrad"] = *row.heading_mrad;
    list.push_back(std::move(json));
  }
  return list;
}

void read_scores(Fields& root, const char* key, std::vector<ScoreRow>* rows) {
  root.for_each(key, [&](const Json& item, const std::string& path, const auto&) {
    ScoreRow& row = rows->emplace_back();
    Fields fields(item, path, root.error());
    fields.read("name", row.name);
    fields.read_if_there("score", row.score);
    fields.read_if_there("position_mm", row.position_mm);
    fields.read_if_there("heading_mrad", row.heading_mrad);
  });
}

}  // namespace

std::string to_json(const RunOutcome& outcome) {
  Diagnosis table;
  table.trials = outcome.trials;
  const Json json = {{"version", kVersion},
                     {"validation", scores_json(outcome.validation)},
                     {"baselines", scores_json(outcome.baselines)},
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
  read_scores(root, "validation", &outcome.validation);
  read_scores(root, "baselines", &outcome.baselines);
  if (!error.empty()) return Error{error};
  auto trials = parse_trials(json["trials"], {});
  if (!trials) return trials.error();
  outcome.trials = std::move(*trials);
  return outcome;
}

}  // namespace gapfarm
