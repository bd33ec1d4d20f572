#include <algorithm>
#include <string>
#include <vector>

namespace gapfarm {
int run_arguments(const std::vector<std::string>& arguments);  // app.h, without CLI11's parser
}

int main(int argc, char** argv) {
  return gapfarm::run_arguments(std::vector<std::string>(argv + std::min(argc, 1), argv + argc));
}
