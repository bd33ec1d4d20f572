#include <algorithm>

#include "master/cli/run_arguments.h"

int main(int argc, char** argv) {
  return gapfarm::run_arguments(std::vector<std::string>(argv + std::min(argc, 1), argv + argc));
}
