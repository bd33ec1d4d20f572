// The correction without a cause, as a part of diagnosis.json.

#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/diagnose/result/json_fields.h"

namespace gapfarm {
namespace {

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

}  // namespace

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
  Fields fields(json, "residual", error);
  kFound(fields, found);
  fields.list("terms", found.correction.field, kTerm);
  if (json.contains("strays")) {
    Fields outliers(json["strays"], "residual.strays", error);
    kOutliers(outliers, found.correction.outliers.emplace());
    outliers.field("chances", found.chances);
    const auto is_chance = [](double chance) { return chance >= 0 && chance <= 1; };
    if (!std::ranges::all_of(found.chances, is_chance))
      outliers.complain("chances", found.chances, "numbers in [0, 1]");
  }
  if (!error.empty()) return Error{error};
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

}  // namespace gapfarm
