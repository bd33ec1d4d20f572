// What every long command does beside its work: it keeps what was simulated, so that it can be
// stopped and go on, says how far it is, and runs what the user wants run at its end.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <vector>

#include "master/command/console.h"
#include "master/farm/farm.h"
#include "master/store/answer_store.h"
#include "master/store/records.h"
#include "master/store/run_lock.h"

namespace gapfarm {

// What this process was called with, to paste into a shell: "gapfarm diagnose ...".
std::string command_line();

struct KeepingPlace {
  std::filesystem::path folder;
  bool passing = false;  // made for this purpose only: goes when the command ends well
  bool forget = false;   // the answers go then: they are large, and nobody asks them again
};

// The folder `given`, else OUT.partial beside the file `out`, else (empty or "-") one of this very
// command line under $XDG_STATE_HOME or ~/.local/state.  Error: there is none of these.
Result<KeepingPlace> keeping_place(const std::string& given, const std::string& command,
                                   const std::string& out);

class LongCommand {
 public:
  // Locks the folder (made if it is not there) and opens its simulations.sqlite and log.txt.
  // From then on `context.work` is this, failed() says how to go on, and status can see it.
  // Errors: of the folder; somebody else works in it.
  static Status begin(const std::string& command, const KeepingPlace& place,
                      std::vector<ProgressStage> stages, CliContext& context);
  // The same where a command can do without: when the place cannot be had, a note says so, nothing
  // is kept, and a stop loses what was done.
  static void begin_if_possible(const std::string& command, const Result<KeepingPlace>& place,
                                std::vector<ProgressStage> stages, CliContext& context);
  // Without a folder: progress only.
  LongCommand(std::string command, std::vector<ProgressStage> stages, Console& console);
  ~LongCommand();
  LongCommand& operator=(LongCommand&&) = delete;

  // The farm to ask from now on, for as long as it lives; this outlives it.
  std::unique_ptr<Farm> over(std::shared_ptr<Farm> farm);

  // Stage `k` (from 0), or the one of this name, begins.  `tasks`: how many it will ask, if known.
  void stage(std::size_t k, std::uint64_t tasks = 0);
  void stage(const std::string& name);
  // Progress of the present stage that is not counted in tasks of over().
  void advance(std::uint64_t done, std::uint64_t total);
  // Something was found in the present stage; it stands in the folder at once.
  void found(Finding finding);
  // For a study that knows its stages itself.
  StageHooks hooks();

  bool keeps() const { return answers_ != nullptr; }
  AnswerStore& answers() { return *answers_; }  // REQUIRES: keeps()
  std::string how_to_go_on() const;
  // What is kept beside simulations: "fitted", in that file.
  void keeps_also(const std::string& done, const std::filesystem::path& file);
  // The command is over: says so in the folder, or takes it away.
  void end(int exit_code);

 private:
  class Asked;
  void entered();
  void plan_stages();
  void on_progress(const RecordedProgress& progress, const Farm& farm, WorkerWait& wait);
  void show(bool news = false);
  void write_record();
  bool holds_nothing() const;  // REQUIRES: keeps()

  Console& console_;
  KeepingPlace place_;
  CommandRecord record_;
  OverallProgress progress_;
  std::optional<RunLock> lock_;
  std::unique_ptr<AnswerStore> answers_;
  std::string also_, also_in_;
  std::string stage_;
  RecordedProgress before_, now_, stage_began_;  // of farms that are gone; in all; then
  bool counts_itself_ = false;                   // the present stage
  double written_s_ = -1e9;
  std::int64_t at_hand_ = 0;
};

// --on-end and --dry-run, for every long command.
void declare_long_command(CLI::App& app);
// Whether --dry-run was given to it.
bool is_dry_run(const CLI::App& command);

// When `command` is over with this exit code: ends its work, and runs what --on-end names with
// GAPFARM_COMMAND, GAPFARM_OUT, GAPFARM_STATE and GAPFARM_EXIT in the environment.  What becomes of
// that is reported and changes nothing.
void conclude_command(const CLI::App& command, int exit_code, CliContext& context);

}  // namespace gapfarm
