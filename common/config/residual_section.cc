#include <optional>

#include "common/config/sections.h"
#include "common/problem/problem.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

constexpr const char* kAll = "all";

std::vector<std::string> covariate_names() {
  std::vector<std::string> names;
  for (const ResidualCovariate& c : residual_covariates()) names.emplace_back(c.name);
  return names;
}

// Rows of equally many finite numbers.
std::optional<Eigen::MatrixXd> read_rows(TomlSection& section, const std::string& key,
                                         Eigen::Index columns) {
  const auto rows = section.rows(
      key, static_cast<std::size_t>(columns),
      key + " are rows of " + std::to_string(columns) + " finite numbers: [[0, ...], ...]");
  if (!rows) return std::nullopt;
  Eigen::MatrixXd matrix(rows->size(), columns);
  for (std::size_t k = 0; k < rows->size(); ++k) {
    matrix.row(k) = Eigen::RowVectorXd::Map((*rows)[k].data(), columns);
  }
  return matrix;
}

void read_weights(TomlSection& section, const Model& model, ResidualTerm* term) {
  auto weights = section.section("weights");
  if (!weights) return;
  const auto read = [&](const std::string& key, const std::string& command) {
    auto rows = read_rows(*weights, key, 3);
    if (rows) term->weights.push_back({command, std::move(*rows)});
  };
  read(kAll, "");
  for (const CommandSpec& c : model.commands) read(c.name, c.name);
  weights->finish();
}

ResidualTerm read_term(TomlSection& section, const Model& model) {
  ResidualTerm term;
  section.read("frame", term.frame, residual_frame_names());
  section.read("by_drive", term.by_drive);
  const std::vector<std::string> names = covariate_names();
  term.covariates = section.choices("covariates", names).value_or(std::vector<std::size_t>());
  term.lengths = section.numbers("lengths", 1e-9, 1e9).value_or(std::vector<double>());
  if (!term.covariates.empty()) {
    auto rows = read_rows(section, "centres", term.covariates.size());
    if (rows) term.centres = std::move(*rows);
  }
  read_weights(section, model, &term);
  section.finish();
  return term;
}

// What is omitted is 0.
void read_outliers(TomlSection& section, Model& model) {
  auto read = section.section("strays");
  if (!read) return;
  OutlierDrives outliers;
  read->read("kind", outliers.kind, outlier_kind_names());
  for (const auto& [key, value] : outlier_values(outliers)) {
    *value = read->number(key, -1e3, 1e3).value_or(*value);
  }
  read->finish();
  model.residual.outliers = outliers;
}

std::string outliers_text(OutlierDrives outliers) {
  std::string text = "\n[residual.strays]\nkind = \"" +
                     outlier_kind_names()[static_cast<std::size_t>(outliers.kind)] + "\"\n";
  for (const auto& [key, value] : outlier_values(outliers)) {
    if (*value != 0) text += std::string(key) + " = " + format_double(*value) + "\n";
  }
  return text;
}

std::string rows_text(const Eigen::MatrixXd& rows) {
  std::string text;
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    text += k == 0 ? "[" : ",\n  ";
    for (Eigen::Index j = 0; j < rows.cols(); ++j) {
      text += (j == 0 ? "[" : ", ") + format_double(rows(k, j));
    }
    text += "]";
  }
  return text + "]";
}

std::string term_text(const ResidualTerm& term) {
  const auto known = residual_covariates();
  std::string names, lengths;
  for (std::size_t j = 0; j < term.covariates.size(); ++j) {
    const char* separator = j == 0 ? "" : ", ";
    names += std::string(separator) + '"' + known[term.covariates[j]].name + '"';
    lengths += separator + format_double(term.lengths[j]);
  }
  std::string text = "\n[[residual.terms]]\nframe = \"" +
                     residual_frame_names()[static_cast<std::size_t>(term.frame)] +
                     "\"\nby_drive = " + (term.by_drive ? "true" : "false") + "\ncovariates = [" +
                     names + "]\nlengths = [" + lengths +
                     "]\ncentres = " + rows_text(term.centres) + "\n[residual.terms.weights]\n";
  for (const ResidualWeights& w : term.weights) {
    text += (w.command.empty() ? kAll : w.command) + " = " + rows_text(w.shifts) + "\n";
  }
  return text;
}

}  // namespace

Status check_residual_of(const Model& model) {
  if (model.residual.empty()) return {};
  if (!scenario_form(model.scenario).residual) {
    return Error{"scenario " + model.scenario +
                 " takes no [residual]; leave the section out of this model"};
  }
  RETURN_IF_ERROR(check_residual(model.residual.field, command_names(model.commands)));
  return model.residual.outliers ? check_outliers(*model.residual.outliers) : Status();
}

void read_residual(TomlSection& top, Model& model) {
  auto section = top.section("residual");
  if (!section) return;
  read_outliers(*section, model);
  const toml::node* node = section->find("terms");
  const auto check = [&](const toml::source_position& place) {
    if (!top.errors().empty()) return;
    if (Status s = check_residual_of(model); !s) top.errors().add(place, s.error().message);
  };
  if (node == nullptr && model.residual.outliers) {
    section->finish();
    check(section->table().source().begin);
    return;
  }
  const toml::array* list = node == nullptr ? nullptr : node->as_array();
  if (list == nullptr || list->empty()) {
    top.errors().add(node == nullptr ? section->table().source().begin : node->source().begin,
                     "[residual] has no terms, expected sections [[residual.terms]] with frame, "
                     "covariates, lengths, centres and weights; or leave [residual] out");
    return;
  }
  for (const toml::node& entry : *list) {
    const toml::table* table = entry.as_table();
    if (table == nullptr) {
      top.errors().add(
          entry, "residual.terms holds " + toml_type_name(entry) + ", expected [[residual.terms]]");
      continue;
    }
    TomlSection term(*table, "[[residual.terms]]", top.errors());
    model.residual.field.push_back(read_term(term, model));
  }
  section->finish();
  check(node->source().begin);
}

std::string residual_section(const Model& model) {
  if (model.residual.empty()) return "";
  std::string text =
      "\n# What nothing in the catalogue explains, as a correction of where drives end; it is no "
      "cause.\n# Each term: sum of weights (m, m, rad) times exp(-|(z - centre) / length|^2 / 2) "
      "over its covariates z.\n# Outliers: a share of drives has an amount, uniform from least to "
      "most, of what all others have `rest` of.\n[residual]\n";
  for (const ResidualTerm& term : model.residual.field) text += term_text(term);
  if (model.residual.outliers) text += outliers_text(*model.residual.outliers);
  return text;
}

}  // namespace gapfarm
