#include "common/config/toml_section.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"

namespace gapfarm {

void TomlErrors::add(const toml::source_position& place, const std::string& sentence) {
  found_.push_back({place, sentence});
}

Error TomlErrors::error() const {
  std::vector<Found> sorted = found_;
  std::ranges::stable_sort(sorted, {}, &Found::place);
  std::string text;
  for (const Found& found : sorted) {
    text += (text.empty() ? "" : "\n") + file_ + ":" + std::to_string(found.place.line) + ":" +
            std::to_string(found.place.column) + ": " + found.sentence;
  }
  return {text};
}

Result<toml::table> parse_toml(std::string_view text, const std::string& file) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    TomlErrors errors(file);
    errors.add(error.source().begin, std::string(error.description()));
    return errors.error();
  }
}

std::vector<std::pair<std::string, const toml::node*>> in_file_order(const toml::table& table) {
  std::vector<std::pair<std::string, const toml::node*>> nodes;
  for (const auto& [key, node] : table) nodes.emplace_back(key.str(), &node);
  std::stable_sort(nodes.begin(), nodes.end(), [](const auto& a, const auto& b) {
    return a.second->source().begin < b.second->source().begin;
  });
  return nodes;
}

std::string toml_string(std::string_view text) {
  constexpr char kHex[] = "0123456789abcdef";
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += {'\\', c};
    } else if (byte < 0x20 || byte == 0x7f) {
      quoted += std::string("\\u00") + kHex[byte >> 4] + kHex[byte & 15];
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

const toml::node* TomlSection::find(std::string_view key) {
  known_.emplace_back(key);
  if (const toml::node* node = table_->get(key)) return node;
  const toml::table* table = table_;
  for (std::size_t dot = key.find('.'); dot != key.npos && table != nullptr; dot = key.find('.')) {
    const toml::node* node = table->get(key.substr(0, dot));
    table = node == nullptr ? nullptr : node->as_table();
    key.remove_prefix(dot + 1);
  }
  return table == nullptr || table == table_ ? nullptr : table->get(key);
}

void TomlErrors::wrong_type(std::string_view key, const toml::node& node,
                            const std::string& expected) {
  // By toml::node_type; what follows these are dates and times.
  constexpr std::array kNames = {"nothing",    "a section", "an array", "a string",
                                 "an integer", "a number",  "a boolean"};
  const auto type = static_cast<std::size_t>(node.type());
  const std::string is = type < kNames.size() ? kNames[type] : "a date or time";
  add(node, std::string(key) + " is " + is + ", expected " + expected);
}

template <class T, class One>
std::optional<std::vector<T>> TomlSection::list(std::string_view key, One one) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  std::vector<T> all;
  for (std::size_t i = 0; i < (array == nullptr ? 1 : array->size()); ++i) {
    std::optional<T> value = one(array == nullptr ? *node : (*array)[i]);
    if (!value) return {};
    all.push_back(*std::move(value));
  }
  return all;
}

std::optional<double> TomlSection::number_of(std::string_view key, const toml::node& node,
                                             double lower, double upper, std::string_view unit) {
  if (!node.is_number()) {
    errors_->wrong_type(key, node, number_range(lower, upper, unit));
    return {};
  }
  // An integer of more digits than a double has is none to toml++.
  const double value = node.is_integer() ? static_cast<double>(node.as_integer()->get())
                                         : node.value<double>().value_or(NAN);
  if (std::isfinite(value) && value >= lower && value <= upper) return value;
  errors_->add(node, std::string(key) + " is " + format_double(value) + ", expected " +
                         number_range(lower, upper, unit));
  return {};
}

std::optional<std::size_t> TomlErrors::choice(std::string_view key, const toml::node& node,
                                              std::span<const std::string> names) {
  const auto* word = node.as_string();
  if (word == nullptr) {
    wrong_type(key, node, "one of \"" + joined(names, "\", \"") + "\"");
    return {};
  }
  const auto found = std::find(names.begin(), names.end(), word->get());
  if (found != names.end()) return static_cast<std::size_t>(found - names.begin());
  add(node, "unknown " + std::string(key) + " " + quoted_word(word->get()) +
                suggestion(word->get(), names));
  return {};
}

namespace {

// TOML integers end at 2^63 - 1; what is more is written as a string.
constexpr auto kMostToml = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());

std::optional<std::uint64_t> count_of_text(const toml::node& node) {
  const auto* text = node.as_string();
  if (text == nullptr) return {};
  const std::string& digits = text->get();
  std::uint64_t value = 0;
  const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool whole = code == std::errc{} && end == digits.data() + digits.size();
  return whole && value > kMostToml ? std::optional(value) : std::nullopt;
}

}  // namespace

std::optional<std::uint64_t> TomlSection::count(std::string_view key, std::uint64_t lower,
                                                std::uint64_t upper) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  const bool unbounded = upper == std::numeric_limits<std::uint64_t>::max();
  const std::string expected =
      unbounded ? "an integer of at least " + std::to_string(lower)
                : "an integer in [" + std::to_string(lower) + ", " + std::to_string(upper) + "]";
  const auto* value = node->as_integer();
  if (const auto beyond = count_of_text(*node); unbounded && beyond) return beyond;
  if (value == nullptr) {
    errors_->wrong_type(key, *node, expected);
    return {};
  }
  const std::int64_t found = value->get();
  if (found >= 0 && static_cast<std::uint64_t>(found) >= lower &&
      static_cast<std::uint64_t>(found) <= upper) {
    return static_cast<std::uint64_t>(found);
  }
  errors_->add(*node, std::string(key) + " is " + std::to_string(found) + ", expected " + expected);
  return {};
}

std::optional<std::size_t> TomlSection::choice(std::string_view key,
                                               std::span<const std::string> names) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  return errors_->choice(key, *node, names);
}

std::optional<std::vector<std::string>> TomlSection::strings(std::string_view key) {
  return list<std::string>(key, [&](const toml::node& element) {
    std::optional<std::string> value = element.value_exact<std::string>();
    if (!value) errors_->wrong_type(key, element, "strings");
    return value;
  });
}

std::optional<std::vector<std::size_t>> TomlSection::choices(std::string_view key,
                                                             std::span<const std::string> names) {
  std::vector<std::size_t> seen;
  return list<std::size_t>(key, [&](const toml::node& element) {
    std::optional<std::size_t> value = errors_->choice(key, element, names);
    if (value && contains(seen, *value)) {
      errors_->add(element, std::string(key) + " names " + quoted_word(names[*value]) + " twice");
      value.reset();
    }
    seen.push_back(value.value_or(0));
    return value;
  });
}

std::optional<std::vector<double>> TomlSection::numbers(std::string_view key, double lower,
                                                        double upper, std::string_view unit) {
  return list<double>(
      key, [&](const toml::node& element) { return number_of(key, element, lower, upper, unit); });
}

std::optional<std::vector<std::vector<double>>> TomlSection::rows(std::string_view key,
                                                                  std::size_t columns,
                                                                  const std::string& expected) {
  auto all = list<std::vector<double>>(key, [&](const toml::node& element) {
    std::optional<std::vector<double>> row(std::in_place);
    if (const toml::array* numbers = element.as_array()) {
      for (const toml::node& number : *numbers) {
        if (const auto value = number.value<double>(); value && std::isfinite(*value)) {
          row->push_back(*value);
        }
      }
      if (numbers->size() == columns && row->size() == columns) return row;
    }
    errors_->add(element, expected);
    row.reset();
    return row;
  });
  if (all && all->empty()) {
    fail(key, expected);
    all.reset();
  }
  return all;
}

std::string TomlSection::path_of(std::string_view key) const {
  const std::string_view above = std::string_view(name_).substr(0, name_.find_last_not_of(']') + 1);
  return name_.empty()
             ? std::string(key)
             : std::string(above.substr(above.find_first_not_of('['))) + "." + std::string(key);
}

std::optional<TomlSection> TomlSection::section(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  const std::string name = "[" + path_of(key) + "]";
  if (const toml::table* table = node->as_table()) return TomlSection(*table, name, *errors_);
  errors_->wrong_type(key, *node, "the section " + name);
  return {};
}

std::vector<TomlSection> TomlSection::sections(std::string_view key, const std::string& missing) {
  const toml::node* node = find(key);
  const toml::array* array = node == nullptr ? nullptr : node->as_array();
  if (array == nullptr || array->empty()) errors_->add(node == nullptr ? *table_ : *node, missing);
  std::vector<TomlSection> all;
  for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
    const std::string name = "[[" + path_of(key) + "]]";
    if (const toml::table* table = (*array)[i].as_table()) {
      all.emplace_back(*table, name, *errors_);
    } else {
      errors_->wrong_type(key, (*array)[i], "sections " + name);
    }
  }
  return all;
}

void TomlSection::read(std::string_view key, double& to, double lower, double upper,
                       std::string_view unit) {
  std::optional<double> found = to;
  read(key, found, lower, upper, unit);
  to = *found;
}

void TomlSection::read(std::string_view key, std::optional<double>& to, double lower, double upper,
                       std::string_view unit) {
  const toml::node* node = find(key);
  if (node == nullptr) return;
  if (const auto value = number_of(key, *node, lower, upper, unit)) to = value;
}

void TomlSection::read(std::string_view key, unsigned& to, unsigned lower, unsigned upper) {
  to = static_cast<unsigned>(count(key, lower, upper).value_or(to));
}

void TomlSection::read(std::string_view key, std::uint64_t& to, std::uint64_t lower) {
  to = count(key, lower, std::numeric_limits<std::uint64_t>::max()).value_or(to);
}

void TomlSection::read(std::string_view key, std::vector<std::string>& to) {
  if (auto values = strings(key)) to = std::move(*values);
}

void TomlSection::fail(std::string_view key, const std::string& sentence) {
  if (const toml::node* node = table_->get(key)) errors_->add(*node, sentence);
}

void TomlSection::finish(const toml::table& table, const std::string& prefix) {
  for (const auto& [key, node] : table) {
    const std::string word = prefix + std::string(key.str());
    if (contains(known_, word)) continue;
    const bool begun = std::ranges::any_of(
        known_, [&](const std::string& known) { return known.rfind(word + ".", 0) == 0; });
    if (begun && node.is_table()) {
      finish(*node.as_table(), word + ".");
      continue;
    }
    const std::string kind = node.is_table() ? "unknown section " : "unknown key ";
    const std::string where = name_.empty() ? "" : " in " + name_;
    errors_->add(key.source().begin, kind + quoted_word(word) + where + suggestion(word, known_));
  }
}

std::string toml_number(double value) {
  std::string text = format_double(value);
  if (text.find_first_of(".en") == text.npos) text += ".0";
  return text;
}

std::string toml_rows(const std::vector<std::vector<double>>& rows, std::string_view between) {
  const auto row = [](const auto& numbers) {
    return "[" + joined(numbers, ", ", toml_number) + "]";
  };
  return "[" + joined(rows, between, row) + "]";
}

void TomlLines::read(const std::string& key, double value, double, double, std::string_view) {
  raw(key + " = " + toml_number(value) + "\n");
}

void TomlLines::read(const std::string& key, const std::optional<double>& value, double, double,
                     std::string_view) {
  if (value) read(key, *value);
}

void TomlLines::read(const std::string& key, unsigned value, unsigned, unsigned) {
  read(key, std::uint64_t{value}, 0);
}

void TomlLines::read(const std::string& key, std::uint64_t value, std::uint64_t) {
  const std::string text = std::to_string(value);
  raw(key + " = " + (value > kMostToml ? toml_string(text) : text) + "\n");
}

void TomlLines::read(const std::string& key, bool value) {
  raw(key + (value ? " = true\n" : " = false\n"));
}

void TomlLines::read(const std::string& key, const std::string& value) {
  raw(key + " = " + toml_string(value) + "\n");
}

void TomlLines::read(const std::string& key, const std::vector<std::string>& values) {
  raw(key + " = [" + joined(values, ", ", toml_string) + "]\n");
}

}  // namespace gapfarm
