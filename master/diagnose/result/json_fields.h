// Reads what a FieldWriter wrote (common/json/fields.h), with an error that names the place.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <concepts>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/base/ranges.h"
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
  void field(const std::string& key, T& field) {
    if (!json_.contains(key)) {
      return fail(name(key) + " is missing; was this written by gapfarm diagnose?");
    }
    convert(key, json_[key], field);
  }

  // A value that stands elsewhere, in a table's row.
  template <class T>
  void cell(const std::string& column, const Json& json, T& field) {
    convert(column, json, field);
  }

  // A field that an earlier version, or another program, may omit.
  template <class T>
  void later(const char* key, T& field) {
    if (json_.contains(key)) convert(key, json_[key], field);
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
  // Rows in an object, each under its own key, which `key_of` is: described, or values of one
  // member.
  template <class Row, class Key, class What>
  void by_key(const char* key, std::vector<Row>& rows, Key Row::*key_of, const What& what) {
    for_each(key, [&](const Json& item, const std::string& path, const std::string& item_key) {
      Row& row = rows.emplace_back();
      row.*key_of = item_key;
      if constexpr (std::is_member_object_pointer_v<What>) {
        convert(std::string(key) + "." + item_key, item, row.*what);
      } else {
        Fields fields(item, path, error_);
        what(fields, row);
      }
    });
  }
  void by_key(const char* key, std::vector<std::pair<std::string, double>>& numbers) {
    using Number = std::pair<std::string, double>;
    by_key(key, numbers, &Number::first, &Number::second);
  }
  template <class Row, class Describe>
  void list(const char* key, std::vector<Row>& rows, const Describe& describe) {
    for_each(key, [&](const Json& item, const std::string& path, const std::string&) {
      Fields fields(item, path, error_);
      describe(fields, rows.emplace_back());
    });
  }
  template <class Row, class Describe>
  void list_if_any(const char* key, std::vector<Row>& rows, const Describe& describe) {
    list(key, rows, describe);
  }
  // One of these names, or several, by their places.
  template <class Place>
  void name_of(const char* key, Place& field, const std::vector<std::string>& names) {
    std::string found;
    this->field(key, found);
    field = static_cast<Place>(place_of(key, found, names));
  }
  void name_of(const char* key, std::vector<std::size_t>& field,
               const std::vector<std::string>& names) {
    std::vector<std::string> found;
    this->field(key, found);
    field = mapped(found, [&](const std::string& name) { return place_of(key, name, names); });
  }
  template <class Row, class Describe>
  void object(const char* key, Row& row, const Describe& describe) {
    if (!json_.contains(key)) return fail(name(key) + " is missing");
    object_if_any(key, row, describe);
  }
  template <class Row, class Describe>
  void object_if_any(const char* key, Row& row, const Describe& describe) {
    if (!json_.contains(key)) return;
    Fields fields(json_[key], name(key), error_);
    if (error_.empty()) describe(fields, row);
  }

  void complain(const std::string& key, const Json& found, const char* expected) {
    fail(name(key) + " is " + json_text(found).substr(0, 60) + ", expected " + expected);
  }

 private:
  std::string name(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  // Calls each(item, path, key) for what stands under `key`, when there is something.
  template <class Each>
  void for_each(const char* key, const Each& each) {
    if (!json_.contains(key)) return;
    const Json& list = json_[key];
    if (!list.is_array() && !list.is_object()) return complain(key, list, "a list");
    for (const auto& [item_key, item] : list.items()) {
      each(item, name(key) + (list.is_array() ? "[" + item_key + "]" : "." + item_key), item_key);
    }
  }

  // Numbers, counts, texts, and what is so or is not.
  template <class T>
  void convert(const std::string& key, const Json& json, T& field) {
    if constexpr (std::same_as<T, double>) {
      if (json.is_null()) return void(field = std::numeric_limits<double>::quiet_NaN());
      if (!json.is_number()) return complain(key, json, "a number");
    } else if constexpr (std::same_as<T, std::string>) {
      if (!json.is_string()) return complain(key, json, "a text");
    } else if constexpr (std::same_as<T, bool>) {
      if (!json.is_boolean()) return complain(key, json, "true or false");
    } else if (std::unsigned_integral<T> ? !json.is_number_unsigned() : !json.is_number_integer()) {
      return complain(key, json, "a count");
    }
    field = json.get<T>();
  }
  void convert(const std::string& key, const Json& json, std::optional<double>& field) {
    convert(key, json, field.emplace());
  }
  template <class T>
  void convert(const std::string& key, const Json& json, std::vector<T>& field) {
    if (!json.is_array()) return complain(key, json, "a list");
    field.clear();
    for (const Json& item : json) convert(key, item, field.emplace_back());
  }
  void convert(const std::string& key, const Json& json, PathSample& sample) {
    std::vector<double> values;
    convert(key, json, values);
    if (values.size() != 4) return complain(key, json, "[t s, x m, y m, heading rad]");
    sample = {values[0], {values[1], values[2], values[3]}};
  }
  void convert(const std::string& key, const Json& json, Eigen::MatrixXd& field) {
    std::vector<std::vector<double>> rows;
    convert(key, json, rows);
    if (!rows.empty()) field.resize(rows.size(), rows.front().size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (rows[k].size() != rows.front().size()) return complain(key, json, "rows of one length");
      field.row(k) = Eigen::Map<const Eigen::RowVectorXd>(rows[k].data(), field.cols());
    }
  }
  // 0 where it is none of them.
  std::size_t place_of(const char* key, const std::string& found,
                       const std::vector<std::string>& names) {
    const auto at = std::ranges::find(names, found);
    if (at != names.end()) return at - names.begin();
    complain(key, found, "one of its names");
    return 0;
  }
  void fail(const std::string& sentence) {
    if (error_.empty()) error_ = "diagnosis.json: " + sentence;
  }

  const Json& json_;
  std::string path_;
  std::string& error_;
};

}  // namespace gapfarm
