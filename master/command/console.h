// Words for people: results on stdout, everything else on stderr.  With --json the results, or the
// error when there are none, are one JSON value on stdout.
#pragma once

#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/base/text.h"
#include "common/json/json.h"
#include "common/log/log.h"
#include "common/process/stop.h"
#include "common/progress/overall_progress.h"

namespace gapfarm {

class Console {
 public:
  explicit Console(std::FILE* out = stdout, std::FILE* err = stderr,
                   Clock clock = monotonic_seconds);
  ~Console();
  Console& operator=(Console&&) = delete;

  // From now on results are JSON.
  void use_json() { json_ = true; }
  bool json() const { return json_; }

  // What came of a command, once: the text, or with --json the value.
  void result(std::string_view text, const Json& value);
  // To be called last: with --json, where no result was shown, {"error": {"message", "exit_code"}}
  // with all that error() was given.  Returns `exit_code`, but kExitFailed for kExitDone where
  // stdout did not take all that was printed.
  int end(int exit_code);

  // To stdout, as it is and at once.
  void print(std::string_view text);
  // From now on notes, errors and progress are lines of this log, which copies them to the kept
  // file itself (Log::copy_to).  It outlives this or is taken back with null.
  void use(Log* log) { log_ = log; }
  // From now on notes, errors and a line of progress a minute also go to the end of this file,
  // whose older lines go once there are many (LogOptions::file).  Error: it cannot be written.
  Status keep(const std::string& file);
  // That file as a log; null: none.
  Log* kept() { return kept_.get(); }

  // A line to stderr.
  void note(std::string_view text);
  // "gapfarm: MESSAGE" to stderr.
  void error(const Error& error);

  // Shows `text` on the last line of the terminal in place of the last progress, at most ten times
  // a second.  Where stderr is no terminal it is a line at once and then one a minute, and a line
  // when `news` says that this is not just more of the same.
  void progress(std::string_view text, bool news = false);
  void clear_progress();

  bool out_is_terminal() const { return out_is_terminal_; }
  // Columns of the terminal on stdout; 80 where there is none.
  unsigned width() const;

  // `text` in a colour ("1" bold, "2" faint, "31" red, ...) where stdout is a terminal and NO_COLOR
  // is not set (https://no-color.org).
  std::string styled(std::string_view text, const char* code) const;

 private:
  std::FILE* out_;
  std::FILE* err_;
  Clock clock_;
  bool out_is_terminal_;
  bool err_is_terminal_;
  bool colour_;
  bool progress_shown_ = false;
  bool redraws_;  // stderr is a terminal that can take a line back
  bool json_ = false;
  bool printed_ = false;
  std::string errors_;
  std::string lost_;  // why stdout did not take something
  Log* log_ = nullptr;
  std::unique_ptr<Log> kept_;
  double last_progress_s_ = -1;
  LineCadence lines_;
};

// `text` with control bytes as '?': what came from elsewhere cannot steer the terminal.
std::string printable(std::string_view text);

// What a command is given, and how it may end.

enum ExitCode : int {
  kExitDone = 0,
  kExitFailed = 1,        // the work had begun
  kExitBadUsage = 2,      // wrong usage, config or input: found before the work began
  kExitQuarantined = 3,   // done, but some tasks were given up
  kExitChanged = 4,       // done: `watch` found that something changed
  kExitResumable = 85,    // stopped; the same command, or `resume`, goes on from there
  kExitSignalBase = 128,  // + the signal, 130 or 143: stopped, and nothing is kept
};

class LongCommand;

struct CliContext {
  Console& console;
  StopSource& stop;  // requested by SIGINT and SIGTERM; a second one ends the program at once
  std::shared_ptr<LongCommand> work{};  // of a long command, once it has begun
  bool dry_run = false;                 // all is to be checked and reported, and nothing done
  // Set as soon as the input is found good: an error is then kExitFailed, before kExitBadUsage.
  bool begun = false;
};

}  // namespace gapfarm
