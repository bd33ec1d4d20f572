#include "master/io/robot_files/controllers.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>

#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

constexpr int kDeepestYaml = 32;              // maps within maps
constexpr std::size_t kMostBytes = 1u << 20;  // no controller file comes near
// Aliases of aliases are small in the file and endless to walk; no controller has as many nodes.
constexpr std::size_t kMostNodes = 100'000;

struct Entry {
  std::string key;  // joined by dots
  std::vector<std::string> values;
  int line = 0;
};

int line_of(const YAML::Node& node) { return node.Mark().line + 1; }

std::string scalar_of(const YAML::Node& node) { return node.IsScalar() ? node.Scalar() : ""; }

// ROS 2 puts parameters one map deeper.
YAML::Node parameters_of(const YAML::Node& node) {
  const YAML::Node inner = node["ros__parameters"];
  return inner.IsDefined() && inner.IsMap() ? inner : node;
}

void flatten(const YAML::Node& node, const std::string& prefix, int depth,
             std::vector<Entry>& entries) {
  if (depth > kDeepestYaml) return;
  for (const auto& pair : node) {
    if (entries.size() > kMostNodes) return;
    const std::string key = prefix + scalar_of(pair.first);
    const YAML::Node& value = pair.second;
    if (value.IsMap()) {
      flatten(value, key + ".", depth + 1, entries);
    } else if (value.IsSequence()) {
      Entry entry{key, {}, line_of(pair.first)};
      for (const YAML::Node& element : value) entry.values.push_back(scalar_of(element));
      entries.push_back(std::move(entry));
    } else if (value.IsScalar()) {
      entries.push_back({key, {value.Scalar()}, line_of(pair.first)});
    }
  }
}

class YamlReader {
 public:
  explicit YamlReader(const std::string& file) { read_.file = file; }

  Result<ControllerFile> read(const YAML::Node& root) {
    collect_types(root, 0);
    collect_drives(root, 0);
    if (error_) return *error_;
    if (!read_.drives.empty()) return std::move(read_);
    std::string there;
    for (const std::string& name : read_.left) there += (there.empty() ? "" : ", ") + name;
    return Error{read_.file + ":1: found " +
                 (there.empty() ? "no controllers" : "only the controllers " + there) +
                 ", expected one that drives wheels (wheel_separation, wheelbase, ...); give the "
                 "file of its parameters"};
  }

 private:
  bool too_many(const YAML::Node& node) {
    nodes_ += node.size();
    if (nodes_ <= kMostNodes) return false;
    if (!error_) {
      error_ = Error{read_.file + ":" + std::to_string(line_of(node)) + ": found more than " +
                     std::to_string(kMostNodes) +
                     " entries, expected a controller file; aliases of aliases are not read"};
    }
    return true;
  }

  // "NAME: {type: T}", wherever it stands; ROS 2 keeps it under controller_manager.
  void collect_types(const YAML::Node& node, int depth) {
    if (!node.IsMap() || depth > kDeepestYaml || too_many(node)) return;
    for (const auto& pair : node) {
      if (!pair.second.IsMap()) continue;
      const YAML::Node type = pair.second["type"];
      if (type.IsDefined() && type.IsScalar()) types_[scalar_of(pair.first)] = type.Scalar();
      collect_types(pair.second, depth + 1);
    }
  }

  void collect_drives(const YAML::Node& node, int depth) {
    if (!node.IsMap() || depth > kDeepestYaml || too_many(node)) return;
    for (const auto& pair : node) {
      if (!pair.second.IsMap()) continue;
      if (!take(scalar_of(pair.first), pair.first, pair.second)) {
        collect_drives(pair.second, depth + 1);
      }
    }
  }

  bool take(const std::string& name, const YAML::Node& key, const YAML::Node& node) {
    DriveFacts facts;
    facts.file = read_.file;
    facts.line = line_of(key);
    facts.name = name;
    const auto type = types_.find(name);
    if (type != types_.end()) facts.type = type->second;
    std::vector<Entry> entries;
    flatten(parameters_of(node), "", 0, entries);
    for (const Entry& entry : entries) take_fact(facts, entry.key, entry.values, entry.line);
    const bool sizes = std::any_of(facts.numbers.begin(), facts.numbers.end(), [](const auto& n) {
      return n.first == "wheel_separation" || n.first == "wheelbase" || n.first == "lx_plus_ly" ||
             n.first == "wheel_radius" || n.first == "robot_radius";
    });
    if (!sizes && facts.joints.empty()) {
      if (!facts.type.empty()) read_.left.push_back(name);
      return false;
    }
    facts.drive = drive_of_type(facts.type.empty() ? name : facts.type);
    if (facts.drive.empty()) facts.drive = drive_of_keys(facts);
    check(facts);
    read_.drives.push_back(std::move(facts));
    return true;
  }

  static std::string drive_of_keys(const DriveFacts& facts) {
    if (facts.number("lx_plus_ly") != nullptr) return "mecanum";
    if (facts.number("robot_radius") != nullptr) return "omni";
    if (facts.number("wheelbase") != nullptr) return "ackermann";
    return facts.number("wheel_separation") != nullptr ? "differential" : "";
  }

  void check(const DriveFacts& facts) {
    for (const char* name : {"wheel_separation", "wheel_radius", "wheelbase", "lx_plus_ly",
                             "wheel_separation_multiplier", "left_wheel_radius_multiplier",
                             "right_wheel_radius_multiplier"}) {
      const StatedNumber* stated = facts.number(name);
      // ROS 1 takes sizes that are zero from the URDF.
      if (stated == nullptr || stated->value > 0 || error_) continue;
      error_ = Error{facts.place(stated->line) + ": found " + stated->key + " " +
                     format_double(stated->value) +
                     ", expected a number above 0; fill in the size or remove the key"};
    }
  }

  ControllerFile read_;
  std::map<std::string, std::string, std::less<>> types_;
  std::size_t nodes_ = 0;
  std::optional<Error> error_;
};

}  // namespace

Result<ControllerFile> parse_controllers(std::string_view text, const std::string& file) {
  if (text.size() > kMostBytes) {
    return Error{file + ":1: found " + std::to_string(text.size()) +
                 " bytes, expected a controller file of at most 1 MiB; give that file alone"};
  }
  try {
    const YAML::Node root = YAML::Load(std::string(text));
    if (!root.IsMap()) {
      return Error{file +
                   ":1: found no YAML map, expected controllers by name; give the file that the "
                   "controller manager loads"};
    }
    return YamlReader(file).read(root);
  } catch (const YAML::Exception& error) {
    return Error{file + ":" + std::to_string(std::max(0, error.mark.line) + 1) +
                 ": found text that is not YAML (" + error.msg +
                 "), expected a controller file; check the indentation"};
  }
}

}  // namespace gapfarm
