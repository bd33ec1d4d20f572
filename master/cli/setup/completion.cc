// gapfarm completion SHELL: scripts for shells.  They ask `gapfarm completion words`, so they know
// what this program knows.

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/ranges.h"
#include "common/config/config.h"
#include "master/cli/completion_scripts.h"
#include "master/cli/subcommand.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

// kSetting: PARAMETER=VALUE.  From kEffect on they are of the problem, those before of the disk.
enum class Takes {
  kFile,
  kFolder,
  kConfig,
  kRun,
  kModel,
  kDiagnosis,
  kEffect,
  kParameter,
  kSetting,
  kCommand
};

// "gapfarm COMMAND" is omitted: an option means the same everywhere.
const std::vector<std::pair<Takes, std::vector<std::string_view>>> kOptionTakes = {
    {Takes::kConfig, {"CONFIG", "CONFIG|MODEL", "--config", "--robot"}},
    {Takes::kRun, {"RUN", "RUN|DIAGNOSIS", "FOLDER", "--reference", "--run"}},
    {Takes::kModel,
     {"RUN|MODEL", "RUN|CONFIG", "CONFIG|RUN|DIAGNOSIS", "MODEL", "--model", "--from"}},
    {Takes::kDiagnosis, {"DIAGNOSIS"}},
    {Takes::kFolder,
     {"DIR", "--keys", "--keep", "--runs", "--foreign", "--truth", "--worker-keys",
      "--worker-logs"}},
    {Takes::kFile,
     {"FILE", "FILES", "LOG", "LOG|URDF", "--trials", "--paths", "--history", "--mined", "--like",
      "--log", "--out", "--map", "--picture", "--urdf", "--controllers", "--key", "--site",
      "--ssh-config", "--worker-program"}},
    {Takes::kEffect, {"--effects", "--exclude"}},
    {Takes::kSetting, {"--set", "--range", "--fix"}},
    {Takes::kParameter, {"--genes", "--free", "--sweep"}},
    {Takes::kCommand, {"--command", "--commands"}}};

// Words that an option takes and no validator of its own lists.
const std::map<std::string, std::vector<std::string>> kOptionChoices = {
    {"--genome", {"best"}},
    {"--log-format", {"text", "json"}},
    {"--log-level", {"debug", "info", "warn", "error", "off"}},
    {"FORMAT", {"bbautotune", "runs"}},
    {"--sizes", {"clear", "subtle"}},
    {"--on", {"slurm", "sge", "pbs", "condor", "kube", "ssh", "local"}},
    {"--workers-on", {"slurm", "sge", "pbs", "condor", "kube", "ssh", "local"}},
};

std::string short_summary(const std::string& text) { return text.substr(0, text.find('\n')); }

// Where the words lead: the innermost command, and what the last word may be a value of.
struct Place {
  const CLI::App* app = nullptr;
  const CLI::Option* option = nullptr;  // that still takes values
  std::size_t given = 0;                // of its values
  std::size_t positionals = 0;          // given so far
  std::string config;                   // the first word that may be a config
};

bool takes_values(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

void walk_word(const std::string& word, Place& place) {
  if (word.size() > 1 && word[0] == '-') {
    const CLI::Option* option = place.app->get_option_no_throw(word.substr(0, word.find('=')));
    const bool waits = option && takes_values(*option) && word.find('=') == word.npos;
    place.option = waits ? option : nullptr;
    place.given = 0;
    return;
  }
  if (place.option != nullptr) {
    if (++place.given >= static_cast<std::size_t>(place.option->get_expected_max())) {
      place.option = nullptr;
    }
    return;
  }
  for (const CLI::App* sub : place.app->get_subcommands([](const CLI::App*) { return true; })) {
    if (sub->get_name() == word) {
      place.app = sub;
      return;
    }
  }
  if (place.positionals++ == 0) place.config = word;
}

Place find_place(const CLI::App& app, const std::vector<std::string>& arguments) {
  Place place;
  place.app = &app;
  for (std::size_t i = 0; i + 1 < arguments.size(); ++i) {
    if (i == 0 && arguments[i] == "help") continue;
    walk_word(arguments[i], place);
  }
  return place;
}

const CLI::Option* positional(const CLI::App& app, std::size_t n) {
  const CLI::Option* last = nullptr;
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    last = option;
    if (n-- == 0) return option;
  }
  const bool many = last != nullptr && last->get_expected_max() > 1;
  return many ? last : nullptr;
}

bool wanted_file(const fs::path& path, Takes takes) {
  if (takes == Takes::kConfig || takes == Takes::kModel) return path.extension() == ".toml";
  if (takes == Takes::kDiagnosis) return path.filename() == "diagnosis.json";
  return takes == Takes::kFile;
}

// What lies in the folder that `begun` names, as it would be typed.
void add_paths(const std::string& begun, Takes takes, std::vector<CompletionCandidate>& found) {
  const std::string folder = begun.substr(0, begun.rfind('/') + 1);
  const std::string stem = begun.substr(folder.size());
  std::error_code error;
  const fs::path where = folder.empty() ? "." : folder;
  for (const auto& entry : fs::directory_iterator(where, error)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind(stem, 0) != 0 || (name[0] == '.' && stem.empty())) continue;
    if (!entry.is_directory(error)) {
      if (wanted_file(entry.path(), takes)) found.push_back({folder + name, ""});
      continue;
    }
    const bool run = fs::exists(entry.path() / "run.sqlite", error);
    const bool diagnosis = fs::exists(entry.path() / "diagnosis.json", error);
    if (run && (takes == Takes::kRun || takes == Takes::kModel)) {
      found.push_back({folder + name, "run"});
    } else if (diagnosis && (takes == Takes::kDiagnosis || takes == Takes::kRun)) {
      found.push_back({folder + name, "diagnosis"});
    } else {
      found.push_back({folder + name + "/", ""});
    }
  }
}

// `begun` may be a list that has begun: "floor_tilt,motor_a".
void add_problem_arguments(const Place& place, Takes takes, const std::string& begun,
                           std::vector<CompletionCandidate>& found) {
  const std::string list = begun.substr(0, begun.rfind(',') + 1);
  Problem problem;
  problem.commands = default_commands(problem.scenario);
  if (!place.config.empty()) {
    if (auto config = read_config(place.config)) problem = std::move(config->problem);
  }
  const ParameterTable& table = problem.table();
  if (takes == Takes::kEffect) {
    for (const Effect& effect : table.effects())
      found.push_back({list + effect.name, effect.summary});
  } else if (takes == Takes::kCommand) {
    for (const CommandSpec& command : problem.commands) found.push_back({command.name, ""});
  } else {
    const char* end = takes == Takes::kSetting ? "=" : "";
    for (const Parameter& row : table.rows()) found.push_back({row.key + end, row.summary});
  }
}

// Choices of CLI::IsMember, which shows them as {a,b,c}.
std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{'), close = type.find('}');
  if (open == type.npos || close == type.npos || close < open) return {};
  const auto choices = parts_of(std::string_view(type).substr(open + 1, close - open - 1), ',');
  return {choices.begin(), choices.end()};
}

void add_values(const Place& place, const CLI::Option& option, const std::string& begun,
                std::vector<CompletionCandidate>& found) {
  const std::string name = option.get_name(option.get_positional());
  const auto* listed = find_in(kOptionChoices, name);
  const std::vector<std::string> choices = listed ? *listed : choices_of(option);
  for (const std::string& word : choices) found.push_back({word, ""});
  if (!choices.empty()) return;
  for (const auto& [takes, options] : kOptionTakes) {
    if (!contains(options, name)) continue;
    takes >= Takes::kEffect ? add_problem_arguments(place, takes, begun, found)
                            : add_paths(begun, takes, found);
  }
}

void add_options(const CLI::App& app, std::vector<CompletionCandidate>& found) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    for (const std::string& name : option->get_lnames()) {
      found.push_back({"--" + name, short_summary(option->get_description())});
    }
  }
}

struct CompletionOptions {
  std::string shell;
  std::vector<std::string> arguments;
};

Result<int> print_candidates(const CompletionOptions& options, CliContext& context) {
  const std::unique_ptr<Program> program = make_program();
  std::string text;
  Json list = Json::array();
  for (const CompletionCandidate& c : completion_candidates(*program->app, options.arguments)) {
    text += c.word + "\t" + c.summary + "\n";
    list.push_back({{"word", c.word}, {"summary", c.summary}});
  }
  context.console.result(text, list);
  return kExitDone;
}

Result<int> run_completion(const CompletionOptions& options, CliContext& context) {
  if (options.shell == "words") return print_candidates(options, context);
  const char* script = options.shell == "bash" ? kBash : options.shell == "zsh" ? kZsh : kFish;
  context.console.result(script, {{"shell", options.shell}, {"script", script}});
  return kExitDone;
}

}  // namespace

std::vector<CompletionCandidate> completion_candidates(const CLI::App& app,
                                                       const std::vector<std::string>& arguments) {
  const std::string begun = arguments.empty() ? "" : arguments.back();
  const Place place = find_place(app, arguments);
  std::vector<CompletionCandidate> found;
  if (begun.starts_with('-')) {
    add_options(*place.app, found);
  } else {
    if (place.option != nullptr) add_values(place, *place.option, begun, found);
    // An option of many values may have had its last.
    if (place.option == nullptr || place.given > 0) {
      for (const CLI::App* sub :
           place.app->get_subcommands([](const CLI::App* s) { return !s->get_group().empty(); })) {
        found.push_back({sub->get_name(), short_summary(sub->get_description())});
      }
      if (place.app == &app && arguments.size() <= 1)
        found.push_back({"help", "explain a command"});
      const CLI::Option* next = positional(*place.app, place.positionals);
      if (next != nullptr) add_values(place, *next, begun, found);
    }
  }
  std::set<std::string> seen;
  std::erase_if(found, [&](const CompletionCandidate& c) {
    return c.word.rfind(begun, 0) != 0 || !seen.insert(c.word).second;
  });
  std::ranges::sort(found, {}, &CompletionCandidate::word);
  return found;
}

SubcommandRun setup_completion(CLI::App& app) {
  auto options = std::make_shared<CompletionOptions>();
  app.add_option("SHELL", options->shell,
                 "bash, zsh or fish: its script; words: what may stand in place of the last WORD")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish", "words"}));
  app.add_option("WORDS", options->arguments, "Of a command line that is being typed; after --");
  app.footer(
      "Packages install the scripts.  Elsewhere:\n"
      "  bash: source <(gapfarm completion bash)     in ~/.bashrc\n"
      "  zsh:  source <(gapfarm completion zsh)      in ~/.zshrc, after compinit\n"
      "  fish: gapfarm completion fish | source      in ~/.config/fish/config.fish\n"
      "\n"
      "Examples:\n"
      "  gapfarm completion bash\n"
      "  gapfarm completion words -- evolve --lis");
  return [options](CliContext& context) { return run_completion(*options, context); };
}

}  // namespace gapfarm
