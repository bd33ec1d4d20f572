#include "common/usage/manual.h"

#include <algorithm>
#include <sstream>

namespace gapfarm {
namespace {

// Text that roff prints as it is.
std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) {
      out += std::string("\\&") + c;
    } else {
      out += c;
    }
  }
  return out;
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

// Lines as they are, without filling.
std::string verbatim(const std::string& text) {
  if (text.empty()) return "";
  return ".nf\n" + roff(text) + (text.back() == '\n' ? "" : "\n") + ".fi\n";
}

std::string option_entry(const CLI::Option& option) {
  std::string text = ".TP\n.B " + roff(option.get_positional() ? option.get_name(true)
                                                               : option.get_name(false, true));
  const std::string type = option.get_items_expected_max() > 0 ? option.get_type_name() : "";
  // What CLI11 calls a type may be a range: "UINT:INT in [0 - 4096]".
  const std::string word = type.substr(0, type.find_first_of(":{ "));
  if (!option.get_positional() && !word.empty()) text += " " + roff(word);
  text += "\n" + roff(option.get_description());
  if (!option.get_default_str().empty())
    text += " (default: " + roff(option.get_default_str()) + ")";
  return text + "\n";
}

std::string options_of(const CLI::App& app) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_group().empty()) text += option_entry(*option);
  }
  return text;
}

std::vector<const CLI::App*> shown_commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* sub) { return !sub->get_group().empty(); });
}

void describe_command(const CLI::App& app, const std::string& invocation, std::string& text) {
  text += ".SS " + roff(synopsis(app, invocation)) + "\n" + roff(app.get_description()) + "\n";
  text += options_of(app);
  if (!app.get_footer().empty()) text += ".PP\n" + verbatim(app.get_footer());
  for (const CLI::App* sub : shown_commands(app)) {
    describe_command(*sub, invocation + " " + sub->get_name(), text);
  }
}

}  // namespace

std::string synopsis(const CLI::App& app, const std::string& invocation) {
  std::string text = invocation;
  const auto commands = shown_commands(app);
  if (!commands.empty()) return text + " COMMAND";
  text += " [OPTIONS]";
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    std::string name = option->get_name(true);
    if (option->get_expected_max() > 1) name += "...";
    text += option->get_required() ? " " + name : " [" + name + "]";
  }
  return text;
}

std::string manual_page(const CLI::App& app, const std::string& version) {
  const std::string name = app.get_name();
  std::string summary = app.get_description();
  std::replace(summary.begin(), summary.end(), '\n', ' ');
  if (!summary.empty() && summary.back() == '.') summary.pop_back();
  std::string text = ".TH " + upper(name) + " 1 \"\" \"" + version + "\" \"User Commands\"\n";
  text += ".SH NAME\n" + roff(name) + " \\- " + roff(summary) + "\n";
  text += ".SH SYNOPSIS\n" + roff(synopsis(app, name)) + "\n.SH OPTIONS\n" + options_of(app);
  const auto commands = shown_commands(app);
  if (!commands.empty()) text += ".SH COMMANDS\n";
  for (const CLI::App* sub : commands) {
    describe_command(*sub, name + " " + sub->get_name(), text);
  }
  if (!app.get_footer().empty()) text += ".SH NOTES\n" + verbatim(app.get_footer());
  return text;
}

void add_manual_flag(CLI::App& app, const std::string& version) {
  const auto print = [&app, version] { throw CLI::CallForVersion(manual_page(app, version), 0); };
  app.add_flag_callback("--manual", print)->group("");
}

}  // namespace gapfarm
