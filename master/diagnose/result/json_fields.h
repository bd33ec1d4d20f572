// Reads what a FieldWriter wrote (common/json/fields.h), with an error that names the place.
#pragma once

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/json/fields.h"
#include "common/json/json.h"

namespace gapfarm {

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
    for_each(key, [&](const auto& item, const std::string&, const std::string& item_key) {
      convert((std::string(key) + "." + item_key).c_str(), item,
              numbers.emplace_back(item_key, 0).second);
    });
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
  void convert(const char* key, const Json& json, std::uint64_t& field) {
    if (!json.is_number_unsigned()) return complain(key, json, "a count");
    field = json.get<std::uint64_t>();
  }
  void convert(const char* key, const Json& json, std::string& field) {
    if (!json.is_string()) return complain(key, json, "a text");
    field = json.get<std::string>();
  }
  void convert(const char* key, const Json& json, std::vector<std::string>& field) {
    if (!json.is_array()) return complain(key, json, "a list of texts");
    field.clear();
    for (const Json& item : json) convert(key, item, field.emplace_back());
  }
  void fail(const std::string& sentence) {
    if (error_.empty()) error_ = "diagnosis.json: " + sentence;
  }

  const Json& json_;
  std::string path_;
  std::string& error_;
};

}  // namespace gapfarm
