// The folder of a blind check: paths, its state, and the diagnoses in it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/result/diagnosis.h"
#include "master/experiments/blind_check/blind_check.h"

namespace gapfarm {

struct CheckPaths {
  std::string out;

  std::string state() const { return out + "/check.json"; }
  std::string seals() const { return out + "/seals.txt"; }
  std::string box() const { return out + "/truths.box"; }
  std::string opened_key() const { return out + "/truth.key"; }
  std::string trials(const std::string& id) const { return out + "/cases/" + id + "/trials.csv"; }
  std::string diagnosis(const std::string& id) const { return out + "/diagnoses/" + id; }
  std::string outcome(const std::string& id) const { return diagnosis(id) + "/outcome.json"; }
  std::string truth(const std::string& id) const { return out + "/truth/" + id + ".json"; }
  std::string result() const { return out + "/blind_check.json"; }
  std::string salts() const { return out + "/truth/salts.txt"; }
};

// check.json.
struct CheckState {
  std::string made_of;  // hash of the config's text, or the folder of foreign cases
  std::vector<OutOfReach> out_of_reach;
  std::string asked;  // BlindCheckSettings::asked
};
Status write_check_state(const CheckState& state, const std::string& path);
Result<CheckState> read_check_state(const std::string& path);

// A case to diagnose.
struct OpenCase {
  std::string id;
  std::string trials;    // file
  std::string excluded;  // effect; empty: none
};

// Diagnoses the cases that have no outcome yet, each in its own process.
Status diagnose_cases(const std::vector<OpenCase>& cases, const CheckPaths& paths,
                      const DiagnoseSettings& settings, const BlindCheckHooks& hooks);

// How a case's diagnosis ended; kFailed with a sentence when there is no outcome.
ChildEnd read_outcome(const std::string& path);

// What it reported; none when it did not end well or left nothing readable, which `end` then shows.
std::optional<Diagnosis> read_reported(const std::string& folder, ChildEnd& end);

}  // namespace gapfarm
