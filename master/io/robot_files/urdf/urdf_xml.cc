#include <cmath>
#include <set>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"
#include "master/io/robot_files/urdf/urdf.h"
#include "master/io/robot_files/urdf/xml_reader.h"

namespace gapfarm {
namespace {

using tinyxml2::XMLElement;

class Reader : private XmlReader {
 public:
  explicit Reader(const std::string& file) : XmlReader(file) { model_.file = file; }

  Result<UrdfModel> read(std::string_view text) {
    tinyxml2::XMLDocument document;
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
      std::string what = document.ErrorName();
      if (what.substr(0, 4) == "XML_") what = what.substr(4);
      return Error{model_.file + ":" + std::to_string(std::max(1, document.ErrorLineNum())) +
                   ": found text that is not XML (" + what +
                   "), expected a URDF; check that line and the one before"};
    }
    const XMLElement* root = document.RootElement();
    RETURN_IF_ERROR(check_root(root));
    read_names(*root);
    std::set<std::string> declared = {"xml", "xacro"};
    read_prefixes(*root, declared, 0);
    model_.name = attribute(*root, "name");
    for (const XMLElement* child = root->FirstChildElement(); child != nullptr && !error_;
         child = child->NextSiblingElement()) {
      read_child(*child);
    }
    if (error_) return *error_;
    if (expanded_) {
      note(root->GetLineNum(),
           "the file holds xacro expressions; their default values were put in. To be sure, " +
               std::string(kExpand));
    }
    return std::move(model_);
  }

 private:
  void note(int line, const std::string& text) {
    model_.notes.push_back("line " + std::to_string(line) + ": " + text);
  }

  void read_names(const XMLElement& robot) {
    for (const XMLElement* child : children(robot)) {
      const std::string_view name = child->Name();
      const char* key = child->Attribute("name");
      if (key == nullptr) continue;
      const char* value = nullptr;
      if (name == "xacro:property") value = child->Attribute("value");
      if (name == "xacro:arg") value = child->Attribute("default");
      // An argument's own name may be that of the property made of it; the argument comes first.
      if (value != nullptr && !(name == "xacro:property" && names_.count(key) != 0)) {
        names_[key] = value;
      }
    }
  }

  void read_prefixes(const XMLElement& element, std::set<std::string>& declared, int depth) {
    for (const auto* a = element.FirstAttribute(); a != nullptr; a = a->Next()) {
      const std::string_view name = a->Name();
      if (name.substr(0, 6) == "xmlns:") declared.emplace(name.substr(6));
    }
    const std::string_view name = element.Name();
    const std::size_t colon = name.find(':');
    if (colon != name.npos && declared.emplace(name.substr(0, colon)).second) {
      note(element.GetLineNum(),
           "the prefix of <" + std::string(name) +
               "> is declared nowhere (xmlns): strict readers refuse the file; it was read over");
    }
    for (const XMLElement* child = element.FirstChildElement(); child != nullptr && depth < 64;
         child = child->NextSiblingElement()) {
      read_prefixes(*child, declared, depth + 1);
    }
  }

  void read_link(const XMLElement& element) {
    UrdfLink link;
    link.line = element.GetLineNum();
    link.name = needed(element, "name");
    for (const XMLElement* child : children(element)) {
      const std::string_view name = child->Name();
      if (name == "inertial") read_inertial(*child, link);
      if (name == "collision") read_geometry(*child, link.collisions);
      if (name == "visual") read_geometry(*child, link.visuals);
    }
    model_.links.push_back(std::move(link));
  }

  void read_inertial(const XMLElement& element, UrdfLink& link) {
    UrdfInertial inertial;
    inertial.line = element.GetLineNum();
    std::string unread;
    const Eigen::Isometry3d X_LC = origin(element, unread);
    inertial.p_LC_m = X_LC.translation();
    if (const XMLElement* mass = element.FirstChildElement("mass")) {
      inertial.mass_kg = number(*mass, "value", unread);
      if (inertial.mass_kg < 0) {
        fail(*mass,
             "found a mass of " + format_double(inertial.mass_kg) + " kg, expected at least 0");
      }
    }
    if (const XMLElement* inertia = element.FirstChildElement("inertia")) {
      const auto part = [&](const char* name) {
        return optional_number(*inertia, name).value_or(0);
      };
      Eigen::Matrix3d I;
      I << part("ixx"), part("ixy"), part("ixz"), part("ixy"), part("iyy"), part("iyz"),
          part("ixz"), part("iyz"), part("izz");
      if (I.diagonal().minCoeff() < 0) {
        fail(*inertia, "found a moment of inertia of " + format_double(I.diagonal().minCoeff()) +
                           " kg m^2, expected at least 0");
      }
      inertial.I_C_kgm2 = X_LC.linear() * I * X_LC.linear().transpose();
    }
    if (!unread.empty()) {
      note(inertial.line, "the mass of link " + quoted_word(link.name) + " holds the expression " +
                              quoted_word(unread) + " and was omitted; " + kExpand);
      return;
    }
    if (link.inertial) {
      fail(element, "found a second <inertial> of link " + quoted_word(link.name) +
                        ", expected one; add the two up");
    }
    link.inertial = inertial;
  }

  void read_geometry(const XMLElement& element, std::vector<UrdfGeometry>& to) {
    const XMLElement* geometry = element.FirstChildElement("geometry");
    if (geometry == nullptr) return;
    for (const XMLElement* shape : children(*geometry)) {
      UrdfGeometry read;
      read.line = shape->GetLineNum();
      std::string unread;
      read.X_LG = origin(element, unread);
      const std::string_view name = shape->Name();
      if (name == "box") {
        read.shape = UrdfShape::kBox;
        if (const auto size = numbers(*shape, "size", 3, unread)) {
          read.size_m = Eigen::Vector3d((*size)[0], (*size)[1], (*size)[2]).cwiseAbs();
        }
      } else if (name == "cylinder" || name == "capsule") {
        read.shape = UrdfShape::kCylinder;
        read.radius_m = std::abs(number(*shape, "radius", unread));
        read.length_m = std::abs(number(*shape, "length", unread));
      } else if (name == "sphere") {
        read.shape = UrdfShape::kSphere;
        read.radius_m = std::abs(number(*shape, "radius", unread));
      } else if (name == "mesh") {
        read.shape = UrdfShape::kMesh;
        read.mesh = attribute(*shape, "filename");
      } else {
        continue;
      }
      if (unread.empty()) {
        to.push_back(read);
      } else {
        note(read.line, "a shape holds the expression " + quoted_word(unread) +
                            " and was omitted; " + kExpand);
      }
    }
  }

  void read_joint(const XMLElement& element) {
    UrdfJoint joint;
    joint.line = element.GetLineNum();
    joint.name = needed(element, "name");
    joint.type = needed(element, "type");
    for (const char* end : {"parent", "child"}) {
      const XMLElement* named = element.FirstChildElement(end);
      if (named == nullptr) {
        fail(element, "found joint " + quoted_word(joint.name) + " without <" + end +
                          ">, expected <" + end + " link=\"...\"/>");
        return;
      }
      (*end == 'p' ? joint.parent : joint.child) = needed(*named, "link");
    }
    joint.X_PJ = origin(element, joint.unread);
    if (const XMLElement* axis = element.FirstChildElement("axis")) {
      if (const auto xyz = numbers(*axis, "xyz", 3, joint.unread)) {
        const Eigen::Vector3d given((*xyz)[0], (*xyz)[1], (*xyz)[2]);
        joint.axis_given = given.norm() > 1e-9;
        if (joint.axis_given) joint.axis_J = given.normalized();
      }
    }
    if (const XMLElement* limit = element.FirstChildElement("limit")) {
      joint.lower_rad = optional_number(*limit, "lower");
      joint.upper_rad = optional_number(*limit, "upper");
    }
    model_.joints.push_back(std::move(joint));
  }

  void read_gazebo(const XMLElement& element) {
    const std::string reference = attribute(element, "reference");
    UrdfSurface surface;
    surface.link = reference;
    bool any = false;
    for (const XMLElement* child : children(element)) {
      const std::string_view name = child->Name();
      if (name == "plugin") read_plugin(*child);
      if (name == "mu1" || name == "mu2") {
        const auto value = parse_double(value_of(*child));
        if (value && std::isfinite(*value)) (name == "mu1" ? surface.mu1 : surface.mu2) = *value;
        any = true;
      }
      if (name == "fdir1") {
        const std::string text = value_of(*child);
        const auto v = mapped(tokens_of(text), parse_double);
        if (v.size() < 3 || !v[0] || !v[1] || !v[2]) continue;
        const Eigen::Vector3d direction(*v[0], *v[1], *v[2]);
        if (direction.allFinite() && !direction.isZero()) surface.fdir1 = direction;
      }
    }
    if (any && !reference.empty()) model_.surfaces.push_back(std::move(surface));
  }

  void read_plugin(const XMLElement& element) {
    UrdfPlugin plugin;
    plugin.line = element.GetLineNum();
    plugin.name = attribute(element, "name");
    plugin.file = attribute(element, "filename");
    // ROS 2's plugins hold their names within <ros>; nothing deeper says how a robot drives.
    for (const XMLElement* child : children(element)) {
      plugin.parameters.push_back({child->Name(), value_of(*child), child->GetLineNum()});
    }
    model_.plugins.push_back(std::move(plugin));
  }

  void read_driven(const XMLElement& element, bool ros2_control) {
    for (const XMLElement* joint : children(element, "joint")) {
      // One that is without is watched, not driven.
      if (ros2_control && joint->FirstChildElement("command_interface") == nullptr) continue;
      std::string name = attribute(*joint, "name");
      if (!name.empty()) model_.actuated.push_back(std::move(name));
    }
  }

  void read_child(const XMLElement& element) {
    const std::string_view name = element.Name();
    if (name == "link") {
      read_link(element);
    } else if (name == "joint") {
      read_joint(element);
    } else if (name == "gazebo") {
      read_gazebo(element);
    } else if (name == "transmission" || name == "ros2_control") {
      read_driven(element, name == "ros2_control");
    } else if (name.substr(0, 6) == "xacro:" && name != "xacro:arg" && name != "xacro:property") {
      fail(element,
           "found <" + std::string(name) + ">, expected a URDF without macros; " + kExpand);
    }
  }

  Status check_root(const XMLElement* root) {
    if (root == nullptr) {
      return Error{model_.file + ":1: found no XML element, expected <robot>; give a URDF"};
    }
    const std::string_view name = root->Name();
    if (name == "robot") return {};
    std::string remedy = "give a URDF, or describe the robot in TOML";
    if (name == "sdf") remedy = "SDF is not read; give the URDF that it was made from";
    if (name == "mujoco") remedy = "MJCF is not read; give the URDF that it was made from";
    return Error{model_.file + ":" + std::to_string(root->GetLineNum()) + ": found <" +
                 std::string(name) + ">, expected <robot>; " + remedy};
  }

  UrdfModel model_;
};

}  // namespace

Result<UrdfModel> read_urdf_xml(std::string_view text, const std::string& file) {
  return Reader(file).read(text);
}

}  // namespace gapfarm
