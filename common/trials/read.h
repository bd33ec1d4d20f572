// Reads trial logs (docs/formats.md).  A log comes back whole or not at all, unless the user wants
// rows with mistakes omitted.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/trials/trial.h"

namespace gapfarm {

struct ReadOptions {
  bool skip_invalid = false;   // leave rows with mistakes out, with a note for each
  bool name_sessions = false;  // put a file's name before its sessions': "monday/s1"
  // Files of paths that are read whatever they say; a paths.csv beside a log is read when its mark
  // names the log (log_marks()), else a note says that it was not.
  std::vector<std::string> paths;
};

// `commands`: the scenario's command names; another command in a log is an error.  Every mistake
// reads "file:line:column: found X, expected Y; remedy"; an Error holds all of them, a line each,
// of many the first twenty and their number.

// The text of a trials.csv.  `file` stands in the errors.
Result<TrialLog> parse_trials(std::string_view text, const std::string& file,
                              std::span<const std::string> commands,
                              const ReadOptions& options = {});

// Of a push, from its first sample to its last.
inline constexpr double kLongestFingersWay_s = 120;

// Several files as one log, in the order given; each may be a trials.csv, a pushes.csv (with the
// tips.csv beside it) or a bbautotune run, distinguished by content.  A session split over files is
// put together in trial order.  Errors beside the formats' own: no files, a (session, trial) in two
// files, a file of another format.
Result<TrialLog> read_trial_files(std::span<const std::string> paths,
                                  std::span<const std::string> commands,
                                  const ReadOptions& options = {});

// blendersim's way-point logs: where a robot was seen and where it was sent.
struct WaypointLog {
  std::vector<PathSample> path;          // camera poses from the first order on, t_s since then
  std::vector<Eigen::Vector2d> targets;  // m, in the order in which the robot made for them
};

// Lines "HH:MM:SS:mmm:uuu [ SENT ] CAMPOSE id x y theta ..." (whole centimetres, radians) and
// "... WAYPOINTS id n x1 y1 ...", the way-points still ahead; the first of them is the target, and
// "1 0 0" is none.  Times may pass midnight once.  Errors name the line; also no target or no pose
// after the first.
Result<WaypointLog> parse_waypoint_log(std::string_view text, const std::string& file);
Result<WaypointLog> read_waypoint_log(const std::string& file);

// Writes trial logs (docs/formats.md).

// The text of a trials.csv, or of a pushes.csv for a log with tips; every number reads back as the
// same bits.
std::string format_trials(const TrialLog& log);
// The text of a paths.csv; a header alone when no trial has a path.
std::string format_paths(const TrialLog& log);

// The text of a tips.csv.
std::string format_tips(const TrialLog& log);

struct TrialFile {
  std::string path;
  std::string text;
};

// The files that a log at `path` is made of, in the order to write them: paths.csv, marked as this
// log's (log_marks()), and tips.csv beside it when it has them, then `path` itself.  Errors: what
// would not read back (an empty session, extra values without a column, a repeated trial, a number
// that is not finite), a path named like what lies beside a log.
Result<std::vector<TrialFile>> trial_files(const TrialLog& log, const std::string& path);

// Where trial_files() will put a log that is not there yet.
std::vector<std::string> trial_file_names(const std::string& path, bool paths, bool tips);

// Writes them.  Each file appears whole or not at all, in place of what is there.
Status write_trials(const TrialLog& log, const std::string& path);

}  // namespace gapfarm
