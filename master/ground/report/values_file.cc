#include "master/ground/report/values_file.h"

#include <nlohmann/json.hpp>

#include "common/robot/robot_file.h"

namespace gapfarm {

nlohmann::ordered_json values_json(const std::vector<ReportedValue>& values) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const ReportedValue& v : values) {
    rows.push_back({{"name", v.name},
                    {"had", v.had},
                    {"says", v.reported},
                    {"lo", v.interval.lower},
                    {"hi", v.interval.upper},
                    {"named", v.named}});
  }
  return rows;
}

std::string format_values(const ReportedValues& values) {
  const nlohmann::ordered_json json = {{"logs", values.logs},
                                       {"values", values_json(values.values)},
                                       {"robot", format_robot(values.given)}};
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

Result<ReportedValues> parse_values(const std::string& text, const std::string& path) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  const Error error{path + ": found no values of a ground robot's diagnosis; diagnose it again"};
  if (!json.is_object() || !json.contains("values") || !json.contains("robot")) return error;
  if (!json["robot"].is_string() || !json["values"].is_array()) return error;
  auto robot = parse_robot(json["robot"].get<std::string>(), path);
  if (!robot) return robot.error();
  ReportedValues values;
  values.given = *std::move(robot);
  const auto number = [](const nlohmann::json& row, const char* key) {
    return row.contains(key) && row[key].is_number() ? row[key].get<double>() : 0.0;
  };
  for (const auto& row : json["values"]) {
    if (!row.is_object() || !row.contains("name") || !row["name"].is_string()) return error;
    ReportedValue v;
    v.name = row["name"].get<std::string>();
    v.had = number(row, "had");
    v.reported = number(row, "says");
    v.interval = {number(row, "lo"), number(row, "hi")};
    v.named = row.contains("named") && row["named"].is_boolean() && row["named"].get<bool>();
    values.values.push_back(std::move(v));
  }
  if (!json.contains("logs") || !json["logs"].is_array()) return values;
  for (const auto& log : json["logs"]) {
    if (log.is_string()) values.logs.push_back(log.get<std::string>());
  }
  return values;
}

}  // namespace gapfarm
