// One row a trial, whatever the log is called: internal to common/trials.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/trials/format.h"
#include "common/trials/text/csv.h"
#include "common/trials/text/mistakes.h"
#include "common/trials/trial.h"

namespace gapfarm {

// The columns of the trial format, in the order that the writer writes them.
enum TrialColumn : std::size_t {
  kSession,
  kTrial,
  kTime,
  kCommand,
  kLeft,
  kRight,
  kDuration,
  kX0,
  kY0,
  kTheta0,
  kX1,
  kY1,
  kTheta1
};
inline const std::vector<std::string> kTrialColumns = {
    "session", "trial", "t",      "command", "left", "right", "duration",
    "x0",      "y0",    "theta0", "x1",      "y1",   "theta1"};

// Of paths, and of fingers' ways but for the heading.
enum PathColumn : std::size_t { kPathSession, kPathTrial, kPathTime, kPathX, kPathY, kPathTheta };
inline const std::vector<std::string> kPathColumns = {"session", "trial", "t", "x", "y", "theta"};
inline const std::vector<std::string> kTipColumns = {"session", "trial", "t", "x", "y"};

// Of a push log; the piece stands where a trial log has its command.
inline const std::vector<std::string> kPushColumns = {"session", "trial", "object", "x0",    "y0",
                                                      "theta0",  "x1",    "y1",     "theta1"};

using TrialKey = std::pair<std::string, std::int64_t>;

// "trial 3 of session 'a'".
std::string key_text(const TrialKey& key);

// A session is a battery charge and a command is atomic: greater numbers are milliseconds.
inline constexpr double kLongestSession_s = 1e6;
inline constexpr double kLongestCommand_s = 60;

// Where a kind of log keeps what, as positions in its `columns`; all begin with session and trial.
struct LogForm {
  TextFormat format;
  const std::vector<std::string>* columns;
  std::size_t command;               // the word in it is one of the scenario's commands
  const char* command_is;            // "a command of the scenario"
  const char* command_remedy;        // "write one of those it knows"
  std::size_t pose;                  // x0; y0, theta0, x1, y1 and theta1 follow
  std::optional<std::size_t> time;   // of the trial's start
  std::optional<std::size_t> drive;  // left; right and duration follow
};

extern const LogForm kTrialLogForm;
extern const LogForm kPushLogForm;

// The text of such a log.  What is wrong goes into `mistakes`; the trials are those of the rows in
// which nothing is.
TrialLog parse_log(const LogForm& form, std::string_view text, const std::string& file,
                   std::span<const std::string> commands, Mistakes& mistakes);

// Adds the samples of a paths.csv or a tips.csv to the trials of `logs` that they name.  Mistakes:
// also a trial that has such samples already, or that two of the logs hold.  A note in the first
// log reports rows without a trial: a log may be split while its paths are not.  Nothing is added
// when the text cannot be read.
void add_paths(std::string_view text, const std::string& file, const std::vector<TrialLog*>& logs,
               Mistakes& mistakes);
void add_tips(std::string_view text, const std::string& file, const std::vector<TrialLog*>& logs,
              Mistakes& mistakes);

// Importer of bbautotune's forward-motion runs: lines
//   x;y;theta;move(25.000000, 0.000000, 0.000000);x';y';theta'
// in centimetres and radians, one file a run.

// The text of one run as a session of that name; trials are numbered from 0, times, duties and
// durations are unknown.  Blanks around fields and in place of the last semicolon are accepted.
// Errors carry file:line:column; a move() other than (25, 0, 0) is one, since its meaning is not
// known.  A last line that breaks off was cut short with its logger: it is omitted with a note.
// Errors when `commands` has no "forward".
Result<TrialLog> parse_bbautotune(std::string_view text, const std::string& file,
                                  const std::string& session,
                                  std::span<const std::string> commands);

}  // namespace gapfarm
