// Attributes and numbers of one XML file; the first error sticks.
#pragma once

#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

// The few xacro expressions that files called .urdf still hold: ${name}, $(arg name),
// $(optenv NAME default).

// Values by name; of properties and arguments alike.
using XacroNames = std::map<std::string, std::string, std::less<>>;

// `text` with every expression that `names` and defaults settle put in; the others stay.
std::string expand_xacro(std::string_view text, const XacroNames& names);

// Whether an expression is left.
bool has_xacro(std::string_view text);

class XmlReader {
 public:
  using Element = tinyxml2::XMLElement;
  explicit XmlReader(std::string file) : file_(std::move(file)) {}

  static constexpr const char* kExpand = "expand it first: xacro FILE > robot.urdf";

 protected:
  void fail(const Element& at, const std::string& sentence);
  // All, or those of a name.
  static std::vector<const Element*> children(const Element& of, const char* name = nullptr);

  // With expressions put in where names_ settle them.  Empty when it is not there.
  std::string attribute(const Element& element, const char* name);
  // An error when it is empty or still an expression.
  std::string needed(const Element& element, const char* name);
  // Text of the element or its attribute "value": Gazebo's files write either.
  std::string value_of(const Element& element);
  // `count` numbers, or none with the reason in `unread` (an expression) or an error.
  std::optional<std::vector<double>> numbers(const Element& element, const char* name,
                                             std::size_t count, std::string& unread);
  double number(const Element& element, const char* name, std::string& unread);
  std::optional<double> optional_number(const Element& element, const char* name);
  // Of the child <origin>; the identity without one.
  Eigen::Isometry3d origin(const Element& parent, std::string& unread);

  std::string file_;
  XacroNames names_;  // settled so far
  bool expanded_ = false;
  std::optional<Error> error_;
};

}  // namespace gapfarm
