// URDFs for tests, put together from links and joints.
#pragma once

#include <string>

namespace gapfarm {

inline std::string cylinder_link(const std::string& name, double radius, double width,
                                 const std::string& rpy = "1.5707963267948966 0 0",
                                 double mass = 1) {
  return "<link name='" + name + "'><inertial><mass value='" + std::to_string(mass) +
         "'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' izz='0.01'/></inertial>"
         "<collision><origin xyz='0 0 0' rpy='" +
         rpy + "'/><geometry><cylinder radius='" + std::to_string(radius) + "' length='" +
         std::to_string(width) + "'/></geometry></collision></link>\n";
}

inline std::string joint(const std::string& name, const std::string& type,
                         const std::string& parent, const std::string& child,
                         const std::string& xyz, const std::string& axis = "",
                         const std::string& rpy = "0 0 0", const std::string& more = "") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
         "'/><child link='" + child + "'/><origin xyz='" + xyz + "' rpy='" + rpy + "'/>" +
         (axis.empty() ? "" : "<axis xyz='" + axis + "'/>") + more + "</joint>\n";
}

// A body of 10 kg, its centre of mass `com_x` ahead of the axle.
inline std::string body_link(const std::string& name, double com_x = 0) {
  return "<link name='" + name + "'><inertial><origin xyz='" + std::to_string(com_x) +
         " 0 0.1'/><mass value='10'/><inertia ixx='0.1' ixy='0' ixz='0' iyy='0.1' iyz='0' "
         "izz='0.2'/></inertial></link>\n";
}

inline std::string robot_xml(const std::string& inside, const std::string& name = "sample") {
  return "<?xml version='1.0'?>\n<robot name='" + name + "'>\n" + inside + "</robot>\n";
}

// Two wheels of radius 0.1 m at y = +-0.2, a ball behind.  `more` is put before the end.
inline std::string two_wheels(const std::string& more = "", double com_x = -0.05) {
  return robot_xml(body_link("base", com_x) + cylinder_link("lw", 0.1, 0.04) +
                   cylinder_link("rw", 0.1, 0.04) +
                   joint("left_wheel", "continuous", "base", "lw", "0 0.2 0.1", "0 1 0") +
                   joint("right_wheel", "continuous", "base", "rw", "0 -0.2 0.1", "0 1 0") +
                   "<link name='caster_ball'><collision><geometry><sphere radius='0.05'/>"
                   "</geometry></collision></link>" +
                   joint("ball", "fixed", "base", "caster_ball", "-0.3 0 0.05") + more);
}

}  // namespace gapfarm
