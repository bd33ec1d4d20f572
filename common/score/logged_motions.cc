#include "common/score/logged_motions.h"

#include "common/score/motion_model.h"
#include "common/trials/context.h"

namespace gapfarm {

std::vector<LoggedMotion> logged_motions(const Problem& problem) {
  std::vector<DrivenCommand> driven;
  for (const Trial& trial : problem.log.trials) {
    const CommandSpec c = resolved_command(trial, problem.commands);
    driven.push_back({c.left, c.right, c.duration_s});
  }
  const std::vector<TrialContext> contexts = trial_contexts(problem.log, driven);
  std::vector<LoggedMotion> facts;
  for (std::size_t i = 0; i < driven.size(); ++i) {
    const Trial& trial = problem.log.trials[i];
    const TrialContext& context = contexts[i];
    facts.push_back({trial.command, trial.X_WS, driven[i].left, driven[i].right,
                     driven[i].duration_s, context.session_time_s, context.last_left,
                     context.last_right, context.moved});
  }
  return facts;
}

}  // namespace gapfarm
