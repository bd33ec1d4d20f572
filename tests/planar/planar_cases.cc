// Cases by the planar engine.
#include "tests/planar/planar_engine.h"
#include "tests/truths/cases.h"

int main(int argc, char** argv) {
  return gapfarm::truths::cases_program(gapfarm::truths::planar_engine(), argc, argv);
}
