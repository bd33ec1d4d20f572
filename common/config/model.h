// Models: what evolving and diagnosing write, and predict and simulate take (model.toml).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/ranges.h"
#include "common/base/result.h"
#include "common/problem/problem.h"

namespace gapfarm {

// What a model was fitted to.
struct ModelData {
  std::string hash;  // of the problem, or whatever names the trials
  std::uint64_t trials = 0;
  std::vector<std::string> files;
};

// Which run it came from; all of it may be empty.
struct ModelOrigin {
  std::string run;  // the run store's path
  std::uint64_t seed = 0;
  std::uint64_t generation = 0;
  std::uint64_t evaluations = 0;
};

struct Model : Simulated {
  std::string kind = "evolved";  // "evolved", "diagnosed", "documented", ...
  std::string version;           // of the program
  std::string fingerprint;       // of the build
  // Where a parameter lies with high probability, how high is the writer's to say: one a row, or
  // none at all.
  std::vector<std::optional<Interval>> intervals;
  std::optional<double> score;  // fitness value on the data
  // World position that the effects' places count from, m: simulate a log less this.
  double frame_x_m = 0, frame_y_m = 0;
  ModelData data;
  ModelOrigin origin;
};

// A model with the scenario's nominal values and commands, of this build.  Errors: unknown
// scenario.
Result<Model> nominal_model(std::string_view scenario);

// A model of the problem at these values, of this build; of no data and no run.
Model model_of_problem(const Problem& problem, ParameterValues values);

// The model's problem without a log and without genes.
Problem problem_of(const Model& model);

// Whether a TOML text is a model rather than a config.  False when it does not parse.
bool is_model(std::string_view text);

// The text of model.toml: base parameters and noise with units and one line of explanation each,
// effects that differ from neutral, provenance.  Every double reads back as the same bits.
// REQUIRES: values that the table accepts.
std::string format_model(const Model& model);
// Error: values that the table does not accept, a residual that cannot be used.
Status check_model(const Model& model);
// Errors beside the file system's: of check_model().
Status write_model(const Model& model, const std::string& path);

// Rows that the file omits are nominal.  Errors as parse_config(), a unit that is not the
// table's among them.
Result<Model> parse_model(std::string_view text, const std::string& path);
Result<Model> read_model(const std::string& path);

}  // namespace gapfarm
