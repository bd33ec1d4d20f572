// JSON objects field by field.  A row is described once, as a function of a visitor and the row:
//
//   constexpr auto kCheck = [](auto& v, auto& row) { FIELDS(p, excess); LATER(note); };
//
// FieldWriter writes it, LenientFields reads it back.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/json/json.h"

// Members of `row` under their own names, one after another, for the visitor `v`.
#define FIELD_(name) v.field(#name, row.name);
#define LATER_(name) v.later(#name, row.name);
#define IF_ANY_(name) v.if_any(#name, row.name);
#define FIELDS(...) NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(FIELD_, __VA_ARGS__))
#define LATER(...) NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(LATER_, __VA_ARGS__))
#define IF_ANY(...) NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(IF_ANY_, __VA_ARGS__))

namespace gapfarm {

inline Json number_or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

class FieldWriter {
 public:
  template <class T>
  void field(const char* key, const T& value) {
    json_[key] = value;
  }
  void field(const char* key, const std::optional<double>& value) {
    json_[key] = number_or_null(value);
  }
  template <class T>
  void later(const char* key, const T& value) {
    field(key, value);
  }
  void if_any(const char* key, const std::string& text) {
    if (!text.empty()) field(key, text);
  }
  void if_any(const char* key, const std::optional<double>& number) {
    if (number) field(key, *number);
  }
  template <class T>
  void if_any(const char* key, const std::vector<T>& items) {
    if (!items.empty()) field(key, items);
  }
  // One of these names, or several, by their places.
  template <class Place>
  void name_of(const char* key, const Place& place, const std::vector<std::string>& names) {
    field(key, names[static_cast<std::size_t>(place)]);
  }
  void name_of(const char* key, const std::vector<std::size_t>& places,
               const std::vector<std::string>& names) {
    Json& list = json_[key] = Json::array();
    for (const std::size_t place : places) list.push_back(names[place]);
  }
  template <class Row, class Describe>
  void object(const char* key, const Row& row, const Describe& describe) {
    field(key, written(row, describe));
  }
  template <class Row, class Describe>
  void object_if_any(const char* key, const Row& row, const Describe& describe) {
    Json object = written(row, describe);
    if (!object.empty()) field(key, std::move(object));
  }
  template <class T, std::size_t n, class Name>
  void choice(const char* key, const T& value, const T (&)[n], const Name& name_of) {
    field(key, name_of(value));
  }
  template <class Row, class Key, class Describe>
  void by_key(const char* key, const std::vector<Row>& rows, Key Row::*key_of,
              const Describe& describe) {
    Json& object = json_[key] = Json::object();
    for (const Row& row : rows) object[row.*key_of] = written(row, describe);
  }
  template <class Row, class Key, class Value>
  void by_key(const char* key, const std::vector<Row>& rows, Key Row::*key_of,
              Value Row::*value_of) {
    Json& object = json_[key] = Json::object();
    for (const Row& row : rows) object[row.*key_of] = row.*value_of;
  }
  void by_key(const char* key, const std::vector<std::pair<std::string, double>>& numbers) {
    using Number = std::pair<std::string, double>;
    by_key(key, numbers, &Number::first, &Number::second);
  }

  template <class Row, class Describe>
  void list_if_any(const char* key, const std::vector<Row>& rows, const Describe& describe) {
    if (!rows.empty()) field(key, list(rows, describe));
  }

  template <class Row, class Describe>
  void list(const char* key, const std::vector<Row>& rows, const Describe& describe) {
    field(key, list(rows, describe));
  }

  template <class Row, class Describe>
  static Json written(const Row& row, const Describe& describe) {
    FieldWriter writer;
    describe(writer, row);
    return std::move(writer.json_);
  }
  template <class Row, class Describe>
  static Json list(const std::vector<Row>& rows, const Describe& describe) {
    Json list = Json::array();
    for (const Row& row : rows) list.push_back(written(row, describe));
    return list;
  }

 private:
  Json json_ = Json::object();
};

// Reads what a damaged or foreign file may hold: what is missing or of another kind is left as it
// is by default, and list items that are no objects are skipped.
class LenientFields {
 public:
  explicit LenientFields(const Json& json) : json_(json) {}

  template <class T>
  void field(const char* key, T& to) const {
    if (const auto found = json_.find(key); found != json_.end()) convert(*found, to);
  }
  template <class Row, class Describe>
  void list(const char* key, std::vector<Row>& rows, const Describe& describe) const {
    if (const auto found = json_.find(key); found != json_.end())
      rows = list<Row>(*found, describe);
  }

  template <class Row, class Describe>
  static Row read(const Json& json, const Describe& describe) {
    Row row;
    LenientFields fields(json);
    if (json.is_object()) describe(fields, row);
    return row;
  }
  template <class Row, class Describe>
  static std::vector<Row> list(const Json& json, const Describe& describe) {
    std::vector<Row> rows;
    if (!json.is_array()) return rows;
    for (const Json& item : json) {
      if (item.is_object()) rows.push_back(read<Row>(item, describe));
    }
    return rows;
  }

 private:
  using TwoTexts = std::pair<std::string, std::string>;

  template <class Number>
  requires std::is_arithmetic_v<Number>
  static void convert(const Json& json, Number& to) {
    if (json.is_number()) to = json.get<Number>();
  }
  static void convert(const Json& json, Json& to) { to = json; }
  static void convert(const Json& json, bool& to) {
    if (json.is_boolean()) to = json.get<bool>();
  }
  static void convert(const Json& json, std::optional<double>& to) {
    if (json.is_number()) to = json.get<double>();
  }
  static void convert(const Json& json, std::string& to) {
    if (json.is_string()) to = json.get<std::string>();
  }
  static void convert(const Json& json, TwoTexts& to) {
    if (!json.is_array() || json.size() != 2) return;
    convert(json[0], to.first);
    convert(json[1], to.second);
  }
  template <class Item>
  static void convert(const Json& json, std::vector<Item>& to) {
    if (!json.is_array()) return;
    for (const Json& item : json) convert(item, to.emplace_back());
  }

  const Json& json_;
};

}  // namespace gapfarm
