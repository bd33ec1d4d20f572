// Typed reading of TOML with places: what a section asks for is what it knows, so everything else
// in the file is an unknown key.  The only header that includes toml++.
#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

// Everything that is wrong with a file, "file:line:column: sentence" each.
class TomlErrors {
 public:
  explicit TomlErrors(std::string file) : file_(std::move(file)) {}

  void add(const toml::source_position& place, const std::string& sentence);
  void add(const toml::node& node, const std::string& sentence) {
    add(node.source().begin, sentence);
  }
  // The value of `key` is of another type than `expected`.
  void wrong_type(std::string_view key, const toml::node& node, const std::string& expected);
  // Which of `names` the word is; none, and an error: it is no word, or an unknown one.
  std::optional<std::size_t> choice(std::string_view key, const toml::node& node,
                                    std::span<const std::string> names);
  bool empty() const { return found_.empty(); }
  // REQUIRES: !empty().  One line each, in the file's order.
  Error error() const;

 private:
  struct Found {
    toml::source_position place;
    std::string sentence;
  };
  std::string file_;
  std::vector<Found> found_;
};

// Debian's toml++ is built to throw; its exceptions end here.
Result<toml::table> parse_toml(std::string_view text, const std::string& file);

// toml++ sorts keys; the author's order means something.
std::vector<std::pair<std::string, const toml::node*>> in_file_order(const toml::table& table);

// A basic string as TOML has it, quoted, on one line.
std::string toml_string(std::string_view text);

inline constexpr double kUnbounded = std::numeric_limits<double>::infinity();

// One table of the file.  A reader asks for every key it knows; a value of the wrong type or out of
// range becomes an error and counts as absent.
class TomlSection {
 public:
  // `name` stands in the errors: "[evolution]", or empty at the top.
  TomlSection(const toml::table& table, std::string name, TomlErrors& errors)
      : table_(&table), name_(std::move(name)), errors_(&errors) {}

  const toml::table& table() const { return *table_; }
  const std::string& name() const { return name_; }
  TomlErrors& errors() { return *errors_; }

  // The node at `key`, or null.  The key counts as known from now on.  Where there is no key "a.b",
  // it is key "b" of section "a".
  const toml::node* find(std::string_view key);

  // Index of the value in `names`.
  std::optional<std::size_t> choice(std::string_view key, std::span<const std::string> names);
  // Lists; a single value counts as a list of one.
  std::optional<std::vector<std::string>> strings(std::string_view key);
  std::optional<std::vector<std::size_t>> choices(std::string_view key,
                                                  std::span<const std::string> names);
  std::optional<std::vector<double>> numbers(std::string_view key, double lower, double upper,
                                             std::string_view unit = "");
  // One row or more of so many finite numbers; the error of others is `expected`.
  std::optional<std::vector<std::vector<double>>> rows(std::string_view key, std::size_t columns,
                                                       const std::string& expected);
  std::optional<TomlSection> section(std::string_view key);
  // Those of [[key]], one at least; the error is `missing` where there is none.
  std::vector<TomlSection> sections(std::string_view key, const std::string& missing);
  // Lets `use` read the section when it is there, the whole of it, into `to`; whether it is.
  template <class Use, class... To>
  bool within(std::string_view key, const Use& use, To&... to) {
    std::optional<TomlSection> own = section(key);
    if (own) use(*own, to...);
    if (own) own->finish();
    return own.has_value();
  }

  // What is there, put where it belongs.
  void read(std::string_view key, double& to, double lower, double upper,
            std::string_view unit = "");
  void read(std::string_view key, std::optional<double>& to, double lower, double upper,
            std::string_view unit = "");
  void read(std::string_view key, unsigned& to, unsigned lower, unsigned upper);
  void read(std::string_view key, std::uint64_t& to, std::uint64_t lower);
  template <class Count>
  requires std::is_integral_v<Count>
  void read(std::string_view key, std::optional<Count>& to, std::type_identity_t<Count> lower,
            std::type_identity_t<Count> upper = std::numeric_limits<Count>::max()) {
    if (const auto value = count(key, lower, upper)) to = static_cast<Count>(*value);
  }
  // One of `names`, in the order of the enumeration.
  template <class Kind>
  requires std::is_enum_v<Kind>
  void read(std::string_view key, Kind& to, std::span<const std::string> names) {
    if (const auto index = choice(key, names)) to = static_cast<Kind>(*index);
  }
  void read(std::string_view key, bool& to) { read_typed(key, to, "true or false"); }
  void read(std::string_view key, std::string& to) { read_typed(key, to, "a string"); }
  void read(std::string_view key, std::vector<std::string>& to);

  // For FIELDS(): a member of that name.
  template <class T>
  void field(const char* key, T& to) {
    read(key, to);
  }

  // An error at the value of `key`, which must exist.
  void fail(std::string_view key, const std::string& sentence);

  // An error for every key that nobody asked for, with a suggestion.
  void finish() { finish(*table_, ""); }

 private:
  void finish(const toml::table& table, const std::string& prefix);
  std::optional<double> number_of(std::string_view key, const toml::node& node, double lower,
                                  double upper, std::string_view unit);
  std::optional<std::uint64_t> count(std::string_view key, std::uint64_t lower,
                                     std::uint64_t upper);
  // The key from the top.
  std::string path_of(std::string_view key) const;
  template <class T>
  void read_typed(std::string_view key, T& to, const char* expected) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const auto* value = node->as<T>();
    value == nullptr ? errors_->wrong_type(key, *node, expected) : void(to = value->get());
  }
  // What `one` makes of every element, or of the node alone; none: of one of them nothing.
  template <class T, class One>
  std::optional<std::vector<T>> list(std::string_view key, One one);

  const toml::table* table_;
  std::string name_;
  TomlErrors* errors_;
  std::vector<std::string> known_;
};

// Writes what a TomlSection reads, by the same calls: lines "key = value" of what is there.
class TomlLines {
 public:
  // Bounds and unit are the reader's.
  void read(const std::string& key, double value, double = 0, double = 0, std::string_view = "");
  void read(const std::string& key, const std::optional<double>& value, double = 0, double = 0,
            std::string_view = "");
  void read(const std::string& key, unsigned value, unsigned, unsigned);
  void read(const std::string& key, std::uint64_t value, std::uint64_t);
  void read(const std::string& key, bool value);
  void read(const std::string& key, const std::string& value);
  void read(const std::string& key, const std::vector<std::string>& values);
  template <class Kind>
  requires std::is_enum_v<Kind>
  void read(const std::string& key, Kind value, std::span<const std::string> names) {
    read(key, names[static_cast<std::size_t>(value)]);
  }
  // A section, even an empty one.
  template <class Use>
  void within(const std::string& name, const Use& use) {
    raw("\n[" + name + "]\n");
    use(*this);
  }
  void raw(const std::string& text) { text_ += text; }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

// A TOML float: an integer would lose the sign of -0.
std::string toml_number(double value);
// "[[0.5, 1.0], ...]", a list a row, `between` them.
std::string toml_rows(const std::vector<std::vector<double>>& rows,
                      std::string_view between = ", ");

}  // namespace gapfarm
