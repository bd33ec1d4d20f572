// render_example FOLDER: writes the pages that the browser test opens.
#include <fstream>
#include <iostream>

#include "master/report/report_html.h"
#include "tests/unit/report/example_diagnosis.h"

int main(int argc, char** argv) {
  using namespace gapfarm;
  if (argc != 2) {
    std::cerr << "usage: render_example FOLDER\n";
    return 2;
  }
  const std::string folder = argv[1];
  Diagnosis hostile = null_diagnosis();
  const std::string attack =
      "</script><script>document.title='pwned'</script><img src=x onerror=alert(1)>\"'&";
  hostile.headline = hostile.trials.front().session = hostile.trials.front().command = attack;
  hostile.where = {{attack, attack, attack, attack, 1, 1, 1, attack}};
  hostile.provenance = {{attack, attack}};
  Diagnosis empty;
  for (const auto& [name, diagnosis] : {std::pair{"example", example_diagnosis()},
                                        {"null", null_diagnosis()},
                                        {"hostile", hostile},
                                        {"empty", empty}}) {
    std::ofstream file(folder + "/" + name + ".html", std::ios::binary);
    file << report_html(diagnosis);
    if (!file.flush()) {
      std::cerr << "cannot write to " << folder << "\n";
      return 1;
    }
  }
}
