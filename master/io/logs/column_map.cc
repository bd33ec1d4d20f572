#include "master/io/logs/column_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "common/base/constants.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/config/toml_section.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

enum class UnitKind { kTime, kLength, kAngle, kSpeed, kTurning, kShare };

struct Unit {
  const char* name;
  double factor;
  UnitKind kind;
};

constexpr Unit kUnits[] = {{"s", 1, UnitKind::kTime},
                           {"ms", 1e-3, UnitKind::kTime},
                           {"us", 1e-6, UnitKind::kTime},
                           {"ns", 1e-9, UnitKind::kTime},
                           {"m", 1, UnitKind::kLength},
                           {"cm", 1e-2, UnitKind::kLength},
                           {"mm", 1e-3, UnitKind::kLength},
                           {"rad", 1, UnitKind::kAngle},
                           {"mrad", 1e-3, UnitKind::kAngle},
                           {"deg", kDegree, UnitKind::kAngle},
                           {"m/s", 1, UnitKind::kSpeed},
                           {"cm/s", 1e-2, UnitKind::kSpeed},
                           {"mm/s", 1e-3, UnitKind::kSpeed},
                           {"km/h", 1 / 3.6, UnitKind::kSpeed},
                           {"rad/s", 1, UnitKind::kTurning},
                           {"deg/s", kDegree, UnitKind::kTurning},
                           {"rpm", std::numbers::pi / 30, UnitKind::kTurning},
                           {"%", 1e-2, UnitKind::kShare},
                           {"1", 1, UnitKind::kShare}};

// Of a column of such a table; none: a channel may be anything.
std::optional<UnitKind> kind_of(std::string_view table, const MappedColumn& c) {
  if (c.role == "t" || c.role == "dt") return UnitKind::kTime;
  const bool poses = table == "poses", counted = c.rate || c.increment;
  if (poses && (c.role == "x" || c.role == "y" || c.role == "z")) return UnitKind::kLength;
  if (poses && c.role == "theta") return UnitKind::kAngle;
  if (!poses && (c.role == "v" || c.role == "vy")) {
    return counted ? UnitKind::kLength : UnitKind::kSpeed;
  }
  if (!poses && (c.role == "omega" || c.role == "yaw_rate")) {
    return counted ? UnitKind::kAngle : UnitKind::kTurning;
  }
  return {};
}

std::string units_of(UnitKind kind) {
  return joined(filtered(kUnits, [&](const Unit& unit) { return unit.kind == kind; }), ", ",
                &Unit::name);
}

struct ColumnNumber {
  const char* key;
  double MappedColumn::*value;
  double lower, upper;
};

constexpr ColumnNumber kNumbers[] = {{"scale", &MappedColumn::scale, 0, 1e12},
                                     {"offset", &MappedColumn::offset, -1e12, 1e12},
                                     {"sign", &MappedColumn::sign, -1, 1},
                                     {"gear", &MappedColumn::gear, 1e-6, 1e6},
                                     {"wraps", &MappedColumn::wraps, 0, 1e12}};

// What else a row may say, by a column.
constexpr std::pair<const char*, std::string TableMap::*> kRowColumns[] = {
    {"session", &TableMap::session}, {"run", &TableMap::run}, {"keep", &TableMap::keep}};

// Bags may hold any bytes: what is not UTF-8, which TOML has to be, becomes '_'.
std::string quoted(const std::string& text) {
  std::string word = toml_string(text);
  if (parse_toml("k = " + word, "").ok()) return word;
  std::ranges::replace_if(
      word, [](char c) { return static_cast<unsigned char>(c) >= 0x80; }, '_');
  return word;
}

void write_table(const char* name, const TableMap& table, std::string& out) {
  if (table.columns.empty()) return;
  out += std::string(out.empty() ? "" : "\n") + "[" + name + "]\n";
  if (!table.source.empty()) out += "source = " + quoted(table.source) + "\n";
  for (const auto& [key, column] : kRowColumns) {
    if (!(table.*column).empty()) out += std::string(key) + " = " + quoted(table.*column) + "\n";
  }
  if (table.up != "z") out += "up = " + quoted(table.up) + "\n";
  if (table.wheel_radius_m > 0) {
    out += "wheel_radius = " + format_double(table.wheel_radius_m) + "\n";
  }
  if (table.increments) out += "increments = true\n";
  for (const MappedColumn& c : table.columns) {
    const bool plain =
        c.role.find_first_not_of(
            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") == c.role.npos;
    const std::string role = table.intervals && c.role == "t" ? "dt" : c.role;
    if (c.scale == 0) {
      out += role + " = " + format_double(c.offset) + "\n";
      continue;
    }
    out += (plain ? role : quoted(role)) + " = { column = " + quoted(c.column) +
           (c.unit.empty() ? "" : ", unit = " + quoted(c.unit));
    for (const ColumnNumber& number : kNumbers) {
      if (c.*number.value == MappedColumn{}.*number.value) continue;
      out += std::string(", ") + number.key + " = " + format_double(c.*number.value);
    }
    out += c.rate ? ", rate = true }\n" : c.increment ? ", increment = true }\n" : " }\n";
  }
}

class MapReader {
 public:
  explicit MapReader(TomlErrors& errors) : errors_(errors) {}

  void read(TomlSection& root, const char* name, TableMap& map) {
    auto section = root.section(name);
    if (!section) return;
    section->read("source", map.source);
    for (const auto& [key, column] : kRowColumns) section->read(key, map.*column);
    static const std::vector<std::string> kUp = {"z", "y"};
    if (const auto up = section->choice("up", kUp)) map.up = kUp[*up];
    section->read("wheel_radius", map.wheel_radius_m, 1e-4, 100, "m");
    section->read("increments", map.increments);
    std::string covariance;
    section->read("covariance", covariance);
    static const std::set<std::string_view> kOptions = {
        "source", "session", "run", "keep", "up", "wheel_radius", "increments", "covariance"};
    for (const auto& [key, node] : section->table()) {
      const std::string role(key.str());
      if (kOptions.count(role) != 0) continue;
      read_column(*section, name, role, node, map);
    }
    // TOML's tables are sorted by name; channels keep the file's order.
    std::ranges::sort(places_);
    map.columns = mapped(places_, [&](auto& place) { return map.columns[std::get<2>(place)]; });
    places_.clear();
    // Of six by six numbers about x, y, z and turns about these, as ROS has them.
    static constexpr int kPlanar[] = {0, 1, 5, 7, 11, 35};
    for (std::size_t k = 0; k < kCovarianceColumns.size() && !covariance.empty(); ++k) {
      map.columns.push_back(
          {kCovarianceColumns[k], covariance + "[" + std::to_string(kPlanar[k]) + "]", ""});
    }
    check_times(*section, map);
    check_noise(*section, map);
  }

 private:
  void refuse(const TomlSection& section, const std::string& text) {
    errors_.add(section.table().source().begin, section.name() + text);
  }

  // Other rows have channels of any name.
  void check_pose_role(const toml::node& node, const std::string& role) {
    static const std::vector<std::string> kRoles = [] {
      std::vector<std::string> all = {"t", "dt", "x", "y", "z", "theta", "qx", "qy", "qz", "qw"};
      for (const auto* noise : {&kCovarianceColumns, &kDeviationColumns}) {
        all.insert(all.end(), noise->begin(), noise->end());
      }
      return all;
    }();
    if (contains(kRoles, role)) return;
    errors_.add(node,
                "unknown key " + quoted_word(role) + " in [poses]" + suggestion(role, kRoles));
  }

  void check_times(const TomlSection& section, TableMap& map) {
    for (MappedColumn& c : map.columns) {
      if (c.role != "dt" || map.find("t") != nullptr) continue;
      map.intervals = true;
      c.role = "t";
      // Of another column nothing, and the same in every row.
      const bool constant = c.column.empty() && c.scale == 0;
      if (constant)
        c.column = map.columns[&c == &map.columns.front() ? map.columns.size() - 1 : 0].column;
    }
    if (map.find("t") == nullptr) {
      refuse(section,
             " has no t, expected the column of the times (or dt, of the seconds since the row "
             "before; dt = 0.2 where every row lasts so long)");
    }
    if (map.increments && !map.keep.empty()) {
      refuse(section,
             " has increments and keep, expected one of them: without its row an increment leads "
             "nowhere");
    }
  }

  void check_noise(const TomlSection& section, const TableMap& map) {
    const auto is_missing = [&](const std::string& role) { return map.find(role) == nullptr; };
    const std::string missing = joined(filtered(map.noise(), is_missing));
    if (!missing.empty()) {
      refuse(section, " has no " + missing + ", expected all of " + map.noise().front() + " to " +
                          map.noise().back() + " or none");
    }
    if (!map.noise().empty() && !map.increments) {
      refuse(
          section,
          " has covariances of poses, expected increments = true: those of poses in the world are "
          "read off their scatter");
    }
  }

  void read_column(TomlSection& section, const char* name, const std::string& role,
                   const toml::node& node, TableMap& map) {
    MappedColumn column{role, "", ""};
    if (name == std::string_view("poses")) check_pose_role(node, role);
    if (const auto* word = node.as_string()) {
      section.find(role);
      column.column = word->get();
    } else if (node.is_number() && role == "dt") {
      column.unit = "s";
      column.scale = 0;
      section.read(role, column.offset, 1e-6, 1e6, "s");
    } else if (auto inner = section.section(role)) {
      inner->read("column", column.column);
      inner->read("unit", column.unit);
      for (const ColumnNumber& number : kNumbers) {
        inner->read(number.key, column.*number.value, number.lower, number.upper);
      }
      inner->read("rate", column.rate);
      inner->read("increment", column.increment);
      inner->finish();
      if (column.scale == 0) {
        inner->fail("scale",
                    "found 0, expected what one of the column is in the unit; a column that counts "
                    "the other way has sign = -1");
      }
      if (std::abs(column.sign) != 1) {
        inner->fail("sign", "found " + format_double(column.sign) + ", expected 1 or -1");
      }
      if (!column.unit.empty() && unit_factor(column.unit) == 0) {
        inner->fail("unit", "unknown unit " + quoted_word(column.unit) +
                                suggestion(column.unit, known_units()));
      } else if (const auto kind = kind_of(name, column); kind && !column.unit.empty()) {
        const Unit* unit = find_by(kUnits, column.unit, &Unit::name);
        if (unit->kind != *kind && column.unit != "1") {
          inner->fail("unit", "found unit " + quoted_word(column.unit) + " of " + role +
                                  ", expected one of " + units_of(*kind));
        }
      }
    }
    if (column.column.empty() && column.scale != 0) {
      errors_.add(node, role + " names no column, expected " + role +
                            " = { column = \"...\", unit = \"...\" }");
    }
    places_.emplace_back(node.source().begin.line, node.source().begin.column, map.columns.size());
    map.columns.push_back(std::move(column));
  }

  TomlErrors& errors_;
  std::vector<std::tuple<unsigned, unsigned, std::size_t>> places_;  // of map.columns
};

// A quaternion this far from unit length was not measured (Motive and TUM write zeros).
constexpr double kUnitLength = 0.1;

}  // namespace

const MappedColumn* TableMap::find(std::string_view role) const {
  return find_by(columns, role, &MappedColumn::role);
}

std::span<const std::string> TableMap::noise() const {
  const auto there = [&](const std::string& role) { return find(role) != nullptr; };
  for (const auto* roles : {&kCovarianceColumns, &kDeviationColumns}) {
    if (std::ranges::any_of(*roles, there)) return *roles;
  }
  return {};
}

double unit_factor(std::string_view unit) {
  if (unit.empty()) return 1;
  const Unit* known = find_by(kUnits, unit, &Unit::name);
  return known ? known->factor : 0;
}

std::span<const std::string> known_units() {
  static const std::vector<std::string> kNames =
      mapped(kUnits, [](const Unit& unit) { return std::string(unit.name); });
  return kNames;
}

std::string format_map(const LogMap& map) {
  std::string out;
  for (const RowKind& kind : kRowKinds) write_table(kind.name, map.*kind.map, out);
  return out;
}

Result<LogMap> parse_map(std::string_view text, const std::string& file) {
  ASSIGN_OR_RETURN(const auto table, parse_toml(text, file));
  TomlErrors errors(file);
  TomlSection root(table, "", errors);
  LogMap map;
  MapReader reader(errors);
  for (const RowKind& kind : kRowKinds) reader.read(root, kind.name, map.*kind.map);
  root.finish();
  const TableMap& p = map.poses;
  const bool heading =
      p.find("theta") != nullptr || (p.find("qx") != nullptr && p.find("qy") != nullptr &&
                                     p.find("qz") != nullptr && p.find("qw") != nullptr);
  const bool level = p.find("x") != nullptr && (p.find("y") != nullptr || p.find("z") != nullptr);
  if (!p.columns.empty() && (!level || !heading)) {
    errors.add(table.get("poses")->source().begin,
               "[poses] needs x, y and theta, or x, y and qx, qy, qz, qw");
  }
  const bool rate = map.gyro.columns.empty() || map.gyro.find("yaw_rate") != nullptr;
  if (!rate || map.gyro.columns.size() > 2) {
    errors.add(table.get("gyro")->source().begin, "[gyro] needs t and yaw_rate, and nothing else");
  }
  if (!errors.empty()) return errors.error();
  return map;
}

bool to_pose(const TableMap& map, std::vector<double>& values) {
  const auto value = [&](std::string_view role) {
    const MappedColumn* column = map.find(role);
    return column ? values[static_cast<std::size_t>(column - map.columns.data())] : 0;
  };
  const bool y_up = map.up == "y";
  double theta = value("theta");
  if (map.find("qw") != nullptr) {
    double x = value("qx"), y = value("qy"), z = value("qz"), w = value("qw");
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    if (std::abs(length - 1) > kUnitLength) return false;
    // With y up the floor's y is -z: turned about x, which keeps x.
    if (y_up) std::tie(y, z) = std::pair(-z, y);
    theta = std::atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
  }
  std::vector<double> pose = {value("t"), value("x"), y_up ? -value("z") : value("y"), theta};
  for (const std::string& role : map.noise()) pose.push_back(value(role));
  values = std::move(pose);
  return true;
}

bool at_its_time(const TableMap& map, bool poses, std::vector<double>& before,
                 std::vector<double>& values) {
  const auto any = [&](bool MappedColumn::*kind) {
    return std::ranges::any_of(map.columns, [&](const MappedColumn& c) { return c.*kind; });
  };
  const bool rates = any(&MappedColumn::rate), increments = any(&MappedColumn::increment);
  const double last = before.empty() ? 0 : before[0];
  if (map.intervals) values[0] += last;  // the end of its stretch
  if (!map.intervals && !rates && !increments) return true;
  const bool begins = before.empty() && (rates || !map.intervals);
  const double dt = values[0] - last;
  if (!begins && !(dt >= 0 && (dt > 0 || poses))) return false;
  std::vector<double> row = rates ? before : values;
  for (std::size_t c = 0; c < row.size() && !begins; ++c) {
    if (map.columns[c].rate) row[c] = (values[c] - before[c]) / dt;
    if (map.columns[c].increment) row[c] = values[c] / dt;
  }
  if (!poses && !row.empty()) row[0] = last;
  before = values;
  values = std::move(row);
  return !begins;
}

}  // namespace gapfarm
