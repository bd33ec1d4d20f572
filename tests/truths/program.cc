// The command line that all engines share.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "tests/truths/cases.h"

namespace gapfarm::truths {

int cases_program(const EngineKind& engine, int argc, char** argv) {
  CaseSettings settings;
  CLI::App app("Makes cases for gapfarm blind-check --foreign, by engine " + engine.name);
  app.add_option("OUT", settings.out, "Folder of cases/ and truth/")->required();
  app.add_option("--nulls", settings.counts.nulls, "Cases without any effect");
  app.add_option("--clear", settings.counts.clear, "Cases with one clear effect (size 5)");
  app.add_option("--subtle", settings.counts.subtle, "Cases with one subtle effect (size 1.6)");
  app.add_option("--outside", settings.counts.outside,
                 "Cases with a clear effect that the catalogue does not hold");
  app.add_option("--effects", settings.effects, "Only these");
  app.add_option("--sessions", settings.plan.sessions, "Sessions of a case");
  app.add_option("--trials", settings.plan.trials, "Trials of a session");
  app.add_option("--seed", settings.seed, "Of all draws");
  CLI11_PARSE(app, argc, argv);
  const Result<Made> made = make_cases(engine, settings);
  if (!made) {
    std::fprintf(stderr, "%s\n", made.error().message.c_str());
    return 1;
  }
  std::printf("%u cases in %s\n", made->cases, settings.out.c_str());
  for (const std::string& name : made->out_of_reach) {
    std::printf("out of reach: %s\n", name.c_str());
  }
  return 0;
}

}  // namespace gapfarm::truths
