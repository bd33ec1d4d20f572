// JSON objects field by field.  A row is described once, as a function of a visitor and the row:
//
//   constexpr auto kCheck = [](auto& v, auto& row) { FIELDS(p, excess); LATER(note); };
//
// FieldWriter writes it, FieldReader reads it back.
#pragma once

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

// How a value of a type of its own is read: from a value of type Written, by
//   const char* set(const Written&, T&),
// which returns what it expected, or null when the value fits.
template <class T>
struct FieldForm;

template <>
struct FieldForm<std::pair<std::string, std::string>> {
  using Written = std::vector<std::string>;
  static const char* set(const Written& texts, std::pair<std::string, std::string>& to) {
    if (texts.size() != 2) return "two texts";
    to = {texts[0], texts[1]};
    return nullptr;
  }
};

// Reads one object's fields.  The first thing that does not fit is kept in `error` as a sentence
// that names its place, unless `error` holds one already.  Without `error`, for what a damaged or
// foreign file may hold, what is missing or of another kind is left as it is, and list items that
// are no objects are skipped.
class FieldReader {
 public:
  explicit FieldReader(const Json& json, std::string path = {}, std::string* error = nullptr)
      : json_(json), path_(std::move(path)), error_(error) {
    if (!json.is_object()) complain("", json, "an object");
  }

  template <class T>
  void field(const std::string& key, T& field) {
    if (!json_.contains(key)) return fail(name(key) + " is missing");
    later(key, field);
  }
  // One that an earlier version, or another program, may omit.
  template <class T>
  void later(const std::string& key, T& field) {
    if (const auto found = json_.find(key); found != json_.end()) convert(key, *found, field);
  }
  // One that is written only where there is something in it.
  template <class T>
  void if_any(const char* key, T& field) {
    later(key, field);
  }
  // A value that stands elsewhere, in a table's row.
  template <class T>
  void cell(const std::string& column, const Json& json, T& field) {
    convert(column, json, field);
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
        describe(item, path, row, what);
      }
    });
  }
  void by_key(const char* key, std::vector<std::pair<std::string, double>>& numbers) {
    using Number = std::pair<std::string, double>;
    by_key(key, numbers, &Number::first, &Number::second);
  }
  template <class Row, class Describe>
  void list(const char* key, std::vector<Row>& rows, const Describe& what) {
    for_each(key, [&](const Json& item, const std::string& path, const std::string&) {
      if (item.is_object() || error_) describe(item, path, rows.emplace_back(), what);
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
  void object_if_any(const char* key, Row& row, const Describe& what) {
    if (json_.contains(key)) describe(json_[key], name(key), row, what);
  }

  void complain(const std::string& key, const Json& found, const char* expected) {
    fail(name(key) + " is " + json_text(found).substr(0, 60) + ", expected " + expected);
  }

  // Whatever fits of one object, or of a list of them.
  template <class Row, class Describe>
  static Row read(const Json& json, const Describe& describe) {
    Row row;
    FieldReader fields(json);
    describe(fields, row);
    return row;
  }
  template <class Row, class Describe>
  static std::vector<Row> rows(const Json& json, const Describe& describe) {
    std::vector<Row> rows;
    const Json around = {{"", json}};
    FieldReader(around).list("", rows, describe);
    return rows;
  }

 private:
  std::string name(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  template <class Row, class Describe>
  void describe(const Json& json, const std::string& path, Row& row, const Describe& what) {
    FieldReader fields(json, path, error_);
    what(fields, row);
  }
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
    if constexpr (requires { typename FieldForm<T>::Written; }) {
      typename FieldForm<T>::Written written;
      convert(key, json, written);
      if (const char* expected = FieldForm<T>::set(written, field)) complain(key, json, expected);
    } else if constexpr (!std::same_as<T, Json>) {
      if constexpr (std::same_as<T, std::string>) {
        if (!json.is_string()) return complain(key, json, "a text");
      } else if constexpr (std::same_as<T, bool>) {
        if (!json.is_boolean()) return complain(key, json, "true or false");
      } else if constexpr (std::floating_point<T>) {
        if (error_ && json.is_null()) return void(field = std::numeric_limits<T>::quiet_NaN());
        if (!json.is_number()) return complain(key, json, "a number");
      } else if (!error_ ? !json.is_number()
                         : !(std::unsigned_integral<T> ? json.is_number_unsigned()
                                                       : json.is_number_integer())) {
        return complain(key, json, "a count");
      }
      field = json.get<T>();
    } else {
      field = json;
    }
  }
  void convert(const std::string& key, const Json& json, std::optional<double>& field) {
    if (error_ || json.is_number()) convert(key, json, field.emplace());
  }
  template <class T>
  void convert(const std::string& key, const Json& json, std::vector<T>& field) {
    if (!json.is_array()) return complain(key, json, "a list");
    field.clear();
    for (const Json& item : json) convert(key, item, field.emplace_back());
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
    if (error_ && error_->empty()) *error_ = sentence;
  }

  const Json& json_;
  std::string path_;
  std::string* error_;  // may be null
};

}  // namespace gapfarm
