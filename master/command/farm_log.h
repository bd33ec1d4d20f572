// --log-format and --log-level, and what a farm's events look like there.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "common/log/log.h"
#include "master/command/console.h"
#include "master/farm/socket_farm.h"

namespace gapfarm {

struct LogFlags {
  LogFormat format = LogFormat::kText;
  std::optional<LogLevel> level;  // none: warnings as text, info as JSON

  void declare(CLI::App& app);
  std::unique_ptr<Log> open() const;
};

// While it lives, the console's notes and errors are lines of a log that is not for people.
class NotesGoTo {
 public:
  NotesGoTo(Log& log, Console& console) : console_(console) {
    if (log.format() == LogFormat::kJson) console_.use(&log);
  }
  ~NotesGoTo() { console_.use(nullptr); }
  NotesGoTo(const NotesGoTo&) = delete;
  NotesGoTo& operator=(const NotesGoTo&) = delete;

 private:
  Console& console_;
};

// Lets `options` report events, and single jobs at level debug, to `log`, which outlives the farm.
void report_to(Log& log, SocketFarmOptions& options);
// Lets `options` report what went wrong to the user, and all events to the console's kept file.
void report_to(Console& console, SocketFarmOptions& options);

}  // namespace gapfarm
