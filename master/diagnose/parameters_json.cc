#include <nlohmann/json.hpp>

#include "master/diagnose/diagnosis_json.h"
#include "master/diagnose/json_fields.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

const char* bound_name(BoundHit hit) { return hit == BoundHit::kLower ? "lower" : "upper"; }

Json path_json(const std::vector<PathSample>& path) {
  Json list = Json::array();
  for (const PathSample& s : path) list.push_back({s.t_s, s.pose.x, s.pose.y, s.pose.theta});
  return list;
}

bool read_path(const Json& json, std::vector<PathSample>* path) {
  if (!json.is_array()) return false;
  for (const Json& sample : json) {
    if (!sample.is_array() || sample.size() != 4) return false;
    for (const Json& v : sample) {
      if (!v.is_number()) return false;
    }
    path->push_back({sample[0].get<double>(),
                     {sample[1].get<double>(), sample[2].get<double>(), sample[3].get<double>()}});
  }
  return true;
}

}  // namespace

Json parameters_json(const std::vector<ParameterRow>& rows) {
  Json list = Json::array();
  for (const ParameterRow& row : rows) {
    Json json = {{"key", row.key}, {"unit", row.unit}};
    if (!row.effect.empty()) json["effect"] = row.effect;
    json["summary"] = row.summary;
    if (row.before) json["tuned"] = *row.before;
    json["final"] = row.after;
    if (row.lo && row.hi) json["lo"] = *row.lo, json["hi"] = *row.hi;
    json["lower"] = row.lower;
    json["upper"] = row.upper;
    if (!row.choice.empty()) json["choice"] = row.choice;
    if (const BoundHit hit = bound_hit(row); hit != BoundHit::kNone) {
      json["at_bound"] = bound_name(hit);
    }
    if (!row.note.empty()) json["note"] = row.note;
    list.push_back(std::move(json));
  }
  return list;
}

void read_parameters(Fields& root, std::vector<ParameterRow>* rows) {
  root.for_each("parameters", [&](const Json& item, const std::string& path, const auto&) {
    ParameterRow& row = rows->emplace_back();
    Fields fields(item, path, root.error());
    fields.read("key", row.key);
    fields.read("unit", row.unit);
    fields.read_if_there("effect", row.effect);
    fields.read_if_there("summary", row.summary);
    fields.read_if_there("tuned", row.before);
    fields.read("final", row.after);
    fields.read_if_there("lo", row.lo);
    fields.read_if_there("hi", row.hi);
    fields.read("lower", row.lower);
    fields.read("upper", row.upper);
    fields.read_if_there("choice", row.choice);
    fields.read_if_there("note", row.note);
  });
}

Json correlations_json(const std::vector<ParameterCorrelation>& correlations) {
  Json list = Json::array();
  for (const ParameterCorrelation& c : correlations) {
    list.push_back({{"a", c.a}, {"b", c.b}, {"r", c.r}});
  }
  return list;
}

void read_correlations(Fields& root, std::vector<ParameterCorrelation>* correlations) {
  root.for_each("correlations", [&](const Json& item, const std::string& path, const auto&) {
    ParameterCorrelation& c = correlations->emplace_back();
    Fields fields(item, path, root.error());
    fields.read("a", c.a);
    fields.read("b", c.b);
    fields.read("r", c.r);
  });
}

Json drives_json(const std::vector<ShownDrive>& drives) {
  Json list = Json::array();
  for (const ShownDrive& drive : drives) {
    Json json = {{"trial", drive.trial}, {"why", drive.why}};
    if (!drive.measured.empty()) json["measured"] = path_json(drive.measured);
    if (!drive.tuned.empty()) json["tuned"] = path_json(drive.tuned);
    if (!drive.final_.empty()) json["final"] = path_json(drive.final_);
    list.push_back(std::move(json));
  }
  return list;
}

Status read_drives(const Json& json, std::vector<ShownDrive>* drives) {
  const Error damaged{
      "diagnosis.json: drives: expected a list of {trial, why, paths}; was this "
      "written by gapfarm diagnose?"};
  if (!json.is_array()) return damaged;
  for (const Json& item : json) {
    if (!item.is_object() || !item.contains("trial") || !item["trial"].is_number_unsigned() ||
        !item.contains("why") || !item["why"].is_string()) {
      return damaged;
    }
    ShownDrive& drive = drives->emplace_back();
    drive.trial = item["trial"].get<std::size_t>();
    drive.why = item["why"].get<std::string>();
    for (const auto& [key, path] : {std::pair{"measured", &drive.measured},
                                    {"tuned", &drive.tuned},
                                    {"final", &drive.final_}}) {
      if (item.contains(key) && !read_path(item[key], path)) return damaged;
    }
  }
  return {};
}

}  // namespace gapfarm
