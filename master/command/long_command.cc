#include "master/command/long_command.h"

#include <spdlog/fmt/fmt.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/build_info.h"
#include "common/base/hash.h"
#include "common/process/child.h"
#include "common/trials/files.h"

namespace gapfarm {

namespace {

namespace fs = std::filesystem;

constexpr double kRecordInterval_s = 1;  // each costs a disk write

// Words of this process's command line, without the program.
std::vector<std::string> own_arguments() {
  const Result<std::string> bytes = read_text_file("/proc/self/cmdline");
  if (!bytes || bytes->empty()) return {};
  const auto parts = parts_of(*bytes, '\0');  // each of them ends in one
  return {parts.begin() + 1, parts.end() - 1};
}

// Empty where nothing says whose state it would be.
std::string state_folder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && *state == '/') return std::string(state) + "/gapfarm";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home == '/') return std::string(home) + "/.local/state/gapfarm";
  return {};
}

// What a command that ended so is, for status and --on-end.
RunState state_of_exit(int exit_code) {
  if (exit_code == kExitDone || exit_code == kExitQuarantined) return RunState::kFinished;
  const bool stopped = exit_code == kExitResumable || exit_code > kExitSignalBase;
  return stopped ? RunState::kStopped : RunState::kFailed;
}

std::string value_of(const CLI::App& command, const std::string& name) {
  const CLI::Option* option = command.get_option_no_throw(name);
  return option == nullptr || option->count() == 0 ? std::string() : option->results().front();
}

// The folder or file that the command leaves, as a whole path; empty: none.
std::string out_of(const CLI::App& command) {
  std::string out = value_of(command, "--out");
  if (out.empty()) out = value_of(command, "RUN");
  if (out.empty() || out == "-") return {};
  return whole_path(out);
}

// Its exit status, or what kept it from starting.
Result<int> run_shell(const std::string& text, const std::vector<std::string>& variables) {
  ChildSetup setup;
  setup.arguments = {"/bin/sh", "-c", text};
  setup.environment = variables;
  setup.in = STDIN_FILENO;
  setup.death_signal = 0;
  ASSIGN_OR_RETURN(const pid_t pid, under("cannot start it", start_child(setup)));
  int status = 0;
  await_child(pid, std::numeric_limits<double>::infinity(), &status);
  return WIFEXITED(status) ? WEXITSTATUS(status) : kExitSignalBase + WTERMSIG(status);
}

}  // namespace

std::string command_line() { return "gapfarm " + joined(own_arguments(), " ", shell_quoted); }

Result<KeepingPlace> keeping_place(const std::string& given, const std::string& command,
                                   const std::string& out) {
  if (!given.empty()) return KeepingPlace{given, false};
  if (!out.empty() && out != "-") return KeepingPlace{out + ".partial", true};
  const std::string state = state_folder();
  if (state.empty()) {
    return Error{"neither XDG_STATE_HOME nor HOME names a folder; give --keep FOLDER"};
  }
  std::error_code ignored;
  std::string question = fs::current_path(ignored).string();
  for (const std::string& word : own_arguments()) question += '\0' + word;
  const std::string name = command + "-" + content_hash(question).substr(0, 16);
  return KeepingPlace{fs::path(state) / name, true};
}

// The farm that a command asks: it remembers where the command keeps, and every batch is shown.
class LongCommand::Asked : public RecordedFarm {
 public:
  Asked(std::shared_ptr<Farm> farm, LongCommand& work)
      : RecordedFarm(farm, work.answers_.get()), work_(work), wait_(farm->endpoints()) {
    set_stage(work.stage_);
    work.record_.listens(*farm);
    watch([this](const RecordedProgress& progress) {
      set_stage(work_.stage_);
      work_.on_progress(progress, *this, wait_);
    });
  }
  ~Asked() override {
    work_.record_.leave();
    work_.before_ = work_.now_;
  }

 private:
  LongCommand& work_;
  WorkerWait wait_;
};

Status LongCommand::begin(const std::string& command, const KeepingPlace& place,
                          std::vector<ProgressStage> stages, CliContext& context) {
  if (context.stop.requested()) {
    context.begun = true;
    return stop_requested();
  }
  std::error_code code;
  fs::create_directories(place.folder, code);
  if (code) return Error{place.folder.string() + ": cannot make the folder: " + code.message()};
  ASSIGN_OR_RETURN(auto lock, RunLock::take(place.folder));
  ASSIGN_OR_RETURN(auto answers,
                   AnswerStore::open(answer_file(place.folder), build_info().fingerprint));
  context.begun = true;  // a folder that is in the way is found before any work
  ASSIGN_OR_RETURN(const std::int64_t at_hand, answers.count());
  auto work = std::make_shared<LongCommand>(command, std::move(stages), context.console);
  work->place_ = place;
  work->lock_ = std::move(lock);
  work->answers_ = std::make_unique<AnswerStore>(std::move(answers));
  work->at_hand_ = at_hand;
  if (!place.passing) {
    RETURN_IF_ERROR(context.console.keep((place.folder / "log.txt").string()));
    context.console.kept()->write(LogLevel::kInfo, work->record_.arguments);
  }
  work->write_record();
  context.work = std::move(work);
  return {};
}

void LongCommand::begin_if_possible(const std::string& command, const Result<KeepingPlace>& place,
                                    std::vector<ProgressStage> stages, CliContext& context) {
  context.begun = true;
  const Status begun = place ? begin(command, *place, stages, context) : Status(place.error());
  if (begun) return;
  context.console.note("a stop would lose what is simulated: " + begun.error().message);
  context.work = std::make_shared<LongCommand>(command, std::move(stages), context.console);
}

LongCommand::LongCommand(std::string command, std::vector<ProgressStage> stages, Console& console)
    : console_(console), progress_(std::move(stages)) {
  record_.command = std::move(command);
  record_.arguments = command_line();
  record_.state = RunState::kRunning;
  record_.began_unix_s = unix_now_s();
  record_.pid = ::getpid();
  record_.host = host_name();
  plan_stages();
}

LongCommand::~LongCommand() = default;

std::unique_ptr<Farm> LongCommand::over(std::shared_ptr<Farm> farm) {
  return std::make_unique<Asked>(std::move(farm), *this);
}

void LongCommand::plan_stages() {
  record_.plan.clear();
  for (const ProgressStage& stage : progress_.stages()) record_.plan.push_back({stage.name, 0});
}

StageHooks LongCommand::hooks() {
  return {[this](std::vector<ProgressStage> stages) {
            progress_ = OverallProgress(std::move(stages));
            plan_stages();
          },
          [this](std::size_t k, std::uint64_t tasks) { stage(k, tasks); }};
}

void LongCommand::entered() {
  counts_itself_ = false;
  stage_began_ = now_;
  const ProgressView view = progress_.at(monotonic_seconds());
  stage_ = view.stage;
  if (view.number > 0 && view.number <= record_.plan.size()) {
    record_.plan[view.number - 1].began_unix_s = unix_now_s();
  }
  show();
}

void LongCommand::stage(std::size_t k, std::uint64_t tasks) {
  const bool goes_on = progress_.at(monotonic_seconds()).number == k + 1;
  progress_.begin(k, monotonic_seconds(), tasks);
  if (!goes_on) entered();
}

void LongCommand::stage(const std::string& name) {
  if (progress_.begin(name, monotonic_seconds())) entered();
}

void LongCommand::found(Finding finding) {
  std::vector<StageFinding>& all = record_.findings;
  std::erase_if(all, [&](const StageFinding& f) { return f.found.about == finding.about; });
  all.push_back({stage_, std::move(finding)});
  write_record();
}

void LongCommand::advance(std::uint64_t done, std::uint64_t total) {
  counts_itself_ = true;
  progress_.expect(total);
  progress_.answered(0, done);
  show();
}

void LongCommand::on_progress(const RecordedProgress& progress, const Farm& farm,
                              WorkerWait& wait) {
  now_ = {before_.remembered + progress.remembered, before_.simulated + progress.simulated,
          before_.asked + progress.asked};
  if (!counts_itself_) {
    progress_.answered(now_.remembered - stage_began_.remembered,
                       now_.simulated - stage_began_.simulated);
  }
  show(record_.look_at(farm, wait, monotonic_seconds()));
}

void LongCommand::show(bool news) {
  const ProgressView view = progress_.at(monotonic_seconds());
  console_.progress(
      record_.command + ": " + (record_.waiting.empty() ? progress_line(view) : record_.waiting),
      news);
  if (monotonic_seconds() - written_s_ >= kRecordInterval_s) write_record();
}

void LongCommand::write_record() {
  if (!keeps()) return;
  written_s_ = monotonic_seconds();
  static_cast<ProgressView&>(record_) = progress_.at(written_s_);
  if (record_.state == RunState::kFinished) record_.share = 1;
  record_.heartbeat_unix_s = unix_now_s();
  // A courtesy: the command goes on when it cannot be written.
  const auto text = json_text(to_json(record_));
  if (Status s = answers_->set_command(text); !s) console_.error(s.error());
}

bool LongCommand::holds_nothing() const {
  const Result<std::int64_t> kept = answers_->count();
  return kept && *kept == 0;
}

std::string LongCommand::how_to_go_on() const {
  if (also_.empty() && holds_nothing())
    return "stopped before anything was simulated; the same command begins anew";
  return "stopped; what was " + (also_.empty() ? "simulated" : also_) + " is kept in " +
         (also_.empty() ? answer_file(place_.folder).string() : also_in_) +
         ", and the same command goes on from there";
}

void LongCommand::keeps_also(const std::string& done, const fs::path& file) {
  also_ = done;
  also_in_ = file.string();
}

void LongCommand::end(int exit_code) {
  console_.clear_progress();
  if (!keeps()) return;
  if (at_hand_ > 0 && exit_code != kExitResumable) {
    console_.note(fmt::format("{} of {} simulations were in {} already", now_.remembered,
                              now_.remembered + now_.simulated,
                              answer_file(place_.folder).string()));
  }
  record_.state = state_of_exit(exit_code);
  record_.stop_reason = record_.state == RunState::kStopped ? "stopped by request"
                        : record_.state == RunState::kFailed
                            ? "failed with exit code " + std::to_string(exit_code)
                            : "";
  if (place_.passing && (record_.state == RunState::kFinished || holds_nothing())) {
    answers_.reset();
    lock_.reset();
    std::error_code ignored;
    fs::remove(answer_file(place_.folder), ignored);
    fs::remove(place_.folder / "run.lock", ignored);
    fs::remove(place_.folder, ignored);  // unless somebody put something there
    return;
  }
  if (place_.forget && record_.state == RunState::kFinished) {
    if (Status s = answers_->forget(); !s) console_.error(s.error());
  }
  write_record();
}

void declare_long_command(CLI::App& app) {
  app.add_option_function<std::string>(
         "--on-end", [](const std::string&) {},
         "Shell command to run when this one ends, stops or fails, with GAPFARM_COMMAND, "
         "GAPFARM_OUT, GAPFARM_STATE (finished, stopped, failed) and GAPFARM_EXIT set")
      ->type_name("COMMAND");
  const std::string summary = "Check everything and report what would be done; do nothing";
  app.add_flag("--dry-run", summary);
}

bool is_dry_run(const CLI::App& command) {
  const CLI::Option* option = command.get_option_no_throw("--dry-run");
  return option != nullptr && option->count() > 0;
}

void conclude_command(const CLI::App& command, int exit_code, CliContext& context) {
  if (context.work != nullptr) context.work->end(exit_code);
  const std::string text = value_of(command, "--on-end");
  if (text.empty() || is_dry_run(command)) return;
  const auto status =
      run_shell(text, {"GAPFARM_COMMAND=" + command.get_name(), "GAPFARM_OUT=" + out_of(command),
                       std::string("GAPFARM_STATE=") + run_state_name(state_of_exit(exit_code)),
                       "GAPFARM_EXIT=" + std::to_string(exit_code)});
  if (!status) {
    context.console.error(under("--on-end", status).error());
  } else if (*status != 0) {
    context.console.error(
        Error{"--on-end: the command ended with status " + std::to_string(*status)});
  }
}

}  // namespace gapfarm
