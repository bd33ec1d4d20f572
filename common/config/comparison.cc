#include "common/config/comparison.h"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "common/config/config.h"
#include "common/config/toml_section.h"
#include "common/trials/files.h"

namespace gapfarm {
namespace {

// Puts `changes` into `base`; sections are merged, everything else is replaced.
void merge(toml::table& base, const toml::table& changes) {
  for (const auto& [key, node] : changes) {
    toml::table* below = base.contains(key) ? base.get(key)->as_table() : nullptr;
    if (below != nullptr && node.is_table()) {
      merge(*below, *node.as_table());
    } else {
      base.insert_or_assign(key, node);
    }
  }
}

// toml++ sorts keys; the author's order means something.
std::vector<std::pair<std::string, const toml::node*>> in_file_order(const toml::table& table) {
  std::vector<std::pair<std::string, const toml::node*>> nodes;
  for (const auto& [key, node] : table) nodes.emplace_back(key.str(), &node);
  std::stable_sort(nodes.begin(), nodes.end(), [](const auto& a, const auto& b) {
    return a.second->source().begin < b.second->source().begin;
  });
  return nodes;
}

Result<Variant> read_variant(const std::string& name, const toml::table& changes, toml::table base,
                             const std::string& base_path, const std::string& path) {
  merge(base, changes);
  std::ostringstream text;
  text << base;
  Result<Config> config = parse_config(text.str(), base_path, start_program);
  // Places would be those of the merged text, which nobody has seen.
  if (!config) {
    return Error{path + ": variant \"" + name +
                 "\", merged with its config: " + config.error().message};
  }
  return Variant{name, *std::move(config)};
}

}  // namespace

bool is_comparison(std::string_view text) {
  const auto parsed = parse_toml(text, "");
  return parsed.ok() && parsed->contains("compare");
}

Result<Comparison> read_comparison(const std::string& path) {
  ASSIGN_OR_RETURN(const auto text, read_text_file(path));
  ASSIGN_OR_RETURN(const auto parsed, parse_toml(text, path));
  TomlErrors errors(path);
  TomlSection top(parsed, "", errors);
  Comparison comparison;
  std::string config;
  if (auto section = top.section("compare")) {
    section->read("config", config);
    section->read("seeds", comparison.seeds, 1, 10000);
    section->read("evaluations", comparison.evaluations, 1);
    section->read("target_fitness", comparison.target_fitness, -kUnbounded, kUnbounded);
    section->finish();
  }
  const auto variants = top.section("variants");
  top.finish();
  if (!errors.empty()) return errors.error();
  if (config.empty()) return Error{path + ": [compare] names no config; add config = \"FILE\""};
  if (!variants || variants->table().empty()) {
    return Error{path + ": there are no variants; add sections such as [variants.small]"};
  }
  const std::string base_path =
      (std::filesystem::path(path).parent_path() / config).lexically_normal().string();
  ASSIGN_OR_RETURN(const auto base_text, read_text_file(base_path));
  ASSIGN_OR_RETURN(const auto base, parse_toml(base_text, base_path));
  for (const auto& [name, section] : in_file_order(variants->table())) {
    if (!section->is_table()) return Error{path + ": variant \"" + name + "\" is no section"};
    ASSIGN_OR_RETURN(auto variant, read_variant(name, *section->as_table(), base, base_path, path));
    comparison.variants.push_back(std::move(variant));
  }
  return comparison;
}

}  // namespace gapfarm
