#include "common/external/protocol.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/external/line_json.h"
#include "common/json/json.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

using line_json::read_object;
using line_json::word_of;
using line_json::wrong;

double number_of(const Json& json, const char* key, double fallback) {
  const auto found = json.find(key);
  if (found == json.end()) return fallback;
  return found->is_number() ? found->get<double>() : NAN;
}

Result<unsigned> read_inputs(const Json& json) {
  unsigned inputs = 0;
  for (const Json& word : json.value("inputs", Json::array())) {
    const std::string text = word.is_string() ? word.get<std::string>() : json_text(word);
    const auto* row = find_by(kExternalInputNames, text, &ExternalInputWord::word);
    if (!row) {
      const std::vector<std::string> known(
          mapped(kExternalInputNames, [](auto& r) { return std::string(r.word); }));
      return Error{"declares the unknown input '" + text + "'" + suggestion(text, known)};
    }
    inputs |= row->input;
  }
  return inputs;
}

// A key that is not known would be ignored without a word.
Status check_keys(const Json& json, const std::string& parameter) {
  static const std::vector<std::string> kKeys = {"key", "unit",    "lower",   "upper", "nominal",
                                                 "log", "integer", "choices", "when",  "summary"};
  for (const auto& [key, value] : json.items()) {
    if (contains(kKeys, key)) continue;
    return Error{"declares parameter '" + parameter + "' with the unknown key '" + key + "'" +
                 suggestion(key, kKeys)};
  }
  return {};
}

Result<bool> flag_of(const Json& json, const char* key) {
  const Json given = json.value(key, Json(false));
  if (given.is_boolean()) return given.get<bool>();
  return Error{"declares parameter '" + word_of(json, "key") + "' with \"" + key +
               "\": " + json_text(given) + "; it takes true or false"};
}

// The index of a word, or NaN.
double choice_of(const Parameter& p, const Json& word) {
  const auto at = std::find(p.choices.begin(), p.choices.end(), word);
  return at == p.choices.end() ? NAN : static_cast<double>(at - p.choices.begin());
}

Status read_choices(const Json& json, Parameter* p) {
  const Json& given = json["choices"];
  const auto wrong = [&](const char* what) {
    return Error{"parameter '" + p->key + "' has choices " + what};
  };
  if (!given.is_array() || given.size() < 2 ||
      !std::all_of(given.begin(), given.end(), [](const Json& word) { return word.is_string(); })) {
    return wrong("that are no list of two or more strings");
  }
  for (const char* key : {"lower", "upper", "log", "integer"}) {
    if (json.contains(key)) return wrong("and bounds or a scale; omit one of the two");
  }
  for (const Json& word : given) p->choices.push_back(word.get<std::string>());
  p->kind = ParameterKind::kChoice;
  p->upper = static_cast<double>(given.size() - 1);
  p->nominal = json.contains("nominal") ? choice_of(*p, json["nominal"]) : 0;
  return {};
}

// {"key": value, ...} or {"key": [value, ...], ...} of parameters before this one.
Result<std::vector<ExternalCondition>> read_conditions(const Json& json,
                                                       const std::vector<Parameter>& before) {
  std::vector<ExternalCondition> conditions;
  const Json when = json.value("when", Json::object());
  if (!when.is_object()) {
    return Error{"parameter '" + word_of(json, "key") + "' has a \"when\" that is no object"};
  }
  for (const auto& [key, given] : when.items()) {
    const auto wrong = [&](const std::string& what) {
      return Error{"parameter '" + word_of(json, "key") + "' depends on '" + key + "', " + what};
    };
    const auto on = std::ranges::find(before, key, &Parameter::key);
    if (on == before.end()) return wrong("which is not declared before it");
    if (on->kind == ParameterKind::kReal) return wrong("which is neither choices nor an integer");
    ExternalCondition& one = conditions.emplace_back();
    one.row = static_cast<std::size_t>(on - before.begin());
    for (const Json& value : given.is_array() ? given : Json::array({given})) {
      const bool number = on->kind == ParameterKind::kInteger && value.is_number();
      one.values.push_back(number ? value.get<double>() : choice_of(*on, value));
      if (!(one.values.back() >= on->lower && one.values.back() <= on->upper)) {
        return wrong("which is never " + json_text(value));
      }
    }
  }
  return conditions;
}

Result<Parameter> read_parameter(const Json& json) {
  Parameter p;
  p.key = word_of(json, "key");
  RETURN_IF_ERROR(check_keys(json, p.key));
  ASSIGN_OR_RETURN(const bool whole, flag_of(json, "integer"));
  ASSIGN_OR_RETURN(const bool log, flag_of(json, "log"));
  if (whole) p.kind = ParameterKind::kInteger;
  p.unit = word_of(json, "unit");
  if (p.unit.empty()) p.unit = "-";
  p.summary = word_of(json, "summary");
  if (json.contains("choices")) {
    RETURN_IF_ERROR(read_choices(json, &p));
    return p;
  }
  p.lower = number_of(json, "lower", NAN);
  p.upper = number_of(json, "upper", NAN);
  p.nominal = number_of(json, "nominal", NAN);
  if (log) p.scale = ParameterScale::kLog;
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

// What stands for the value at a row's place.
Json to_json(const Parameter& p, double value) {
  if (p.kind == ParameterKind::kChoice) return p.choices[static_cast<std::size_t>(value)];
  if (p.kind == ParameterKind::kInteger) return std::llround(value);
  return value;
}

Json parameters_json(const ExternalDeclaration& declaration, const std::vector<double>& values) {
  const std::vector<bool> present = declaration.present(values);
  Json parameters = Json::object();
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Parameter& p = declaration.parameters[i];
    if (present[i]) parameters[p.key] = to_json(p, values[i]);
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

// The answer to question `id`; says whether it ended with the outcome `bad`.  `not_a_number`: as
// read_object().
template <class Answer>
Result<Json> read_answer(const std::string& line, std::uint64_t id, const std::string& bad,
                         std::string* not_a_number, Answer* answer) {
  ASSIGN_OR_RETURN(const Json json,
                   read_object(line, "did not answer with a JSON object", not_a_number));
  const auto own = json.find("id");
  if (own == json.end() || *own != Json(id)) {
    return wrong("answered another question than " + std::to_string(id), line);
  }
  const std::string outcome = word_of(json, "outcome");
  answer->diverged = outcome == "diverged" || outcome == bad;
  if (!answer->diverged && !outcome.empty() && outcome != "ok") {
    return wrong("ended with an outcome other than ok or " + bad, line);
  }
  if (answer->diverged) answer->message = word_of(json, "message");
  return json;
}

bool has_null(const Json& given) {
  return given.is_null() || (given.is_array() && std::ranges::any_of(given, has_null));
}

// What stands under `key`, an array of poses or their parts; with a null in it the robot diverged.
template <class Answer>
Json poses_of(const Json& json, const char* key, Answer* answer) {
  Json given = json.value(key, Json::array());
  answer->diverged = has_null(given);
  if (answer->diverged) answer->message = "it answered a pose of null";
  return given;
}

// The bounds of a log's reader.
Status check_near(const Pose& X_SE) {
  for (const double coordinate : {X_SE.x, X_SE.y}) {
    if (std::abs(coordinate) <= kGreatestCoordinate_m) continue;
    return Error{
        formatted("answered a coordinate of %g m, expected one in [%g, %g] m; answer "
                  "metres, and null where the simulation diverged",
                  coordinate, -kGreatestCoordinate_m, kGreatestCoordinate_m)};
  }
  return {};
}

// An objective's answer; what is not finite is null here.
Result<ExternalAnswer> read_value(const Json& json, const std::vector<std::string>& objectives,
                                  const std::string& not_a_number, const std::string& line) {
  ExternalAnswer answer;
  answer.message = word_of(json, "notes");
  const auto without_value = [&](const std::string& why) {
    answer.diverged = true;
    answer.message = not_a_number.empty()
                         ? why
                         : "it printed " + not_a_number +
                               ", which is no number in JSON: print null where there is no value";
    return answer;
  };
  const Json violations = json.value("violations", Json::array());
  if (!violations.is_array()) return wrong("answered violations that are no list", line);
  for (const Json& violation : violations) {
    if (violation.is_null()) return without_value("it answered a violation of null");
    if (!violation.is_number()) return wrong("answered a violation that is no number", line);
    answer.violation += std::max(0.0, violation.get<double>());
    answer.violation = std::min(answer.violation, std::numeric_limits<double>::max());
  }
  if (answer.violation > 0) return answer;
  for (const std::string& name : objectives) {
    const Json values = json.value("values", Json::object());
    const Json value = values.is_object() ? values.value(name, Json("none")) : Json("none");
    if (value.is_null()) return without_value("it answered a " + name + " of null");
    if (!value.is_number()) {
      return wrong("did not answer with \"values\": {\"" + name + "\": a number, ...}", line);
    }
    answer.values.push_back(value.get<double>());
  }
  if (!answer.values.empty()) {
    answer.value = answer.values.front();
    return answer;
  }
  if (json.contains("values") && !json.contains("value")) {
    return wrong("answered \"values\", which [objective] minimise and maximise have to name", line);
  }
  const Json value = json.value("value", Json("none"));
  if (value.is_null()) return without_value("it answered a value of null");
  if (!value.is_number()) return wrong("did not answer with \"value\": a number", line);
  answer.value = value.get<double>();
  return answer;
}

}  // namespace

std::string hello_line() { return json_text(Json{{"gapfarm", kExternalProtocol}}); }

Result<ExternalDeclaration> parse_declaration(const std::string& line, bool objective) {
  ASSIGN_OR_RETURN(const Json json,
                   read_object(line, "does not introduce itself with a JSON object"));
  if (number_of(json, "gapfarm", 0) != kExternalProtocol) {
    return wrong("does not speak protocol " + std::to_string(kExternalProtocol) +
                     " (\"gapfarm\": 1 is missing)",
                 line);
  }
  ExternalDeclaration declaration;
  declaration.name = word_of(json, "name");
  declaration.objective = objective;
  const Json rows = json.value("parameters", Json::array());
  if (!rows.is_array() ||
      !std::all_of(rows.begin(), rows.end(), [](const Json& row) { return row.is_object(); })) {
    return wrong("declares parameters that are no list of objects", json_text(rows));
  }
  for (const Json& row : rows) {
    ASSIGN_OR_RETURN(const Parameter parameter, read_parameter(row));
    ASSIGN_OR_RETURN(auto conditions, read_conditions(row, declaration.parameters));
    declaration.when.push_back(std::move(conditions));
    declaration.parameters.push_back(parameter);
  }
  for (const Json& channel : json.value("channels", Json::array())) {
    declaration.channels.push_back(channel.is_string() ? channel.get<std::string>() : "");
  }
  RETURN_IF_ERROR(check_declaration(declaration));
  ASSIGN_OR_RETURN(declaration.inputs, read_inputs(json));
  return declaration;
}

Result<std::shared_ptr<const ExternalProgram>> make_external_program(ExternalCommand command,
                                                                     std::string introduction,
                                                                     bool objective) {
  if (command.argv.empty()) return Error{"the external program has no name"};
  auto declaration = parse_declaration(introduction, objective);
  if (!declaration) {
    return Error{"external program '" + command.argv[0] + "' " + declaration.error().message};
  }
  return std::shared_ptr<const ExternalProgram>(new ExternalProgram{
      std::move(command), std::move(introduction), ExternalTable(std::move(*declaration))});
}

std::string request_line(const ExternalRequest& request) {
  const unsigned inputs = request.declaration->inputs;
  Json json = {{"id", request.id},
               {"parameters", parameters_json(*request.declaration, request.values)}};
  if (request.declaration->objective) {
    json["seed"] = request.seed;
    return json_text(json);
  }
  json["left"] = to_json(request.left, inputs);
  json["right"] = to_json(request.right, inputs);
  json["duration"] = request.duration_s;
  if (inputs & kExternalPath) json["interval"] = request.interval_s;
  if (inputs & kExternalFloor) json["floor"] = to_json(request.floor);
  return json_text(json);
}

Result<ExternalAnswer> parse_answer(const std::string& line, const ExternalRequest& request) {
  const bool objective = request.declaration->objective;
  std::string not_a_number;
  ExternalAnswer answer;
  ASSIGN_OR_RETURN(const Json json, read_answer(line, request.id, objective ? "failed" : "diverged",
                                                objective ? &not_a_number : nullptr, &answer));
  if (answer.diverged) return answer;
  if (objective) return read_value(json, request.objectives, not_a_number, line);
  const Json given = poses_of(json, "pose", &answer);
  if (answer.diverged) return answer;
  const std::vector<double> pose = numbers(given, 3);
  if (pose.empty())
    return wrong("did not answer with \"pose\": [x, y, theta] of finite numbers", line);
  answer.X_SE = {pose[0], pose[1], wrap_angle(pose[2])};
  RETURN_IF_ERROR(check_near(answer.X_SE));
  answer.rest_time_s = number_of(json, "rest", 0);
  if (!(answer.rest_time_s >= 0)) return wrong("answered a \"rest\" that is no time", line);
  if (request.interval_s == 0) return answer;
  for (const Json& row : json.value("path", Json::array())) {
    const std::vector<double> s = numbers(row, 4);
    const bool later = answer.path.empty() || (!s.empty() && s[0] >= answer.path.back().t_s);
    if (s.empty() || !later)
      return wrong("answered a path that is no list of [t, x, y, theta]", line);
    answer.path.push_back({s[0], {s[1], s[2], wrap_angle(s[3])}});
    RETURN_IF_ERROR(check_near(answer.path.back().X_SB));
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
  ASSIGN_OR_RETURN(const Json json, read_answer(line, request.id, "diverged", nullptr, &answer));
  if (answer.diverged) return answer;
  const Json given = poses_of(json, "poses", &answer);
  if (answer.diverged) return answer;
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
