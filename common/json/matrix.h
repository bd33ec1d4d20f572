// Matrices as JSON: a list a row.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/json/fields.h"

template <>
struct nlohmann::adl_serializer<Eigen::MatrixXd> {
  static void to_json(gapfarm::Json& json, const Eigen::MatrixXd& matrix) {
    json = gapfarm::Json::array();
    for (const auto& row : matrix.rowwise()) {
      json.push_back(std::vector<double>(row.begin(), row.end()));
    }
  }
};

template <>
struct gapfarm::FieldForm<Eigen::MatrixXd> {
  using Written = std::vector<std::vector<double>>;
  static const char* set(const Written& rows, Eigen::MatrixXd& to) {
    if (!rows.empty()) to.resize(rows.size(), rows.front().size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (rows[k].size() != rows.front().size()) return "rows of one length";
      to.row(k) = Eigen::Map<const Eigen::RowVectorXd>(rows[k].data(), to.cols());
    }
    return nullptr;
  }
};
