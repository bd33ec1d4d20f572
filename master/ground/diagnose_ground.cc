#include "master/ground/diagnose_ground.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <chrono>

#include "master/ground/ground_report.h"

namespace gapfarm {

Result<GroundDiagnosis> diagnose_ground(const GroundRobot& robot, const RunLog& log,
                                        const GroundDiagnoseOptions& options) {
  std::vector<GroundHypothesis> catalogue = ground_hypotheses(robot);
  for (const std::string& name : options.left_out) {
    const auto wanted = [&](const GroundHypothesis& h) { return h.name == name; };
    if (std::none_of(catalogue.begin(), catalogue.end(), wanted)) {
      return Error{"--leave-out: this robot's catalogue has no \"" + name + "\""};
    }
    std::erase_if(catalogue, wanted);
  }
  Diagnosis timed;
  auto began = std::chrono::steady_clock::now();
  std::string running;
  const auto stage = [&](const std::string& name) {
    const auto now = std::chrono::steady_clock::now();
    if (!running.empty()) {
      timed.timing_s.emplace_back(running, std::chrono::duration<double>(now - began).count());
    }
    running = name;
    began = now;
    if (options.on_stage && !name.empty()) options.on_stage(name);
  };
  auto search = search_ground(robot, log, options.windows, catalogue, stage);
  if (!search) return search.error();
  stage("predict what was not fitted");
  GroundDiagnosis result{report_ground(robot, *search, options),
                         robot_with(robot, chosen_values(*search))};
  stage("");
  result.diagnosis.timing_s = std::move(timed.timing_s);
  return result;
}

std::vector<SanityFinding> check_ground_log(const GroundRobot& robot, const RunLog& log) {
  const std::vector<GroundHypothesis> catalogue = ground_hypotheses(robot);
  const auto fault = find_ground_fault(robot, log, catalogue, {{2}, 0.5});
  if (!fault) return {};
  const GroundHypothesis& h = catalogue[fault->hypothesis];
  return {
      {h.name,
       fmt::format("With {} put right, what the robot's file expects is {:.1f} times as near to "
                   "what was measured.",
                   h.thing, fault->shrinks),
       h.remedy, Severity::kDoubt, true, h.aliases}};
}

}  // namespace gapfarm
