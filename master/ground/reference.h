// The log that another one of the same robot is asked about: what changed?
#pragma once

#include <cstdint>

#include "common/base/result.h"
#include "common/recordings/run.h"
#include "common/robot/robot.h"
#include "master/ground/search.h"

namespace gapfarm {

// Fits the robot to the log, from its file's values however far they are off, and says how sure
// each value is.  `alone`: of values that the log does not show, too, as when they are what is
// asked for; what another log is held against stays where the file has it.  They are then of the
// whole floor that was driven, not of one side of an edge on it.  Errors: no window fits; a log
// that is the wrong way round, with the remedy.
Result<GroundQuestion> ask_what_changed(const GroundRobot& robot, const RunLog& reference,
                                        const WindowSettings& settings, std::uint64_t seed,
                                        FitMemo* memo, bool alone = false);

// Of increments it is open which way their sensor looks and where it stands: both are fitted with
// every value, whatever the robot's file has, before anything else is asked.
// Faults are put right in the log, and both stand in the question then; `windows` become those of
// each row where wheels were read with them.  Errors: no window fits.
Status settle_sensor(const GroundRobot& robot, WindowSettings* windows, std::uint64_t seed,
                     RunLog* log, GroundQuestion* question);

// Increments err each by itself: a window of several knows nothing that they do not, as long as
// wheels were read with them; else those given.
WindowSettings windows_of_rows(const RunLog& log, const WindowSettings& usual);
// Whether wheels were read at other times than increments, by a fit's delay.
bool reads_apart(const GroundRobot& robot, double delay_s);

// The values of change_rows() and of command_offsets() by one log alone, without poses that the
// tracker took from elsewhere; their covariance is by its own scatter.  Errors: as
// ask_what_changed(); too few windows; a log that says nothing (check_runs()).
Result<OffsetFit> fit_run_values(const GroundRobot& robot, const RunLog& log,
                                 const WindowSettings& settings);

// Whether every pose of a run ends a stretch that one of its commands is about, as rows have it
// that hold both.
bool shares_a_clock(const RunLog& log);

}  // namespace gapfarm
