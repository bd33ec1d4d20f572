// gapfarm report RUN|DIAGNOSIS: the page of a run or of a diagnosis, from what they keep alone.
#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "common/math/statistics.h"
#include "common/trials/files.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/report/report_html.h"
#include "master/report/run/run_report.h"
#include "master/run/run_page.h"
#include "master/run/stored_run.h"

namespace gapfarm {
namespace {

struct ReportCommand {
  std::string from;
  std::string out;
  std::string history;
  Outputs outputs;
};

struct Page {
  std::string html;
  std::filesystem::path from;  // what was read
  std::filesystem::path out;   // where it goes unless configured otherwise
  Config config = {};          // of a run
  Json importance = {};        // of its parameters
  std::size_t evaluations = 0;
};

// "fitness, explained by each alone: friction 0.42, full_speed 0.1"
std::string importance_text(const nlohmann::ordered_json& importance, std::size_t evaluations) {
  if (evaluations < kLeastForImportance) {
    return fmt::format("explained by each alone: not known ({} evaluations, {} needed)",
                       evaluations, kLeastForImportance);
  }
  std::string text;
  for (const auto& [output, ignored] : importance.begin().value().items()) {
    text += (text.empty() ? "" : "; ") + output + ", explained by each alone:";
    const char* comma = " ";
    for (const auto& [key, shares] : importance.items()) {
      text += comma + key + " " + format_number(shares.value(output, 0.0), 2);
      comma = ", ";
    }
  }
  return text;
}

Result<Page> page_of_diagnosis(const std::filesystem::path& from) {
  ASSIGN_OR_RETURN(const std::string text, read_text_file(from.string()));
  ASSIGN_OR_RETURN(const auto diagnosis, under(from.string(), parse_diagnosis(text)));
  return Page{report_html(diagnosis), from, from.parent_path() / "report.html"};
}

Result<Page> page_of_run(const std::filesystem::path& run) {
  ASSIGN_OR_RETURN(const auto report, read_run_report({run, {}, {}}));
  Page page{run_html(report), run / "run.sqlite", run / "report.html"};
  for (const RunSample::GeneShare& gene : report.sample.genes) {
    for (std::size_t i = 0; i < report.sample.outputs.size(); ++i) {
      Json& share = page.importance[gene.key][report.sample.outputs[i]];
      if (!gene.importance.empty()) share = gene.importance[i];
    }
  }
  page.evaluations = report.sample.evaluated.size();
  ASSIGN_OR_RETURN(const auto reader, RunReader::open(run));
  if (auto config = stored_config(reader.info(), {})) page.config = *std::move(config);
  return page;
}

Result<Page> page_of(const std::filesystem::path& from) {
  if (is_there(from) && !is_folder(from) && from.extension() != ".json") {
    return Error{from.string() +
                 ": is no diagnosis.json; give one, or the folder of a run or of a diagnosis"};
  }
  if (!is_folder(from)) return page_of_diagnosis(from);
  if (is_there(from / "diagnosis.json")) return page_of_diagnosis(from / "diagnosis.json");
  if (is_there(from / "run.sqlite")) return page_of_run(from);
  return Error{from.string() +
               ": holds neither a diagnosis.json nor a run.sqlite; give a folder that diagnose or "
               "evolve wrote"};
}

Result<int> run_report(ReportCommand& command, CliContext& context) {
  ASSIGN_OR_RETURN(const Page page, page_of(command.from));
  const std::string out = command.out.empty() ? page.out.string() : command.out;
  command.outputs.reads(page.from.string());
  command.outputs.reads(page.config);
  // Its own page is what it is there to draw again.
  const bool own = std::filesystem::path(out).lexically_normal() == page.out.lexically_normal();
  RETURN_IF_ERROR(own ? command.outputs.plan_again(out) : command.outputs.plan(out));
  RETURN_IF_ERROR(command.outputs.plan(command.history));
  context.begun = true;
  RETURN_IF_ERROR(command.outputs.write(out, page.html));
  Json json = {{"report", out}};
  std::string text = out + "\n";
  if (!command.history.empty()) {
    ASSIGN_OR_RETURN(const auto reader, RunReader::open(command.from));
    ASSIGN_OR_RETURN(const auto csv, history_csv(reader));
    RETURN_IF_ERROR(command.outputs.write(command.history, csv));
    text += command.history + "\n";
    json["history"] = command.history;
  }
  if (!page.importance.empty()) json["importance"] = page.importance;
  if (!page.importance.empty()) {
    context.console.note(importance_text(page.importance, page.evaluations));
  }
  context.console.result(text, json);
  return kExitDone;
}

}  // namespace

SubcommandRun setup_report(CLI::App& app) {
  auto command = std::make_shared<ReportCommand>();
  app.add_option("RUN|DIAGNOSIS", command->from,
                 "Folder of a run or of a diagnosis, or a diagnosis.json")
      ->required();
  app.add_option("--out", command->out, "HTML file; default: report.html beside it");
  app.add_option("--history", command->history,
                 "Write every individual of a run to this CSV file: parameters, fitness, spent");
  command->outputs.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm report run/demo\n"
      "  gapfarm report run/demo --history history.csv\n"
      "  gapfarm report diagnosis\n"
      "  gapfarm report diagnosis/diagnosis.json --out page.html");
  return [command](CliContext& context) { return run_report(*command, context); };
}

}  // namespace gapfarm
