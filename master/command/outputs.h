// The one way in which commands write files: nothing measured or made is overwritten unasked.
#pragma once

#include <CLI/CLI.hpp>

#include "common/trials/trial.h"
#include "master/command/inputs.h"
#include "master/command/long_command.h"
#include "master/experiments/influence/influence.h"

namespace gapfarm {

// What a folder may hold that nothing else may be mixed with.
enum class FolderKind { kRun, kDiagnosis, kBlindCheck, kOther };

// OK unless the folder holds what another kind of command made: not even --force mixes them.
Status check_folder(const std::string& folder, FolderKind kind);

// What a command has read and what it is to write.  Everything to be written is planned before the
// work begins, when a mistake costs nothing, and written afterwards.
class Outputs {
 public:
  void declare(CLI::App& app);

  // An output is never one of these, however it is spelt and even with --force.
  void reads(const std::string& path);
  void reads(const TrialLog& log);
  void reads(const Config& config);  // with its robot and its log
  // What a run's log may consist of, in each of these folders.
  void reads_runs(const std::vector<std::string>& folders);

  // Errors: the file is read by this command, is there already and --force was not given, is a
  // folder, a run's own, or lies where nothing can be written.  Empty and "-" (stdout) are fine.
  // Devices and pipes are written to as they are.
  Status plan(const std::string& path);
  Status plan(const std::vector<std::string>& paths);
  // Files of these names in a folder that is made for them.  Error also: a folder of another kind.
  Status plan_in(const std::string& folder, const std::vector<std::string>& names);
  // A file of the command's own that it makes again, whoever made it before.
  Status plan_again(const std::string& path);

  // Writes beside `path` and renames.  A file that has appeared since it was planned is kept, and
  // the new one lies beside it under another name, which the error shows.
  Status write(const std::string& path, std::string_view bytes) const;
  // Error also: a model that would not be read again.
  Status write_model(const std::string& path, const Model& model) const;
  // Texts under their names in a folder; those that are empty are omitted.
  using NamedTexts = std::vector<std::pair<std::string, std::string>>;
  Status write_in(const std::string& folder, const NamedTexts& files) const;

  bool force() const { return force_; }

 private:
  struct Planned {
    std::string path;
    bool replace;
  };

  Status check(const std::string& path, bool replace, bool own) const;

  bool force_ = false;
  std::vector<std::string> inputs_;
  std::vector<Planned> planned_;
};

// What most long commands take: workers, --force where they leave something, and where to keep what
// is simulated.
struct LongOptions {
  std::string out;  // file or folder that the command leaves
  Outputs outputs;
  FarmOptions farm;
  std::string keep;  // --keep: folder for what is simulated; empty: keeping_place()'s

  enum class Leaves { kNothing, kFile, kFolder };  // a folder keeps by itself: without --keep
  void declare(CLI::App& app, Leaves leaves, bool remote);

  // The command's work begins (LongCommand), in `keep` or in the folder `out`: the farm that
  // it asks.  What is simulated goes at the end: paths are large, and no figure refers to them.
  Result<std::unique_ptr<Farm>> begin(const std::string& command, std::vector<ProgressStage> stages,
                                      const FarmSettings& settings, CliContext& context) const;

 private:
  Leaves leaves_ = Leaves::kFile;
};

struct TracedCommands {
  std::vector<std::string> names;  // empty: all
  TrialOptions trials;             // where commands are pieces
  std::vector<std::string> only;

  void declare(CLI::App& app, TraceSettings* to);
  // The config, and in `to` what of it is traced: its commands, or the pushes of a log where the
  // commands are pieces.  Errors: of reading either, a name that is no command, nothing to trace.
  Result<Config> open(const std::string& path, TraceSettings* to) const;
};

}  // namespace gapfarm
