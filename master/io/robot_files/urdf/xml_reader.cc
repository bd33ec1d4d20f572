#include "master/io/robot_files/urdf/xml_reader.h"

#include <cmath>

#include "common/base/text.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";
// Properties may name one another; deeper is a circle.
constexpr int kDeepest = 8;

std::optional<std::string> value_of(std::string_view inside, bool braces, const XacroNames& names) {
  inside = trimmed(inside);
  if (braces) {
    const auto found = names.find(inside);
    if (found != names.end()) return found->second;
    return {};
  }
  const std::size_t blank = inside.find_first_of(kBlanks);
  const std::string_view word = inside.substr(0, blank);
  const std::string_view rest = blank == inside.npos ? "" : trimmed(inside.substr(blank));
  if (word == "arg") {
    const auto found = names.find(rest);
    if (found != names.end()) return found->second;
  }
  if (word == "optenv") {
    const std::size_t end = rest.find_first_of(kBlanks);
    return std::string(end == rest.npos ? "" : trimmed(rest.substr(end)));
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

// A robot is metres and tonnes; greater numbers are slips that would upset everything after.
constexpr double kGreatestNumber = 1e6;

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

void XmlReader::fail(const Element& at, const std::string& sentence) {
  if (!error_) error_ = Error{file_ + ":" + std::to_string(at.GetLineNum()) + ": " + sentence};
}

std::vector<const XmlReader::Element*> XmlReader::children(const Element& of, const char* name) {
  std::vector<const Element*> all;
  const Element* child = of.FirstChildElement(name);
  for (; child != nullptr; child = child->NextSiblingElement(name)) all.push_back(child);
  return all;
}

std::string XmlReader::attribute(const Element& element, const char* name) {
  const char* raw = element.Attribute(name);
  if (raw == nullptr) return {};
  if (!has_xacro(raw)) return raw;
  expanded_ = true;
  return expand_xacro(raw, names_);
}

std::string XmlReader::needed(const Element& element, const char* name) {
  std::string text = attribute(element, name);
  if (text.empty()) {
    fail(element, std::string("found <") + element.Name() + "> without '" + name +
                      "', expected it; fill it in");
  } else if (has_xacro(text)) {
    fail(element, "found the xacro expression " + quoted_word(text) + ", expected a " + name +
                      "; " + kExpand);
  }
  return text;
}

std::string XmlReader::value_of(const Element& element) {
  std::string value = attribute(element, "value");
  if (!value.empty() || element.GetText() == nullptr) return value;
  return std::string(trimmed(expand_xacro(element.GetText(), names_)));
}

std::optional<std::vector<double>> XmlReader::numbers(const Element& element, const char* name,
                                                      std::size_t count, std::string& unread) {
  const std::string text = attribute(element, name);
  if (text.empty()) return {};
  if (has_xacro(text)) {
    unread = text;
    return {};
  }
  std::vector<double> all;
  for (const std::string_view word : tokens_of(text)) {
    const auto value = parse_double(word);
    if (!value || !(std::abs(*value) <= kGreatestNumber)) {
      fail(element, "found " + quoted_word(word) + " in '" + name +
                        "', expected a number; write decimals with a point");
      return {};
    }
    all.push_back(*value);
  }
  if (all.size() == count) return all;
  fail(element, "found " + std::to_string(all.size()) + " numbers in '" + name + "', expected " +
                    std::to_string(count));
  return {};
}

double XmlReader::number(const Element& element, const char* name, std::string& unread) {
  const auto value = numbers(element, name, 1, unread);
  if (value) return value->front();
  if (unread.empty()) needed(element, name);
  return 0;
}

std::optional<double> XmlReader::optional_number(const Element& element, const char* name) {
  std::string unread;
  const auto value = numbers(element, name, 1, unread);
  if (value) return value->front();
  return {};
}

Eigen::Isometry3d XmlReader::origin(const Element& parent, std::string& unread) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const Element* element = parent.FirstChildElement("origin");
  if (element == nullptr) return pose;
  if (const auto xyz = numbers(*element, "xyz", 3, unread)) {
    pose.translation() = Eigen::Vector3d((*xyz)[0], (*xyz)[1], (*xyz)[2]);
  }
  if (const auto rpy = numbers(*element, "rpy", 3, unread)) {
    pose.linear() = (Eigen::AngleAxisd((*rpy)[2], Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd((*rpy)[1], Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd((*rpy)[0], Eigen::Vector3d::UnitX()))
                        .toRotationMatrix();
  }
  return pose;
}

}  // namespace gapfarm
