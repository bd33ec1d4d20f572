#include "master/cli/subcommand.h"

namespace gapfarm {

std::span<const Subcommand> subcommands() {
  static constexpr Subcommand kTable[] = {
      {"evolve", "evolve parameters until the robot moves like the logged one", "Runs",
       setup_evolve},
      {"resume", "continue a run, bit for bit", "Runs", setup_resume},
      {"status", "report how a run, a diagnosis or a study is doing, live or dead", "Runs",
       setup_status},
      {"serve", "show runs and diagnoses in a browser, live or dead", "Runs", setup_serve},
      {"compare", "run searches side by side over seeds", "Runs", setup_compare},
      {"replay", "evaluate one individual of a run again, to the bit", "Runs", setup_replay},
      {"simulate", "make a trial log from a parameter set", "Models", setup_simulate},
      {"predict", "predict where every trial of a log should have ended", "Models", setup_predict},
      {"crossfit", "tune on some trials, try on others", "Models", setup_crossfit},
      {"determine", "report which parameters of a tuned model the data determine", "Models",
       setup_determine},
      {"drive", "drive commands or way-points many times: bands, ellipses, distances", "Models",
       setup_drive},
      {"influence", "report which parameters move a path further than repeats do", "Models",
       setup_influence},
      {"stability", "find parameters at which tiny changes of the start matter least", "Models",
       setup_stability},
      {"horizons", "report how far off a ground robot's simulation is at several horizons",
       "Models", setup_horizons},
      {"diagnose", "report where the sim-to-real gap lies and which effect causes it", "Diagnosis",
       setup_diagnose},
      {"plan", "plan what to drive so that effects show, and from which size", "Diagnosis",
       setup_plan},
      {"report", "the page of a run or a diagnosis again", "Diagnosis", setup_report},
      {"blind-check", "the diagnosis against sealed truths", "Diagnosis", setup_blind_check},
      {"effects", "list the catalogue of effects, or draw what each does", "Diagnosis",
       setup_effects},
      {"keys", "make and list the keys of masters and workers", "Setup", setup_keys},
      {"completion", "print what makes a shell complete these commands", "Setup", setup_completion},
      {"check", "validate everything that a run would need; run nothing", "Data", setup_check},
      {"init", "write a config for a trial log or a URDF, with the questions that are left", "Data",
       setup_init},
      {"robot", "report what a robot is, from its URDF and controller file", "Data", setup_robot},
      {"import", "turn other programs' logs into a trial log", "Data", setup_import},
      {"export", "what a log says of a ground robot, for its controller file and URDF", "Data",
       setup_export},
  };
  return kTable;
}

}  // namespace gapfarm
