// The correction without a cause, as a part of diagnosis.json.

#include <nlohmann/json.hpp>

#include "master/diagnose/result/diagnosis_json.h"
#include "master/diagnose/result/json_fields.h"

namespace gapfarm {
namespace {

Json rows_json(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index k = 0; k < matrix.rows(); ++k) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(k, j));
    rows.push_back(std::move(row));
  }
  return rows;
}

Json term_json(const ResidualTerm& term) {
  Json covariates = Json::array(), lengths = Json::array(), weights = Json::object();
  for (const std::size_t row : term.covariates) {
    covariates.push_back(residual_covariates()[row].name);
  }
  for (const double length : term.lengths) lengths.push_back(length);
  for (const ResidualWeights& w : term.weights) {
    weights[w.command.empty() ? "all" : w.command] = rows_json(w.shifts);
  }
  return {{"frame", residual_frame_names()[static_cast<std::size_t>(term.frame)]},
          {"by_drive", term.by_drive},
          {"covariates", std::move(covariates)},
          {"lengths", std::move(lengths)},
          {"centres", rows_json(term.centres)},
          {"weights", std::move(weights)}};
}

bool read_rows(const Json& json, Eigen::MatrixXd* rows) {
  if (!json.is_array() || json.empty() || !json.front().is_array()) return false;
  const std::size_t columns = json.front().size();
  rows->resize(json.size(), columns);
  for (std::size_t k = 0; k < json.size(); ++k) {
    if (!json[k].is_array() || json[k].size() != columns) return false;
    for (std::size_t j = 0; j < columns; ++j) {
      if (!json[k][j].is_number()) return false;
      (*rows)(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j)) = json[k][j];
    }
  }
  return true;
}

// Whatever a model would refuse is refused here, too; its commands are those that have weights.
Status read_term(const Json& json, const std::string& path, ResidualTerm* term) {
  std::string error, frame;
  std::vector<std::string> covariates;
  Fields fields(json, path, error);
  fields.field("frame", frame);
  fields.field("covariates", covariates);
  if (!error.empty()) return Error{error};
  const Error wrong{"diagnosis.json: " + path +
                    " is no term of a residual; was this written by gapfarm diagnose?"};
  const std::vector<std::string>& names = residual_frame_names();
  const auto at = std::find(names.begin(), names.end(), frame);
  const bool whole = json.contains("centres") && json.contains("lengths") &&
                     json["lengths"].is_array() && json.contains("weights") &&
                     json["weights"].is_object() && json.contains("by_drive") &&
                     json["by_drive"].is_boolean();
  if (at == names.end() || !whole || !read_rows(json["centres"], &term->centres)) return wrong;
  term->frame = static_cast<ResidualFrame>(at - names.begin());
  term->by_drive = json["by_drive"];
  for (const Json& length : json["lengths"]) {
    if (!length.is_number()) return wrong;
    term->lengths.push_back(length);
  }
  const auto known = residual_covariates();
  for (const std::string& name : covariates) {
    const auto row = std::ranges::find(known, name, &ResidualCovariate::name);
    if (row == known.end()) return wrong;
    term->covariates.push_back(static_cast<std::size_t>(row - known.begin()));
  }
  for (const auto& [command, rows] : json["weights"].items()) {
    ResidualWeights& w = term->weights.emplace_back();
    if (command != "all") w.command = command;
    if (!read_rows(rows, &w.shifts)) return wrong;
  }
  return {};
}

Json outliers_json(OutlierDrives outliers) {
  Json json = {{"kind", outlier_kind_names()[static_cast<std::size_t>(outliers.kind)]}};
  for (const auto& [key, value] : outlier_values(outliers)) json[key] = *value;
  return json;
}

Status read_outliers(const Json& json, OutlierDrives* outliers) {
  std::string error, kind;
  Fields fields(json, "residual.strays", error);
  fields.field("kind", kind);
  for (const auto& [key, value] : outlier_values(*outliers)) fields.field(key, *value);
  if (!error.empty()) return Error{error};
  const std::vector<std::string>& names = outlier_kind_names();
  const auto at = std::find(names.begin(), names.end(), kind);
  if (at == names.end()) return Error{"diagnosis.json: residual.strays.kind is \"" + kind + "\""};
  outliers->kind = static_cast<OutlierKind>(at - names.begin());
  if (Status s = check_outliers(*outliers); !s)
    return Error{"diagnosis.json: " + s.error().message};
  return {};
}

bool read_chances(const Json& outliers, std::vector<double>* chances) {
  if (!outliers.contains("chances") || !outliers["chances"].is_array()) return false;
  for (const Json& chance : outliers["chances"]) {
    if (!chance.is_number() || !(chance >= 0 && chance <= 1)) return false;
    chances->push_back(chance);
  }
  return true;
}

constexpr auto kFound = [](auto& v, auto& row) {
  FIELDS(text, gained, gained_lo, gained_hi, gap_before, gap_after, closed, closed_lo, closed_hi);
};

}  // namespace

Json residual_json(const FoundResidual& residual) {
  Json json = {{"kept", !residual.correction.empty()}};
  json.update(FieldWriter::written(residual, kFound));
  json["terms"] = Json::array();
  for (const ResidualTerm& term : residual.correction.field) {
    json["terms"].push_back(term_json(term));
  }
  if (residual.correction.outliers) {
    json["strays"] = outliers_json(*residual.correction.outliers);
    json["strays"]["chances"] = residual.chances;
  }
  return json;
}

Status read_residual(const Json& json, std::optional<FoundResidual>* residual) {
  std::string error;
  FoundResidual found;
  Fields fields(json, "residual", error);
  kFound(fields, found);
  std::vector<std::string> commands;
  Status sound;
  fields.for_each("terms", [&](const Json& item, const std::string& path, const auto&) {
    ResidualTerm& term = found.correction.field.emplace_back();
    if (sound) sound = read_term(item, path, &term);
    for (const ResidualWeights& w : term.weights) {
      if (!w.command.empty()) commands.push_back(w.command);
    }
  });
  if (!error.empty()) return Error{error};
  if (!sound) return sound;
  if (Status s = check_residual(found.correction.field, commands); !s) {
    return Error{"diagnosis.json: " + s.error().message};
  }
  if (json.contains("strays")) {
    OutlierDrives& outliers = found.correction.outliers.emplace();
    if (Status s = read_outliers(json["strays"], &outliers); !s) return s;
    if (!read_chances(json["strays"], &found.chances)) {
      return Error{"diagnosis.json: residual.strays.chances is no list of numbers in [0, 1]"};
    }
  }
  *residual = std::move(found);
  return {};
}

}  // namespace gapfarm
