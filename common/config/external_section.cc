#include <filesystem>

#include "common/config/sections.h"
#include "common/problem/external_problem.h"

namespace gapfarm {

bool read_external_section(TomlSection& top, const std::string& config_path,
                           const ProgramStarter& start, Problem& problem) {
  auto section = top.section("external");
  const auto fail = [&](const std::string& sentence) {
    top.errors().add(section ? section->table().source().begin : top.table().source().begin,
                     sentence);
    return false;
  };
  if (!section) {
    return fail("scenario " + problem.scenario +
                " needs its program:\n  [external]\n"
                "  program = [\"python3\", \"simulator.py\"]");
  }
  ExternalCommand command;
  command.argv = section->strings("program").value_or(std::vector<std::string>());
  section->read("answer_limit", command.answer_limit_s, 1e-3, 1e6, "s");
  section->finish();
  if (command.argv.empty() || command.argv[0].empty()) {
    return fail(
        "[external] program names no program, expected words such as "
        "[\"python3\", \"simulator.py\"]");
  }
  std::error_code ignored;
  command.folder =
      std::filesystem::absolute(config_path, ignored).lexically_normal().parent_path().string();
  const Result<std::string> introduction = start(command);
  if (!introduction) return fail(introduction.error().message);
  auto program = make_external_program(std::move(command), *introduction);
  if (!program) return fail(program.error().message);
  if (Status s = check_program(**program, problem); !s) return fail(s.error().message);
  problem.external = std::move(*program);
  return true;
}

}  // namespace gapfarm
