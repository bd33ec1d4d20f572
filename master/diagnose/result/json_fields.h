// Reads what a FieldWriter wrote (common/json/fields.h), with an error that names the place.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <concepts>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/json/fields.h"
#include "common/json/json.h"
#include "common/json/matrix.h"
#include "common/trials/trial.h"

namespace gapfarm {

inline void to_json(Json& json, const PathSample& s) {
  json = {s.t_s, s.pose.x, s.pose.y, s.pose.theta};
}

// Reads fields of one object; the first thing that does not fit is kept as a sentence.
class Fields {
 public:
  Fields(const Json& json, std::string path, std::string& error)
      : json_(json), path_(std::move(path)), error_(error) {
    if (!json.is_object()) complain("", json, "an object");
  }

  template <class T>
  void field(const char* key, T& field) {
    if (!json_.is_object() || !json_.contains(key)) {
      return fail(name(key) + " is missing; was this written by gapfarm diagnose?");
    }
    convert(key, json_[key], field);
  }

  // A value that stands elsewhere, in a table's row.
  template <class T>
  void cell(const std::string& column, const Json& json, T& field) {
    convert(column.c_str(), json, field);
  }

  // A field that an earlier version, or another program, may omit.
  template <class T>
  void later(const char* key, T& field) {
    if (json_.is_object() && json_.contains(key)) convert(key, json_[key], field);
  }
  // One that is written only where there is something in it.
  template <class T>
  void if_any(const char* key, T& field) {
    later(key, field);
  }
  // A value that is reported by one of these names.
  template <class T, std::size_t n, class Name>
  void choice(const char* key, T& field, const T (&values)[n], const Name& name_of) {
    std::string found;
    later(key, found);
    for (const T& value : values) {
      if (found == name_of(value)) field = value;
    }
  }
  // Rows in an object, each under its own key, which `key_of` is.
  template <class Row, class Key, class Describe>
  void by_key(const char* key, std::vector<Row>& rows, Key Row::*key_of, const Describe& describe) {
    for_each(key, [&](const auto& item, const std::string& path, const std::string& item_key) {
      Row& row = rows.emplace_back();
      row.*key_of = item_key;
      Fields fields(item, path, error_);
      describe(fields, row);
    });
  }
  void by_key(const char* key, std::vector<std::pair<std::string, double>>& numbers) {
    using Number = std::pair<std::string, double>;
    by_key(key, numbers, &Number::first, &Number::second);
  }
  template <class Row, class Describe>
  void list(const char* key, std::vector<Row>& rows, const Describe& describe) {
    for_each(key, [&](const auto& item, const std::string& path, const std::string&) {
      Fields fields(item, path, error_);
      describe(fields, rows.emplace_back());
    });
  }

  template <class Row, class Describe>
  void list_if_any(const char* key, std::vector<Row>& rows, const Describe& describe) {
    list(key, rows, describe);
  }

  // Numbers, texts or lists in an object, each under its own key.
  template <class Row, class Key, class Value>
  void by_key(const char* key, std::vector<Row>& rows, Key Row::*key_of, Value Row::*value_of) {
    for_each(key, [&](const auto& item, const std::string&, const std::string& item_key) {
      Row& row = rows.emplace_back();
      row.*key_of = item_key;
      convert((std::string(key) + "." + item_key).c_str(), item, row.*value_of);
    });
  }
  // One of these names, or several, by their places.
  template <class Place>
  void name_of(const char* key, Place& field, const std::vector<std::string>& names) {
    std::string found;
    this->field(key, found);
    field = place_of(key, found, names, field);
  }
  void name_of(const char* key, std::vector<std::size_t>& field,
               const std::vector<std::string>& names) {
    std::vector<std::string> found;
    this->field(key, found);
    for (const std::string& name : found) {
      field.push_back(place_of(key, name, names, std::size_t{0}));
    }
  }
  template <class Row, class Describe>
  void object(const char* key, Row& row, const Describe& describe) {
    if (!json_.is_object() || !json_.contains(key)) return fail(name(key) + " is missing");
    object_if_any(key, row, describe);
  }
  template <class Row, class Describe>
  void object_if_any(const char* key, Row& row, const Describe& describe) {
    if (!json_.is_object() || !json_.contains(key)) return;
    Fields fields(json_[key], name(key), error_);
    if (error_.empty()) describe(fields, row);
  }

  // Calls each(item, path) for the list under `key`, when there is one.
  template <class Each>
  void for_each(const char* key, const Each& each) {
    if (!json_.is_object() || !json_.contains(key)) return;
    const Json& list = json_[key];
    if (!list.is_array() && !list.is_object()) return complain(key, list, "a list");
    std::size_t index = 0;
    for (const auto& [item_key, item] : list.items()) {
      const std::string place =
          list.is_array() ? "[" + std::to_string(index++) + "]" : "." + item_key;
      each(item, name(key) + place, item_key);
    }
  }

  std::string name(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  void complain(const std::string& key, const Json& found, const char* expected) {
    fail(name(key) + " is " + json_text(found).substr(0, 60) + ", expected " + expected);
  }
  std::string& error() { return error_; }

 private:
  void convert(const char* key, const Json& json, double& field) {
    if (json.is_null()) {
      field = std::numeric_limits<double>::quiet_NaN();
    } else if (json.is_number()) {
      field = json.get<double>();
    } else {
      complain(key, json, "a number");
    }
  }
  void convert(const char* key, const Json& json, std::optional<double>& field) {
    convert(key, json, field.emplace());
  }
  template <std::integral Count>
  void convert(const char* key, const Json& json, Count& field) {
    if constexpr (std::same_as<Count, bool>) {
      if (!json.is_boolean()) return complain(key, json, "true or false");
    } else if (std::unsigned_integral<Count> ? !json.is_number_unsigned()
                                             : !json.is_number_integer()) {
      return complain(key, json, "a count");
    }
    field = json.get<Count>();
  }
  void convert(const char* key, const Json& json, std::string& field) {
    if (!json.is_string()) return complain(key, json, "a text");
    field = json.get<std::string>();
  }
  template <class T>
  void convert(const char* key, const Json& json, std::vector<T>& field) {
    if (!json.is_array()) return complain(key, json, "a list");
    field.clear();
    for (const Json& item : json) convert(key, item, field.emplace_back());
  }
  void convert(const char* key, const Json& json, PathSample& sample) {
    std::vector<double> values;
    convert(key, json, values);
    if (values.size() != 4) return complain(key, json, "[t s, x m, y m, heading rad]");
    sample = {values[0], {values[1], values[2], values[3]}};
  }
  void convert(const char* key, const Json& json, Eigen::MatrixXd& field) {
    std::vector<std::vector<double>> rows;
    convert(key, json, rows);
    if (!rows.empty()) field.resize(rows.size(), rows.front().size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (rows[k].size() != rows.front().size()) return complain(key, json, "rows of one length");
      field.row(k) = Eigen::Map<const Eigen::RowVectorXd>(rows[k].data(), field.cols());
    }
  }
  template <class Place>
  Place place_of(const char* key, const std::string& found, const std::vector<std::string>& names,
                 Place otherwise) {
    const auto at = std::find(names.begin(), names.end(), found);
    if (at != names.end()) return static_cast<Place>(at - names.begin());
    complain(key, found, "one of its names");
    return otherwise;
  }
  void fail(const std::string& sentence) {
    if (error_.empty()) error_ = "diagnosis.json: " + sentence;
  }

  const Json& json_;
  std::string path_;
  std::string& error_;
};

}  // namespace gapfarm
