#include <algorithm>

#include "master/cli/app.h"

int main(int argc, char** argv) {
  return gapfarm::run_arguments(std::vector<std::string>(argv + std::min(argc, 1), argv + argc));
}
