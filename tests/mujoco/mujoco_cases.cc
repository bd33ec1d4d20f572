// Cases by MuJoCo.
#include "tests/mujoco/mujoco_engine.h"
#include "tests/truths/cases.h"

int main(int argc, char** argv) {
  return gapfarm::truths::cases_program(gapfarm::truths::mujoco_engine(), argc, argv);
}
