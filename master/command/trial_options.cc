#include "master/command/trial_options.h"

#include "master/command/console.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostFilesShown = 12;

}  // namespace

CLI::Option* TrialOptions::declare(CLI::App& app, const std::string& help) {
  CLI::Option* option = app.add_option("--trials", files, help)->type_name("FILE");
  declare_reading(app);
  return option;
}

void TrialOptions::declare_reading(CLI::App& app) {
  app.add_option("--paths", read.paths,
                 "Recorded paths of the trials, whatever they say of whose they are (default: a "
                 "paths.csv beside a log that says it belongs to it)")
      ->type_name("FILE");
  app.add_flag("--skip-invalid", read.skip_invalid,
               "Leave rows with mistakes out of the logs, and report which");
  app.add_flag("--session-prefix", read.name_sessions,
               "Put each log's file name before its sessions' names, for recorders that call them "
               "alike every day");
}

void show_notes(const TrialLog& log, Console& console) {
  for (const std::string& note : log.notes) console.note(note);
  if (log.files.empty()) return;
  std::string text = "read ";
  for (std::size_t i = 0; i < log.files.size() && i < kMostFilesShown; ++i) {
    text += (i > 0 ? ", " : "") + log.files[i];
  }
  if (log.files.size() > kMostFilesShown) {
    text += " and " + std::to_string(log.files.size() - kMostFilesShown) + " files more";
  }
  console.note(text);
}

}  // namespace gapfarm
