// Predictions without a simulation, beside the models'.

#include <spdlog/fmt/fmt.h>

#include "common/score/baselines.h"
#include "common/score/statistics.h"
#include "master/diagnose/diagnose_steps.h"

namespace gapfarm {

// A simulation is worth its while when it foretells trials better than their repeats do.
Status DiagnosisRun::compare_with_baselines() {
  const ScenarioForm& form = scenario_form(problem_.scenario);
  if (form.pieces) return {};
  const std::vector<std::size_t> folds = subject_.folds(study_);
  const auto baselines = crossfitted_baselines(problem_.log, problem_.commands, folds);
  if (!baselines) return baselines.error();
  const auto by_tuned = gapfarm::compare_with_baselines(*baselines, nested_scores_.front());
  const auto by_model =
      gapfarm::compare_with_baselines(*baselines, slip_.gain > 0     ? slip_scores_
                                                  : spreads_.empty() ? nested_scores_.back()
                                                                     : spreads_.back().scores);
  Diagnosis& d = result_.diagnosis;
  if (by_model.empty()) {
    d.provenance.emplace_back("without a simulation",
                              "no command is driven often enough to be learned from by itself");
  }
  for (std::size_t b = 0; b < by_model.size(); ++b) {
    const BaselineComparison &model = by_model[b], &tuned = by_tuned[b];
    d.provenance.emplace_back(
        "without a simulation: " + model.name,
        fmt::format("{:.3f} nats a trial on {} trials left out; tuned base {:.3f}, model {:.3f}",
                    model.baseline, model.trials, tuned.model, model.model));
    if (!model.beaten()) {
      d.cautions.push_back(fmt::format(
          "The simulation does not beat {}, which needs none: {:.3f} nats a trial against {:.3f} "
          "on {} trials left out.",
          model.name, model.model, model.baseline, model.trials));
    } else if (!tuned.beaten()) {
      d.cautions.push_back(
          fmt::format("The tuned base alone does not beat {}, which needs no simulation: {:.3f} "
                      "nats a trial against {:.3f}; with what was found the model does ({:.3f}).",
                      model.name, tuned.model, model.baseline, model.model));
    }
  }
  return {};
}

}  // namespace gapfarm
