// The blind check from cases to result, and its folder:
//
//   check.json            what it was made of
//   seals.txt             a seal a case, published before the first diagnosis
//   cases/ID/trials.csv   all that a diagnosis is given, beside the config
//   diagnoses/ID/         what it answered, output.txt, and outcome.json once it has ended
//   truth/ID.json, truth/sealed.json     when opened: truths, and with them their salts
//   blind_check.json, blind_check.md     the result
//
// Until they are opened, truths stay in this process's memory, which no other process of the user
// can read (PrivateMemory).  They are written to `out`.truths only when the check is stopped, after
// the last diagnosis process has ended, and taken away again when it goes on.
#pragma once

#include <memory>

#include "common/progress/overall_progress.h"
#include "master/experiments/blind_check/tally.h"

namespace gapfarm {

struct BlindCheckHooks {
  // Farm work comes in two stages, with the diagnoses between; the farm goes after each.
  std::function<Result<std::unique_ptr<Farm>>()> start_farm;
  // Of find strengths, drive the cases, diagnose, judge; the farm's work shows how far it is.
  StageHooks stages = {};
  std::function<void(std::size_t ended, std::size_t all)> diagnosed =  // cases
      [](std::size_t, std::size_t) {};
  std::function<void(const std::string& sentence)> note = [](const std::string&) {};
  // Before the first diagnosis, with the truths sealed: whatever else would reveal them has to go.
  std::function<Status()> on_sealed = [] { return Status(); };
  StopSource* stop = nullptr;  // not owned
};

struct DiagnoseSettings {
  // The program and its first arguments: {"/usr/bin/gapfarm", "diagnose"}.  Then come CONFIG,
  // --trials FILE, --out DIR, --workers N, --seed N and, when asked for, --model MODEL and
  // --exclude EFFECT.
  std::vector<std::string> command;
  std::string config_path;
  std::string model_path;      // empty: the diagnosis tunes the base itself
  unsigned workers = 1;        // of each diagnosis
  unsigned jobs = 1;           // diagnoses at a time
  double time_limit_s = 1800;  // of each
};

struct BlindCheckSettings {
  DesignSettings design;
  DiagnoseSettings diagnose;
  std::string out;
  // What the check is asked, in any words; one that was stopped goes on when it is asked the same.
  std::string asked;
  SessionPlans plan;  // of every case; empty: each draws its own as the config says
  std::vector<std::pair<std::string, std::string>> provenance;  // for the report
};

// Errors: `out` holds another check, or a finished one (without blind_check.json it is judged
// again); seals that do not match; truths that are gone with a killed process; kStopped, when
// everything is in place to go on; the farm's and the file system's own.
Result<BlindReport> run_blind_check(const Config& config, const BlindCheckSettings& settings,
                                    const BlindCheckHooks& hooks);

// The same over cases that others made: CASES/ID/trials.csv, judged by TRUTHS/ID.json where there
// is one (`truths` may be empty).  Truths are read after the last diagnosis; that no diagnosis
// process reads them is their owner's care.
Result<BlindReport> run_foreign_check(const std::string& cases, const std::string& truths,
                                      const BlindCheckSettings& settings,
                                      const BlindCheckHooks& hooks);

// The log that sizes are measured on: the experiment as the config (or `plan`) plans it, driven by
// the config's own robot.
Result<Problem> planned_problem(const Config& config, const SessionPlans& plan, std::uint64_t seed,
                                Farm& farm);

// The folder of a blind check: paths, its state, and the diagnoses in it.

struct CheckPaths {
  std::string out;

  std::string state() const { return out + "/check.json"; }
  std::string seals() const { return out + "/seals.txt"; }
  std::string stopped_truths() const { return out + ".truths"; }
  std::string opened_truths() const { return out + "/truth/sealed.json"; }
  std::string trials(const std::string& id) const { return out + "/cases/" + id + "/trials.csv"; }
  std::string diagnosis(const std::string& id) const { return out + "/diagnoses/" + id; }
  std::string outcome(const std::string& id) const { return diagnosis(id) + "/outcome.json"; }
  std::string truth(const std::string& id) const { return out + "/truth/" + id + ".json"; }
  std::string result() const { return out + "/blind_check.json"; }
};

// check.json.
struct CheckState {
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
