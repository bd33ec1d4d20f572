// gapfarm report DIAGNOSIS: draw the report of a diagnosis again.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/trials/files.h"
#include "master/cli/outputs.h"
#include "master/cli/subcommand.h"
#include "master/diagnose/diagnosis_json.h"
#include "master/report/report_html.h"

namespace gapfarm {
namespace {

struct ReportCommand {
  std::string diagnosis;
  std::string out;
  Outputs outputs;
};

int run_report(ReportCommand& command, CliContext& context) {
  std::filesystem::path from(command.diagnosis);
  std::error_code ignored;
  if (std::filesystem::is_directory(from, ignored)) from /= "diagnosis.json";
  const std::string out =
      command.out.empty() ? (from.parent_path() / "report.html").string() : command.out;
  const Result<std::string> text = read_text_file(from.string());
  if (!text) {
    context.console.error(text.error());
    return kExitBadUsage;
  }
  const auto diagnosis = parse_diagnosis(*text);
  if (!diagnosis) {
    context.console.error(Error{from.string() + ": " + diagnosis.error().message});
    return kExitBadUsage;
  }
  command.outputs.reads(from.string());
  // Its own page is what it is there to draw again.
  Status planned =
      command.out.empty() ? command.outputs.plan_again(out) : command.outputs.plan(out);
  if (!planned) {
    context.console.error(planned.error());
    return kExitBadUsage;
  }
  if (Status s = command.outputs.write(out, report_html(*diagnosis)); !s) {
    context.console.error(s.error());
    return kExitFailed;
  }
  context.console.result(out + "\n", {{"report", out}});
  return kExitDone;
}

}  // namespace

SubcommandRun setup_report(CLI::App& app) {
  auto command = std::make_shared<ReportCommand>();
  app.add_option("DIAGNOSIS", command->diagnosis, "Folder of a diagnosis, or its diagnosis.json")
      ->required();
  app.add_option("--out", command->out, "HTML file; default: report.html beside it");
  command->outputs.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm report diagnosis\n"
      "  gapfarm report diagnosis/diagnosis.json --out page.html");
  return [command](CliContext& context) { return run_report(*command, context); };
}

}  // namespace gapfarm
