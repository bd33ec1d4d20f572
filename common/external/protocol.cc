#include "common/external/protocol.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>

#include "common/base/suggest.h"
#include "common/base/try.h"
#include "common/json/json.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kShown = 80;

Error wrong(const std::string& what, const std::string& line) {
  std::string shown = line.substr(0, kShown);
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
  }
  return Error{what + ": '" + shown + (line.size() > kShown ? "...'" : "'")};
}

// Python's json and others print what JSON does not have.
Result<Json> read_object(const std::string& line, const std::string& what) {
  Json json = parse_json(line);
  if (json.is_object()) return json;
  static const std::regex kNotNumbers("-?\\b(NaN|Infinity|nan|inf)\\b");
  std::smatch found;
  if (std::regex_search(line, found, kNotNumbers) &&
      parse_json(std::regex_replace(line, kNotNumbers, "null")).is_object()) {
    return wrong("printed " + found.str() +
                     ", which is no number in JSON: print null for a pose "
                     "that a simulation does not have",
                 line);
  }
  return wrong(what, line);
}

std::string word_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  std::string word = found != json.end() && found->is_string() ? found->get<std::string>() : "";
  for (char& c : word) {  // it goes into one line of models and messages
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = ' ';
  }
  return word;
}

double number_of(const Json& json, const char* key, double fallback) {
  const auto found = json.find(key);
  if (found == json.end()) return fallback;
  return found->is_number() ? found->get<double>() : NAN;
}

Result<unsigned> read_inputs(const Json& json) {
  unsigned inputs = 0;
  std::vector<std::string> known;
  for (const ExternalInputWord& row : kExternalInputNames) known.emplace_back(row.word);
  for (const Json& word : json.value("inputs", Json::array())) {
    const std::string text = word.is_string() ? word.get<std::string>() : json_text(word);
    const auto row = std::find_if(std::begin(kExternalInputNames), std::end(kExternalInputNames),
                                  [&](const ExternalInputWord& r) { return text == r.word; });
    if (row == std::end(kExternalInputNames)) {
      return Error{"declares the unknown input '" + text + "'" + suggestion(text, known) +
                   "; known: lag, dead_travel, floor, path"};
    }
    inputs |= row->input;
  }
  return inputs;
}

// A key that is not known would be ignored without a word.
Status check_keys(const Json& json, const std::string& parameter) {
  static const std::vector<std::string> kKeys = {"key",     "unit", "lower",   "upper",
                                                 "nominal", "log",  "integer", "summary"};
  for (const auto& [key, value] : json.items()) {
    if (std::find(kKeys.begin(), kKeys.end(), key) != kKeys.end()) continue;
    return Error{"declares parameter '" + parameter + "' with the unknown key '" + key + "'" +
                 suggestion(key, kKeys) +
                 "; known: key, unit, lower, upper, nominal, log, integer, summary"};
  }
  return {};
}

Result<Parameter> read_parameter(const Json& json) {
  Parameter p;
  p.key = word_of(json, "key");
  RETURN_IF_ERROR(check_keys(json, p.key));
  if (json.value("integer", Json(false)) == Json(true)) p.kind = ParameterKind::kInteger;
  p.unit = word_of(json, "unit");
  if (p.unit.empty()) p.unit = "-";
  p.summary = word_of(json, "summary");
  p.lower = number_of(json, "lower", NAN);
  p.upper = number_of(json, "upper", NAN);
  p.nominal = number_of(json, "nominal", NAN);
  if (json.value("log", Json(false)) == Json(true)) p.scale = ParameterScale::kLog;
  return p;
}

Json to_json(const ExternalSide& side, unsigned inputs) {
  Json json = {{"speed", side.speed}};
  if (inputs & kExternalLag) json["lag"] = side.lag_s;
  if (inputs & kExternalDeadTravel) json["dead_travel"] = side.dead_travel_m;
  return json;
}

Json to_json(const ExternalFloor& f) {
  return {{"tilt", f.tilt_rad},
          {"tilt_direction", f.tilt_direction_rad},
          {"nap", f.nap_strength},
          {"nap_direction", f.nap_direction_rad},
          {"rolling_resistance", f.rolling_resistance},
          {"patch", {f.patch_x_m, f.patch_y_m, f.patch_radius_m}},
          {"patch_ratio", f.patch_ratio}};
}

Json parameters_json(const ExternalDeclaration& declaration, const std::vector<double>& values) {
  Json parameters = Json::object();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Parameter& p = declaration.parameters[i];
    Json& value = parameters[p.key] = values[i];
    if (p.kind == ParameterKind::kInteger) value = std::llround(values[i]);
  }
  return parameters;
}

// `count` finite numbers, or none.
std::vector<double> numbers(const Json& json, std::size_t count) {
  std::vector<double> values;
  if (!json.is_array() || json.size() != count) return values;
  for (const Json& value : json) {
    if (!value.is_number() || !std::isfinite(value.get<double>())) return {};
    values.push_back(value.get<double>());
  }
  return values;
}

// The answer to question `id`; says whether it diverged.
template <class Answer>
Result<Json> read_answer(const std::string& line, std::uint64_t id, Answer* answer) {
  ASSIGN_OR_RETURN(const Json json, read_object(line, "did not answer with a JSON object"));
  const auto own = json.find("id");
  if (own == json.end() || *own != Json(id)) {
    return wrong("answered another question than " + std::to_string(id), line);
  }
  const std::string outcome = word_of(json, "outcome");
  if (!outcome.empty() && outcome != "ok" && outcome != "diverged") {
    return wrong("ended with an outcome other than ok or diverged", line);
  }
  answer->diverged = outcome == "diverged";
  answer->message = word_of(json, "message");
  return json;
}

bool has_null(const Json& given) {
  return given.is_null() || std::any_of(given.begin(), given.end(), [](const Json& value) {
           return value.is_null() || (value.is_array() && has_null(value));
         });
}

}  // namespace

std::string hello_line() { return json_text(Json{{"gapfarm", kExternalProtocol}}); }

Result<ExternalDeclaration> parse_declaration(const std::string& line) {
  ASSIGN_OR_RETURN(const Json read,
                   read_object(line, "does not introduce itself with a JSON object"));
  const Json& json = read;
  if (number_of(json, "gapfarm", 0) != kExternalProtocol) {
    return wrong("does not speak protocol " + std::to_string(kExternalProtocol) +
                     " (\"gapfarm\": 1 is missing)",
                 line);
  }
  ExternalDeclaration declaration;
  declaration.name = word_of(json, "name");
  const Json rows = json.value("parameters", Json::array());
  if (!rows.is_array() ||
      !std::all_of(rows.begin(), rows.end(), [](const Json& row) { return row.is_object(); })) {
    return wrong("declares parameters that are no list of objects", json_text(rows));
  }
  for (const Json& row : rows) {
    ASSIGN_OR_RETURN(const Parameter parameter, read_parameter(row));
    declaration.parameters.push_back(parameter);
  }
  for (const Json& channel : json.value("channels", Json::array())) {
    declaration.channels.push_back(channel.is_string() ? channel.get<std::string>() : "");
  }
  RETURN_IF_ERROR(check_declaration(declaration));
  ASSIGN_OR_RETURN(const auto inputs, read_inputs(json));
  declaration.inputs = inputs;
  return declaration;
}

Result<std::shared_ptr<const ExternalProgram>> make_external_program(ExternalCommand command,
                                                                     std::string introduction) {
  if (command.argv.empty()) return Error{"the external program has no name"};
  auto declaration = parse_declaration(introduction);
  if (!declaration) {
    return Error{"external program '" + command.argv[0] + "' " + declaration.error().message};
  }
  return std::shared_ptr<const ExternalProgram>(new ExternalProgram{
      std::move(command), std::move(introduction), ExternalTable(std::move(*declaration))});
}

std::string request_line(const ExternalRequest& request) {
  const unsigned inputs = request.declaration->inputs;
  Json json = {{"id", request.id},
               {"parameters", parameters_json(*request.declaration, request.values)},
               {"left", to_json(request.left, inputs)},
               {"right", to_json(request.right, inputs)},
               {"duration", request.duration_s}};
  if (inputs & kExternalPath) json["interval"] = request.interval_s;
  if (inputs & kExternalFloor) json["floor"] = to_json(request.floor);
  return json_text(json);
}

Result<ExternalAnswer> parse_answer(const std::string& line, const ExternalRequest& request) {
  ExternalAnswer answer;
  ASSIGN_OR_RETURN(const Json read, read_answer(line, request.id, &answer));
  const Json& json = read;
  if (answer.diverged) return answer;
  const Json given = json.value("pose", Json::array());
  if (has_null(given)) {
    answer.diverged = true;
    answer.message = "it answered a pose of null";
    return answer;
  }
  const std::vector<double> pose = numbers(given, 3);
  if (pose.empty())
    return wrong("did not answer with \"pose\": [x, y, theta] of finite numbers", line);
  answer.X_SE = {pose[0], pose[1], wrap_angle(pose[2])};
  answer.rest_time_s = number_of(json, "rest", 0);
  if (!(answer.rest_time_s >= 0)) return wrong("answered a \"rest\" that is no time", line);
  if (request.interval_s == 0) return answer;
  for (const Json& row : json.value("path", Json::array())) {
    const std::vector<double> s = numbers(row, 4);
    const bool later = answer.path.empty() || (!s.empty() && s[0] >= answer.path.back().t_s);
    if (s.empty() || !later)
      return wrong("answered a path that is no list of [t, x, y, theta]", line);
    answer.path.push_back({s[0], {s[1], s[2], wrap_angle(s[3])}});
  }
  if (answer.path.empty()) return wrong("was asked for a path and answered none", line);
  return answer;
}

std::string request_line(const ExternalRunRequest& request) {
  Json commands = Json::array();
  for (const CommandRow& row : request.commands) {
    Json& to = commands.emplace_back(Json::array({row.t_s}));
    for (const double value : row.values) to.push_back(value);
  }
  return json_text(
      Json{{"id", request.id},
           {"parameters", parameters_json(*request.declaration, request.values)},
           {"start",
            {{"t", request.start_s}, {"speed", request.speed_m_s}, {"turn", request.turn_rad_s}}},
           {"commands", std::move(commands)},
           {"times", Json(std::vector<double>(request.times_s.begin(), request.times_s.end()))}});
}

Result<ExternalRunAnswer> parse_answer(const std::string& line, const ExternalRunRequest& request) {
  ExternalRunAnswer answer;
  ASSIGN_OR_RETURN(const Json json, read_answer(line, request.id, &answer));
  if (answer.diverged) return answer;
  const Json given = json.value("poses", Json::array());
  if (has_null(given)) {
    answer.diverged = true;
    answer.message = "it answered a pose of null";
    return answer;
  }
  for (const Json& row : given) {
    const std::vector<double> pose = numbers(row, 3);
    if (pose.empty()) return wrong("answered poses that are no list of finite [x, y, theta]", line);
    answer.poses.push_back({pose[0], pose[1], wrap_angle(pose[2])});
  }
  if (answer.poses.size() == request.times_s.size()) return answer;
  return wrong("answered " + std::to_string(answer.poses.size()) + " poses, was asked for " +
                   std::to_string(request.times_s.size()),
               line);
}

}  // namespace gapfarm
