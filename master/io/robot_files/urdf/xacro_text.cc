#include "master/io/robot_files/urdf/xacro_text.h"

#include <optional>

namespace gapfarm {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";
// Properties may name one another; deeper is a circle.
constexpr int kDeepest = 8;

std::string_view trim(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

std::optional<std::string> value_of(std::string_view inside, bool braces, const XacroNames& names) {
  inside = trim(inside);
  if (braces) {
    const auto found = names.find(inside);
    if (found != names.end()) return found->second;
    return {};
  }
  const std::size_t blank = inside.find_first_of(kBlanks);
  const std::string_view word = inside.substr(0, blank);
  const std::string_view rest = blank == inside.npos ? "" : trim(inside.substr(blank));
  if (word == "arg") {
    const auto found = names.find(rest);
    if (found != names.end()) return found->second;
  }
  if (word == "optenv") {
    const std::size_t end = rest.find_first_of(kBlanks);
    return std::string(end == rest.npos ? "" : trim(rest.substr(end)));
  }
  return {};
}

std::string expand_once(std::string_view text, const XacroNames& names) {
  std::string out;
  std::size_t at = 0;
  while (at < text.size()) {
    const bool braces = text.compare(at, 2, "${") == 0;
    const bool round = text.compare(at, 2, "$(") == 0;
    const std::size_t end = braces || round ? text.find(braces ? '}' : ')', at) : text.npos;
    if (end == text.npos) {
      out += text[at++];
      continue;
    }
    const auto value = value_of(text.substr(at + 2, end - at - 2), braces, names);
    out += value ? *value : std::string(text.substr(at, end - at + 1));
    at = end + 1;
  }
  return out;
}

}  // namespace

bool has_xacro(std::string_view text) {
  return text.find("${") != text.npos || text.find("$(") != text.npos;
}

std::string expand_xacro(std::string_view text, const XacroNames& names) {
  std::string out(text);
  for (int depth = 0; depth < kDeepest && has_xacro(out); ++depth) {
    std::string next = expand_once(out, names);
    // A property made of itself twice over would fill the memory.
    if (next == out || next.size() > 65536) break;
    out = std::move(next);
  }
  return out;
}

}  // namespace gapfarm
