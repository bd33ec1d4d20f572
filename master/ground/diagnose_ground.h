// The diagnosis of a ground robot: which one thing of its file or log is wrong, by how much, and
// what else is (docs/ground.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/progress/overall_progress.h"
#include "common/recordings/run.h"
#include "common/recordings/windows.h"
#include "common/robot/robot.h"
#include "master/diagnose/result/diagnosis.h"
#include "master/ground/report/ground_text.h"
#include "master/ground/report/ros_export.h"
#include "master/ground/search.h"

namespace gapfarm {

struct GroundDiagnoseOptions : GroundWork {
  std::vector<std::string> excluded;  // hypotheses that are not to be thought of
  // Of the same robot: asks what changed since; none: asks what of the file or the log is wrong.
  std::optional<RunLog> reference;
};

// Every stage in its order, with its share of the time, for progress.
inline const ProgressStage kGroundStages[] = {{"fit the reference", 0.2},
                                              {kFaultStage, 0.1},
                                              {kCatalogueStage, 0.5},
                                              {kRestStage, 0.1},
                                              {"predict what was not fitted", 0.3}};

struct GroundDiagnosis {
  Diagnosis diagnosis;
  GroundRobot corrected;  // the robot with what was named put in
  std::vector<ReportedValue> values;
  GroundFigures figures;  // behind the verdict
};

// Errors: no window fits, a hypothesis to omit that there is not, a reference whose log is the
// wrong way round, stopped.
Result<GroundDiagnosis> diagnose_ground(const GroundRobot& robot, const RunLog& log,
                                        const GroundDiagnoseOptions& options);

// The same of another question; measured wheel speeds are not looked at.
Result<GroundDiagnosis> diagnose_by(const GroundRobot& robot, const RunLog& log,
                                    const GroundDiagnoseOptions& options, GroundQuestion question);

// From what a search found to what its diagnosis says (report/ground_report.cc).
GroundDiagnosis report_ground(const GroundRobot& robot, const GroundSearch& search,
                              const GroundDiagnoseOptions& options);

// What a log has the wrong way round or in another unit, in seconds, nothing fitted.
std::vector<SanityFinding> check_ground_log(const GroundRobot& robot, const RunLog& log);

// Reads each folder's runs and makes them the problem's, but for those of a ground robot's that
// show nothing and for poses of a lost tracker; what was omitted is in the log's notes.
Status read_useful_runs(std::span<const std::string> folders, const WindowSettings& windows,
                        Problem* problem);

void emit_faults(const GroundWork& work, const GroundSearch& search);
// Of the step in work, as far as it has come.
void emit_offers(const GroundWork& work, const GroundSearch& search,
                 const std::vector<Offer>& tried);
void emit_steps(const GroundWork& work, const GroundSearch& search);
void emit_rest(const GroundWork& work, const GroundSearch& search);

}  // namespace gapfarm
