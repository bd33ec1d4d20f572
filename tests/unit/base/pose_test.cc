#include "common/pose/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/random/stream.h"

namespace gapfarm::pose_test {

Pose random_pose(Stream& stream) {
  return {stream.uniform(-2, 2), stream.uniform(-2, 2), stream.uniform(-3.1, 3.1)};
}

void expect_near(const Pose& a, const Pose& b) {
  EXPECT_NEAR(a.x, b.x, 1e-12);
  EXPECT_NEAR(a.y, b.y, 1e-12);
  EXPECT_NEAR(wrap_angle(a.theta - b.theta), 0, 1e-12);
}

TEST(Pose, WrapsIntoTheHalfOpenInterval) {
  constexpr double pi = std::numbers::pi;
  EXPECT_DOUBLE_EQ(wrap_angle(pi), pi);
  EXPECT_DOUBLE_EQ(wrap_angle(-pi), pi);
  EXPECT_NEAR(wrap_angle(3 * pi / 2), -pi / 2, 1e-15);
  EXPECT_NEAR(wrap_angle(100 * pi + 0.25), 0.25, 1e-12);
}

TEST(Pose, IsAGroup) {
  Stream stream({1, Purpose::kTest, 0, 0, 0});
  for (int i = 0; i < 200; ++i) {
    const Pose a = random_pose(stream), b = random_pose(stream), c = random_pose(stream);
    expect_near((a * b) * c, a * (b * c));
    expect_near(a * inverse(a), Pose{});
    expect_near(a * between(a, b), b);
    expect_near(mirrored(a * b), mirrored(a) * mirrored(b));
  }
}

TEST(Pose, ExpAndLogAreInverse) {
  Stream stream({2, Purpose::kTest, 0, 0, 0});
  for (int i = 0; i < 200; ++i) {
    Pose a = random_pose(stream);
    if (i % 2 == 0) a.theta *= 1e-5;  // the series near zero
    expect_near(exp(log(a)), a);
  }
}

// Constant twist (v, 0, w) for a second drives an arc of radius v/w.
TEST(Pose, ExpOfAConstantTwistIsAnArc) {
  const double v = 0.3, w = 0.8;
  const Pose end = exp({v, 0, w});
  EXPECT_NEAR(end.x, v / w * std::sin(w), 1e-15);
  EXPECT_NEAR(end.y, v / w * (1 - std::cos(w)), 1e-15);
}

TEST(NearestOnSegment, IsTheFootOfThePerpendicularOrAnEnd) {
  const Eigen::Vector2d from(1, 1), to(3, 1);
  EXPECT_DOUBLE_EQ(nearest_on_segment({1.5, 3}, from, to).share, 0.25);
  EXPECT_DOUBLE_EQ(nearest_on_segment({1.5, 3}, from, to).distance, 2);
  EXPECT_DOUBLE_EQ(nearest_on_segment({-2, 5}, from, to).share, 0);
  EXPECT_DOUBLE_EQ(nearest_on_segment({-2, 5}, from, to).distance, 5);
  EXPECT_DOUBLE_EQ(nearest_on_segment({4, 1}, from, to).share, 1);
  EXPECT_DOUBLE_EQ(nearest_on_segment({4, 1}, from, from).distance, 3);
}

}  // namespace gapfarm::pose_test
