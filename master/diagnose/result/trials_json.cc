// Trials as a table, drives with their paths, and how the pictures describe both.

#include <nlohmann/json.hpp>
#include <type_traits>

#include "common/base/text.h"
#include "common/json/fields.h"
#include "common/json/json.h"
#include "master/diagnose/result/diagnosis_json.h"

namespace gapfarm {
namespace {

// Calls visit(name, field) for every column in order, so that writing and reading cannot disagree.
// `Trial` is DiagnosedTrial or const DiagnosedTrial.
template <class Trial, class Visit>
void visit_columns(Trial& trial, const Visit& visit) {
  visit("session", trial.session);
  visit("trial", trial.trial);
  visit("command", trial.command);
  visit("session_time_s", trial.session_time_s);
  visit("duration_s", trial.duration_s);
  visit("level", trial.level);
  visit("place_in_run", trial.place_in_run);
  visit("held_out", trial.held_out);
  const auto pose = [&](const std::string& name, auto& X) {
    visit(name + "_x", X.x);
    visit(name + "_y", X.y);
    visit(name + "_theta", X.theta);
  };
  pose("start", trial.X_WS);
  pose("measured", trial.measured);
  pose("tuned", trial.tuned);
  pose("final", trial.final_);
  const auto covariance = [&](const std::string& name, auto& cov) {
    const char* axes = "xyt";
    for (int row = 0; row < 3; ++row) {
      for (int column = row; column < 3; ++column) {
        visit(name + "_cov_" + axes[row] + axes[column], cov(row, column));
      }
    }
  };
  covariance("tuned", trial.tuned_cov);
  covariance("final", trial.final_cov);
  const auto residual = [&](const std::string& name, auto& r) {
    visit(name + "_residual_x", r.x());
    visit(name + "_residual_y", r.y());
    visit(name + "_residual_theta", r.z());
  };
  residual("tuned", trial.tuned_residual);
  residual("final", trial.final_residual);
  visit("tuned_score", trial.tuned_score);
  visit("final_score", trial.final_score);
}

}  // namespace

Json trials_json(const Diagnosis& diagnosis, int digits) {
  Json columns = Json::array();
  const DiagnosedTrial blank{};
  visit_columns(blank, [&](const std::string& name, const auto&) { columns.push_back(name); });
  for (const ShownCovariate& shown : diagnosis.shown) columns.push_back(shown.key);
  Json rows = Json::array();
  for (const DiagnosedTrial& trial : diagnosis.trials) {
    Json row = Json::array();
    visit_columns(trial, [&](const std::string&, const auto& field) {
      if constexpr (std::is_same_v<std::decay_t<decltype(field)>, double>) {
        row.push_back(rounded_to_digits(field, digits));
      } else {
        row.push_back(field);
      }
    });
    for (double value : trial.covariates) row.push_back(rounded_to_digits(value, digits));
    rows.push_back(std::move(row));
  }
  return {{"columns", std::move(columns)}, {"rows", std::move(rows)}};
}

Result<std::vector<DiagnosedTrial>> parse_trials(const Json& table,
                                                 const std::vector<ShownCovariate>& shown) {
  Diagnosis none;
  none.shown = shown;
  const Json expected = trials_json(none)["columns"];
  if (!table.is_object() || !table.contains("columns") || !table.contains("rows") ||
      !table["rows"].is_array()) {
    return Error{"diagnosis.json: \"trials\" must be an object with \"columns\" and \"rows\""};
  }
  if (table["columns"] != expected) {
    return Error{
        "diagnosis.json: \"trials.columns\" are not those of this version; diagnose again"};
  }
  std::vector<DiagnosedTrial> trials;
  trials.reserve(table["rows"].size());
  for (const Json& row : table["rows"]) {
    const std::string where = "trials.rows[" + std::to_string(trials.size()) + "]";
    if (!row.is_array() || row.size() != expected.size()) {
      return Error{"diagnosis.json: " + where + " must be a list of " +
                   std::to_string(expected.size()) + " cells"};
    }
    DiagnosedTrial& trial = trials.emplace_back();
    trial.covariates.resize(shown.size());
    std::size_t column = 0;
    std::string error;
    FieldReader cells(table, where, &error);
    const auto read = [&](const std::string& name, auto& field) {
      cells.cell(name, row[column++], field);
    };
    visit_columns(trial, read);
    for (std::size_t k = 0; k < shown.size(); ++k) read(shown[k].key, trial.covariates[k]);
    if (!error.empty()) return Error{"diagnosis.json: " + error};
    for (Eigen::Matrix3d* cov : {&trial.tuned_cov, &trial.final_cov}) {
      cov->triangularView<Eigen::StrictlyLower>() = cov->transpose();
    }
  }
  return trials;
}

}  // namespace gapfarm
