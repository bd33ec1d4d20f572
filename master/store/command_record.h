// What a long command that is no run says about itself, in the folder where it keeps its
// simulations: for `gapfarm status`, live and dead.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/json/json.h"
#include "common/progress/finding.h"
#include "common/progress/overall_progress.h"
#include "master/store/records.h"

namespace gapfarm {

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

struct CommandRecord : ProgressView {
  std::string command;                 // "diagnose"
  std::string arguments;               // the whole command line
  std::string state;                   // "running", "finished", "stopped", "failed"
  std::string reason;                  // how it ended; empty while it runs
  std::vector<StageRecord> plan;       // all stages in their order
  std::vector<StageFinding> findings;  // so far, in the order in which they came
  std::string waiting;                 // what it waits for; empty: nothing
  std::vector<WorkerStatus> workers;
  std::vector<FleetStatus> fleets;
  std::string listen;  // for workers: the first tcp:// endpoint; empty: none
  double began_unix_s = 0, heartbeat_unix_s = 0;
  std::int64_t pid = 0;
  std::string host;
};

Json to_json(const CommandRecord& record);
// Fields that are missing or of another kind are left as they are by default.
CommandRecord command_record_of(const Json& json);

// What the command in `folder` last reported; one that says it runs but whose process is gone has
// stopped, with the reason.  None: the folder holds no command.  Errors: of reading its file.
Result<std::optional<CommandRecord>> command_status(const std::filesystem::path& folder,
                                                    double now_unix_s);

}  // namespace gapfarm
