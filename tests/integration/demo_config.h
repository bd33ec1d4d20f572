// A small problem on the demo's log, for tests of runs.
#pragma once

#include <string>

namespace gapfarm {

inline const std::string kMoreGenes =
    "contact_length = [0.03, 0.12]\n"
    "pose_noise_position = [0.0005, 0.03]\n";

// The config's text: two genes at 60 Hz, `population` genomes.  Sampled spread (`replicates` > 0):
// scores draw random numbers, elites are scored again, and evaluations take the longer.  `genes`
// are more lines of [genes], `sections` whatever follows.
inline std::string demo_config(unsigned population, unsigned replicates = 0,
                               const std::string& genes = "", const std::string& sections = "") {
  std::string text = "trials = [\"" GAPFARM_SOURCE_DIR
                     "/configs/demo/trials.csv\"]\n"
                     "[genes]\n"
                     "friction = [0.1, 1.5]\n"
                     "full_speed = [0.1, 0.6]\n" +
                     genes +
                     "[parameters]\n"
                     "step_rate = 60\n";
  if (replicates > 0) {
    text += "[spread]\nkind = \"sampled\"\nreplicates = " + std::to_string(replicates) + "\n";
  }
  return text + "[evolution]\npopulation = " + std::to_string(population) + "\n" + sections;
}

}  // namespace gapfarm
