// What may stand next on a command line: for the completion of shells.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace gapfarm {

struct CompletionCandidate {
  std::string word;     // ends in '/' or '=' where more of the word is to follow
  std::string summary;  // one line; may be empty
};

// Candidates for the last of `words`, which may be empty or begun; the others stand before it, the
// program's name omitted.  Knows commands, options and their choices; configs, runs, models and
// diagnoses by what lies in the folders; effects, parameters and commands of the config among the
// words, else of the nominal robot.
std::vector<CompletionCandidate> completion_candidates(const CLI::App& app,
                                                       const std::vector<std::string>& arguments);

}  // namespace gapfarm
