// [residual] of models, which a problem's message carries as it is.
#include <algorithm>
#include <cctype>
#include <optional>

#include "common/base/text.h"
#include "common/config/toml_section.h"
#include "common/problem/message_parts.h"

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

void read_weights(TomlSection& section, const Simulated& model, ResidualTerm* term) {
  section.within("weights", [&](TomlSection& weights) {
    const auto read = [&](const std::string& key, const std::string& command) {
      auto rows = read_rows(weights, key, 3);
      if (rows) term->weights.push_back({command, std::move(*rows)});
    };
    read(kAll, "");
    for (const CommandSpec& c : model.commands) read(c.name, c.name);
  });
}

ResidualTerm read_term(TomlSection& section, const Simulated& model) {
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
void read_outliers(TomlSection& section, Simulated& model) {
  section.within("strays", [&](TomlSection& own) {
    OutlierDrives outliers;
    own.read("kind", outliers.kind, outlier_kind_names());
    for (const auto& [key, value] : outlier_values(outliers)) own.read(key, *value, -1e3, 1e3);
    model.residual.outliers = outliers;
  });
}

void write_outliers(OutlierDrives outliers, TomlLines& out) {
  out.within("residual.strays", [&](TomlLines& own) {
    own.read("kind", outliers.kind, outlier_kind_names());
    for (const auto& [key, value] : outlier_values(outliers)) {
      if (*value != 0) own.read(key, *value);
    }
  });
}

std::string rows_text(const Eigen::MatrixXd& rows) {
  std::vector<std::vector<double>> lists;
  for (const auto& row : rows.rowwise()) lists.emplace_back(row.begin(), row.end());
  return toml_rows(lists, ",\n  ");
}

// A message may name commands as it likes.
std::string weights_key(const std::string& command) {
  if (command.empty()) return kAll;
  const auto bare = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  return std::ranges::all_of(command, bare) ? command : toml_string(command);
}

void write_term(const ResidualTerm& term, TomlLines& out) {
  const auto known = residual_covariates();
  const auto name_of = [&](std::size_t covariate) { return std::string(known[covariate].name); };
  out.raw("\n[[residual.terms]]\n");
  out.read("frame", term.frame, residual_frame_names());
  out.read("by_drive", term.by_drive);
  out.read("covariates", mapped(term.covariates, name_of));
  out.raw("lengths = [" + joined(term.lengths, ", ", toml_number) +
          "]\ncentres = " + rows_text(term.centres) + "\n[residual.terms.weights]\n");
  for (const ResidualWeights& w : term.weights) {
    out.raw(weights_key(w.command) + " = " + rows_text(w.shifts) + "\n");
  }
}

}  // namespace

Status check_residual_of(const Simulated& model) {
  if (model.residual.empty()) return {};
  if (!scenario_form(model.scenario).residual) {
    return Error{"scenario " + model.scenario +
                 " takes no [residual]; leave the section out of this model"};
  }
  RETURN_IF_ERROR(check_residual(model.residual.field, command_names(model.commands)));
  return model.residual.outliers ? check_outliers(*model.residual.outliers) : Status();
}

void read_residual(TomlSection& top, Simulated& model) {
  auto section = top.section("residual");
  if (!section) return;
  read_outliers(*section, model);
  const toml::node* node = section->find("terms");
  if (node != nullptr || !model.residual.outliers) {
    auto terms = section->sections(
        "terms",
        "[residual] has no terms, expected sections [[residual.terms]] with frame, covariates, "
        "lengths, centres and weights; or leave [residual] out");
    for (TomlSection& term : terms) model.residual.field.push_back(read_term(term, model));
  }
  section->finish();
  if (!top.errors().empty()) return;
  if (Status s = check_residual_of(model); !s) {
    top.errors().add(node == nullptr ? section->table() : *node, s.error().message);
  }
}

void write_residual(const Simulated& model, TomlLines& out) {
  if (model.residual.empty()) return;
  out.raw(
      "\n# What nothing in the catalogue explains, as a correction of where drives end; it is no "
      "cause.\n# Each term: sum of weights (m, m, rad) times exp(-|(z - centre) / length|^2 / 2) "
      "over its covariates z.\n# Outliers: a share of drives has an amount, uniform from least to "
      "most, of what all others have `rest` of.\n[residual]\n");
  for (const ResidualTerm& term : model.residual.field) write_term(term, out);
  if (model.residual.outliers) write_outliers(*model.residual.outliers, out);
}

Status read_residual(const v1::Problem& message, Problem* problem) {
  ASSIGN_OR_RETURN(const auto parsed, parse_toml(message.residual(), "problem"));
  TomlErrors errors("problem");
  TomlSection top(parsed, "", errors);
  read_residual(top, *problem);
  top.finish();
  return errors.empty() ? Status() : errors.error();
}

}  // namespace gapfarm
