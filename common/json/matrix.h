// Matrices as JSON: a list a row.
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <vector>

#include "common/json/json.h"

template <>
struct nlohmann::adl_serializer<Eigen::MatrixXd> {
  static void to_json(gapfarm::Json& json, const Eigen::MatrixXd& matrix) {
    json = gapfarm::Json::array();
    for (const auto& row : matrix.rowwise()) {
      json.push_back(std::vector<double>(row.begin(), row.end()));
    }
  }
};
