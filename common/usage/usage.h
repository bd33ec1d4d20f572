// What is wrong with a command line, in the words of this project: what was found, what was
// expected.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace gapfarm {

// The sentence for an error that parsing `app`, or a subcommand of it, ended with.
std::string usage_sentence(const CLI::App& app, const CLI::ParseError& error);

}  // namespace gapfarm
