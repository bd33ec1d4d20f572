#include <algorithm>

#include "master/cli/run_words.h"

int main(int argc, char** argv) {
  return gapfarm::run_words(std::vector<std::string>(argv + std::min(argc, 1), argv + argc));
}
