// gapfarm completion SHELL: scripts for shells.  They ask `gapfarm completion words`, so they know
// what this program knows.
#include <memory>
#include <nlohmann/json.hpp>

#include "master/cli/app.h"
#include "master/cli/completion_candidates.h"
#include "master/cli/completion_scripts.h"
#include "master/cli/subcommand.h"

namespace gapfarm {
namespace {

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
