// What a diagnosis really gained: its models against the truth on a fresh log of the same robot.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/config/settings.h"
#include "common/residual/field.h"
#include "master/experiments/blind_check/cases/design.h"
#include "master/experiments/blind_check/tally.h"
#include "master/farm/farm.h"

namespace gapfarm {

// A case whose diagnosis left its models.
struct DiagnosedCase {
  Truth truth;
  ParameterValues tuned;   // of the base alone
  ParameterValues final_;  // with the named effects
  Residual residual;       // that its model.toml adds; may be empty
};

// tuned.toml and model.toml in `folder`; none when one is missing or of another scenario.
std::optional<DiagnosedCase> read_diagnosed_case(const Truth& truth, const std::string& folder);

// For each case, simulates a second log of its truth (other noise and, without `plan`, another
// plan), and has the tuned base, the diagnosis's model, with its [residual] where it has one, and
// the truth predict it.  None for a case in which a prediction did not end well.  Errors: the
// farm's own.
Result<std::vector<std::optional<FreshScores>>> score_fresh_logs(
    const Config& config, const std::vector<DiagnosedCase>& cases, const SessionPlans& plan,
    Farm& farm, const DesignProgress& progress = {});

}  // namespace gapfarm
