// What is wrong with a command line, in the words of this project: what was found, what was
// expected.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace gapfarm {

// The sentence for an error that parsing `app`, or a subcommand of it, ended with.
std::string usage_sentence(const CLI::App& app, const CLI::ParseError& error);

// Refuses what CLI11 takes: -1 for the greatest number that there is, and what is greater for it,
// too; NaN and infinity, which pass its ranges, for a number; the next option for the value of one
// that has none, and nothing for a value.  Of all options that `app` and its subcommands have.
void refuse_wrong_values(CLI::App& app);

// "gapfarm evolve [OPTIONS] CONFIG": what is typed for `app`.
std::string synopsis(const CLI::App& app, const std::string& invocation);

// A page of section 1 for man(7): name, options, every command with its own, examples.  `version`
// is "gapfarm 0.1.0".
std::string manual_page(const CLI::App& app, const std::string& version);

// --manual, which no help shows: prints the page, as --version prints the version.
void add_manual_flag(CLI::App& app, const std::string& version);

}  // namespace gapfarm
