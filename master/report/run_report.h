// What the page of a run shows.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/diagnosis.h"

namespace gapfarm {

// One generation's fitness; none where no individual ended well.
struct RunGeneration {
  std::uint64_t generation = 0;
  std::optional<double> best, median, worst;
  std::uint64_t evaluations = 0;  // since the run began
  double wall_s = 0;              // same
};

// How well something foretells trials.
struct ScoreRow {
  std::string name;
  std::optional<double> score;  // in the run's fitness, or nats a trial
  std::optional<double> position_mm, heading_mrad;
};

// What is worked out once, when evolution ends, and kept in the run store.
struct RunOutcome {
  std::vector<DiagnosedTrial> trials;  // "tuned" is before, "final" after evolution
  std::vector<ScoreRow> validation;    // on trials kept apart, in the run's fitness
  std::vector<ScoreRow> baselines;     // without a simulation, nats a trial
};
std::string to_json(const RunOutcome& outcome);
// Errors: not what to_json() wrote.
Result<RunOutcome> parse_run_outcome(const std::string& json);

struct RunReport {
  std::string name;      // of the folder
  std::string headline;  // one line
  std::string action;    // one line
  std::string fitness;   // "log_score"
  std::string unit;      // "nats/trial"; "-" without one
  bool higher_is_better = true;
  std::vector<RunGeneration> generations;
  std::vector<ParameterRow> parameters;  // interval: the last generation's middle nine tenths
  std::optional<RunOutcome> outcome;
  std::string without_outcome;  // why there is none
  bool pieces = false;          // the trials are pushes of pieces
  std::vector<std::pair<std::string, std::string>> provenance;
};

// The whole file, UTF-8, as report_html() makes one.
std::string run_html(const RunReport& report);

}  // namespace gapfarm
