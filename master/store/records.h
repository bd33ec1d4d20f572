// What the run store keeps, as plain data (docs/run_store.md gives the tables behind it).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/json/json.h"
#include "common/problem/problem.h"
#include "common/progress/overall_progress.h"
#include "master/farm/farm.h"

namespace gapfarm {

inline constexpr char kStoredTime[] = "%Y-%m-%dT%H:%M:%SZ";  // of times in a store

// Fixed when a run is created.
struct RunInfo {
  std::string program_version;  // create() fills in this build's when empty
  std::string fingerprint;      // same
  std::string created;          // UTC, ISO 8601; filled in by create()
  std::string config_path;      // as given
  std::string config_text;
  std::string overrides = "{}";  // JSON: command-line options that outrank the config
  std::string problem;           // serialised v1::Problem
  std::string problem_hash;
  std::uint64_t seed = 0;
  std::string numeric_class;
  std::string fitness;       // "log_score"
  std::string fitness_unit;  // "nats/trial"; "-" when it has none
  bool higher_is_better = true;
};

using NamedValue = std::pair<std::string, double>;

struct StoredIndividual {
  std::uint64_t birth_id = 0;
  std::vector<double> genome;     // genes in [0, 1]
  std::string values = "{}";      // JSON object: parameter key to value (readable_values())
  std::string outcome = "OK";     // name of a v1::Outcome
  std::optional<double> fitness;  // in the fitness's own sense and unit; none unless OK
  unsigned scores = 0;            // evaluations behind `fitness`
  std::vector<std::uint64_t> parents;
  std::string operators;  // "blend+gaussian", "elite", ...
  // Of several: those of the problem in their own sense; empty unless OK.
  std::vector<NamedValue> objectives = {};
};

// One completed generation.  Fitness figures are over its OK individuals, none when it has none;
// `best` is the first one's, which of noisy scores need not be the least that anybody had once.
struct StoredGeneration {
  std::uint64_t generation = 0;
  std::optional<double> best, mean, median, worst;
  double diversity = 0;  // mean distance of the genes from their mean, [0, 1]
  std::vector<std::pair<std::string, double>> operator_probabilities;
  std::uint64_t evaluations = 0;              // since the run began
  double wall_s = 0;                          // spent on this generation
  unsigned quarantined = 0;                   // tasks given up in this generation
  std::string optimiser_state;                // continues the run bit for bit
  std::vector<StoredIndividual> individuals;  // best first
  std::string digest;  // set by the store; covers all generations up to this one
};

enum class RunState { kUnknown, kRunning, kFinished, kStopped, kFailed };  // kFailed: no runs
const char* run_state_name(RunState state);                                // "", "running", ...
RunState run_state_of(const std::string& name);  // kUnknown for what is none of them

enum class IncidentKind {
  kQuarantine,  // a task was given up: it ended too many workers
  kAlarm,       // two workers answered one task differently
  kFailure,     // a user's program had no answer: the last of a generation's evaluations
};

// One thing that somebody should look at.
struct Incident {
  IncidentKind kind = IncidentKind::kQuarantine;
  std::uint64_t generation = 0;  // in work when it happened
  double unix_s = 0;
  std::string text;  // a sentence that names tasks, workers and hosts
};
const char* incident_name(IncidentKind kind);  // "quarantine", "alarm", "failure"

// A worker that came or went, or a master.
struct StoredWorkerEvent {
  double unix_s = 0;
  std::string kind;    // "joined", "returned", "left", "silent", "died", "refused"; "master", "end"
  std::string worker;  // its name; of a master: empty
  std::string host;
  std::string text;  // "was killed by signal 9 (Killed)"
};

// A text that was kept for later.
struct StoredDocument {
  std::uint64_t generation = 0;
  std::string json;
};

// What whoever works, a run's master or another long command, last reported of itself and its farm.
struct LiveStatus : ProgressView {  // of a run: tasks of the generation in work, no stages
  RunState state = RunState::kUnknown;
  std::string stop_reason;  // how it ended; empty while it runs
  std::string waiting;      // what it waits for; empty: nothing
  std::vector<WorkerStatus> workers;
  std::vector<FleetStatus> fleets;
  std::string listen;  // for workers: the first tcp:// endpoint; empty: none
  std::int64_t pid = 0;
  std::string host;
  double heartbeat_unix_s = 0;

  void listens(const Farm& farm);
  // Whom the farm has now.  Whether it has begun or ended to wait for workers.
  bool look_at(const Farm& farm, WorkerWait& wait, double now_s);
  // Without a farm there is nobody to wait for.
  void leave();
  bool running() const { return state == RunState::kRunning; }
  // One that says it runs but whose process is gone has stopped, with the reason; what is over has
  // no farm and promises nothing.
  void judge(bool lives);
};

// The live part: what a running master last reported about itself.
struct Progress : LiveStatus {
  Progress() { state = RunState::kRunning; }

  FarmTally farm;
  // Set by the store, with process, host and heartbeat:
  std::uint64_t epoch = 0;  // masters that have written to this run, this one included
};

// What `progress` says of its farm as a JSON object, and back: what is no such object says nothing.
std::string farm_json(const FarmTally& tally, const Progress& progress);
void read_farm(const std::string& text, Progress* progress);

// {"mass": 0.35, "wheel_shape": "sphere"}: every searched parameter at `genome`.
std::string readable_values(const Problem& problem, const Genome& genome);

// The fitness figures of `individuals`, into `generation`.
void summarise_fitness(StoredGeneration& generation, bool higher_is_better);

// Digest of `generation` after `previous`: its number and each individual's birth id, genome,
// outcome, fitness and number of scores, by their bits.  Times and workers are omitted.
std::string generation_digest(const std::string& previous, const StoredGeneration& generation);

// simulations.sqlite of a command's folder.
std::filesystem::path answer_file(const std::filesystem::path& folder);

// One of the stages that a command goes through.
struct StageRecord {
  std::string name;
  double began_unix_s = 0;  // 0: not yet
};

// What was found in a stage before the command is over.
struct StageFinding {
  std::string stage;
  Finding found;
};

struct CommandRecord : LiveStatus {
  std::string command;                 // "diagnose"
  std::string arguments;               // the whole command line
  std::vector<StageRecord> plan;       // all stages in their order
  std::vector<StageFinding> findings;  // so far, in the order in which they came
  double began_unix_s = 0;
};

Json to_json(const CommandRecord& record);
// Fields that are missing or of another kind are left as they are by default.
CommandRecord command_record_of(const Json& json);

// What the command in `folder` last reported, as it is judged to stand.  None: the folder holds no
// command.  Errors: of reading its file.
Result<std::optional<CommandRecord>> command_status(const std::filesystem::path& folder,
                                                    double now_unix_s);

// Why nothing that needs a run takes this folder, and what to do: it is another command's, or
// nobody's.
Error no_run_in(const std::filesystem::path& folder);

}  // namespace gapfarm
