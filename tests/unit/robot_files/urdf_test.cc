#include "master/io/robot_files/urdf/urdf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/ranges.h"
#include "master/io/robot_files/urdf/xml_reader.h"
#include "tests/unit/robot_files/sample_urdf.h"

namespace gapfarm::urdf_test {

using testing::HasSubstr;
using testing::StartsWith;

std::string error_of(const std::string& text) {
  const auto model = parse_urdf(text, "r.urdf");
  return model ? "" : model.error().message;
}

TEST(Urdf, ReadsLinksJointsAndPoses) {
  const auto model = parse_urdf(two_wheels(), "r.urdf");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->name, "sample");
  EXPECT_EQ(model->root, "base");
  EXPECT_EQ(model->links.size(), 4u);
  const auto poses = link_poses(*model);
  EXPECT_TRUE(poses.at("lw").translation().isApprox(Eigen::Vector3d(0, 0.2, 0.1)));
  const UrdfJoint* wheel = find_by(model->joints, "left_wheel", &UrdfJoint::name);
  ASSERT_NE(wheel, nullptr);
  EXPECT_TRUE(wheel->axis_given);
  EXPECT_FALSE(find_by(model->joints, "ball", &UrdfJoint::name)->axis_given);
  EXPECT_TRUE(model->notes.empty());
}

TEST(Urdf, PosesTurnWithTheirParents) {
  // Roll, then pitch, then yaw, about fixed axes (URDF's rpy).
  const auto model =
      parse_urdf(robot_xml(body_link("a") + body_link("b") + body_link("c") +
                           joint("ab", "fixed", "a", "b", "1 0 0", "", "0 0 1.5707963267948966") +
                           joint("bc", "fixed", "b", "c", "1 0 0", "", "1.5707963267948966 0 0")),
                 "r.urdf");
  ASSERT_TRUE(model) << model.error().message;
  const auto poses = link_poses(*model);
  EXPECT_TRUE(poses.at("c").translation().isApprox(Eigen::Vector3d(1, 1, 0), 1e-12));
  // The child's z, first rolled to -y, then yawed to x.
  EXPECT_TRUE(poses.at("c").linear().col(2).isApprox(Eigen::Vector3d(1, 0, 0), 1e-12));
}

TEST(Urdf, ReportsWhatIsNoUrdf) {
  EXPECT_THAT(error_of("<sdf><model/></sdf>"), HasSubstr("SDF is not read"));
  EXPECT_THAT(error_of("<mujoco/>"), HasSubstr("MJCF"));
  EXPECT_THAT(error_of("left,right\n1,2\n"), StartsWith("r.urdf:1: "));
  EXPECT_THAT(error_of(""), HasSubstr("expected"));
  EXPECT_THAT(error_of("<robot name='x'/>"), HasSubstr("found no <link>"));
  EXPECT_THAT(error_of("<robot>\n<link name='a'>\n</robot>"), StartsWith("r.urdf:2: "));
}

TEST(Urdf, NamesBrokenTrees) {
  EXPECT_THAT(error_of(robot_xml(body_link("base") + body_link("base"))), HasSubstr("again"));
  EXPECT_THAT(error_of(robot_xml(body_link("a") + body_link("b"))), HasSubstr("second root"));
  EXPECT_THAT(error_of(robot_xml(body_link("base") + joint("j", "fixed", "base", "bass", "0 0 0"))),
              HasSubstr("did you mean 'base'"));
  EXPECT_THAT(error_of(robot_xml(body_link("a") + body_link("b") + body_link("c") +
                                 joint("bc", "fixed", "b", "c", "0 0 0") +
                                 joint("cb", "fixed", "c", "b", "0 0 0"))),
              HasSubstr("circle"));
  EXPECT_THAT(
      error_of(robot_xml(body_link("a") + body_link("b") + joint("j", "fixed", "a", "b", "0 0"))),
      AllOf(HasSubstr("2 numbers"), HasSubstr("expected 3")));
  EXPECT_THAT(error_of(robot_xml(body_link("a") + body_link("b") +
                                 joint("j", "fixed", "a", "b", "0 nan 0"))),
              HasSubstr("expected a number"));
  EXPECT_THAT(error_of(robot_xml(body_link("a") + body_link("b") + body_link("c") +
                                 joint("j", "fixed", "a", "b", "0 0 0") +
                                 joint("j", "fixed", "a", "c", "0 0 0"))),
              HasSubstr("found joint 'j' again"));
}

TEST(Urdf, NamesMassesThatCannotBe) {
  const std::string inertial = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='";
  const auto error = [&](const std::string& izz, int times) {
    std::string all;
    for (int k = 0; k < times; ++k) all += inertial + izz + "'/></inertial>";
    return error_of(robot_xml("<link name='a'>" + all + "</link>"));
  };
  EXPECT_EQ(error("1", 1), "");
  EXPECT_THAT(error("1", 2), HasSubstr("found a second <inertial> of link 'a'"));
  EXPECT_THAT(error("-1", 1), HasSubstr("found a moment of inertia of -1 kg m^2"));
}

TEST(Urdf, ReadsOverPrefixesThatNobodyDeclared) {
  const auto model = parse_urdf(
      two_wheels("<gazebo reference='base'><sensor:camera name='c'/></gazebo>"), "r.urdf");
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_EQ(model->notes.size(), 1u);
  EXPECT_THAT(model->notes[0], HasSubstr("sensor:camera"));
}

TEST(Urdf, PutsSimpleXacroInAndRefusesMacros) {
  const XacroNames names = {{"ns", "a_"}, {"twice", "${ns}${ns}"}};
  EXPECT_EQ(expand_xacro("${ns}base", names), "a_base");
  EXPECT_EQ(expand_xacro("${twice}", names), "a_a_");
  EXPECT_EQ(expand_xacro("$(arg ns)x", names), "a_x");
  EXPECT_EQ(expand_xacro("$(optenv HUSKY_XYZ 0.19 0 0.149)", names), "0.19 0 0.149");
  EXPECT_EQ(expand_xacro("${2 * r}", names), "${2 * r}");
  // A property of itself ends.
  EXPECT_TRUE(has_xacro(expand_xacro("${a}", {{"a", "${a}${a}"}})));

  const auto model = parse_urdf(
      robot_xml("<xacro:arg name='ns' default=''/><xacro:property name='ns' value='$(arg ns)'/>" +
                body_link("${ns}base")),
      "r.urdf");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->root, "base");
  EXPECT_EQ(model->notes.size(), 1u);
  EXPECT_THAT(error_of(robot_xml("<xacro:wheel prefix='l'/>")), HasSubstr("xacro FILE >"));
  EXPECT_THAT(error_of(robot_xml(body_link("${prefix}base"))), HasSubstr("xacro FILE >"));
}

}  // namespace gapfarm::urdf_test
