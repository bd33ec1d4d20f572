#include "common/config/stages.h"

#include <algorithm>
#include <filesystem>

#include "common/config/toml_section.h"

namespace gapfarm {
namespace {

class StageReader {
 public:
  StageReader(const Config& config, TomlErrors& errors) : config_(config), errors_(errors) {
    for (const Gene& gene : config.problem.genes) {
      names_.push_back(config.problem.table()[gene.row].key);
    }
  }

  void read(const toml::node& node, std::vector<Stage>& stages) {
    const toml::array* array = node.as_array();
    if (array == nullptr || array->empty()) {
      errors_.add(node, "stages is " + toml_type_name(node) + ", expected sections [[stages]]");
      return;
    }
    std::vector<bool> used(names_.size());
    for (std::size_t i = 0; i < array->size(); ++i) {
      const toml::table* table = array->get(i)->as_table();
      if (table == nullptr) {
        errors_.add(*array->get(i), "a stage is no section, expected [[stages]]");
        continue;
      }
      stages.push_back(read_stage(*table, i + 1 == array->size()));
      for (const std::size_t gene : stages.back().genes) used[gene] = true;
    }
    for (std::size_t gene = 0; gene < used.size(); ++gene) {
      if (!used[gene]) errors_.add(node, "gene " + names_[gene] + " is in no stage; add it to one");
    }
  }

 private:
  Stage read_stage(const toml::table& table, bool last) {
    TomlSection section(table, "[[stages]]", errors_);
    Stage stage;
    if (const auto genes = section.choices("genes", names_)) {
      stage.genes = *genes;
      std::sort(stage.genes.begin(), stage.genes.end());
      stage.genes.erase(std::unique(stage.genes.begin(), stage.genes.end()), stage.genes.end());
    }
    section.read("evaluations", stage.evaluations, 1);
    section.finish();
    if (stage.genes.empty()) errors_.add(table, "a stage searches nothing; give it genes = [...]");
    if (!last && stage.evaluations == 0) {
      errors_.add(table, "a stage before the last has no end; give it evaluations = N");
    }
    return stage;
  }

  const Config& config_;
  TomlErrors& errors_;
  std::vector<std::string> names_;
};

}  // namespace

Result<StagePlan> read_stages(const Config& config) {
  ASSIGN_OR_RETURN(const auto parsed, parse_toml(config.text, config.path));
  TomlErrors errors(config.path);
  TomlSection top(parsed, "", errors);
  StagePlan plan;
  if (const toml::node* node = top.find("stages")) {
    StageReader(config, errors).read(*node, plan.stages);
    if (!config.problem.fitness.objectives.empty()) {
      errors.add(*node,
                 "stages go on from one best, and a search of several objectives has a "
                 "front; leave [[stages]] out");
    }
  }
  if (auto validation = top.section("validation")) {
    if (const auto files = validation->strings(config.problem.windows() ? "folders" : "trials")) {
      const std::filesystem::path folder = std::filesystem::path(config.path).parent_path();
      for (const std::string& file : *files) {
        plan.validation_files.push_back((folder / file).lexically_normal().string());
      }
    }
    validation->finish();
  }
  if (!errors.empty()) return errors.error();
  return plan;
}

}  // namespace gapfarm
