#include <Eigen/Core>

#include "common/base/constants.h"
#include "common/math/algebra.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {

std::vector<double> standing_loads(const GroundRobot& robot) {
  if (!robot.mass_kg) return {};
  std::vector<Eigen::Vector2d> points;
  for (const RobotWheel& wheel : robot.wheels) {
    points.emplace_back(wheel.x_m.value_or(0), wheel.y_m.value_or(0));
  }
  const Eigen::Vector2d com(robot.com_x_m.value_or(0), robot.com_y_m.value_or(0));
  return wheel_loads(points, com, kGravity_m_s2 * *robot.mass_kg);
}

std::vector<double> wheel_loads(const std::vector<Eigen::Vector2d>& points,
                                const Eigen::Vector2d& com, double weight_n) {
  const auto n = points.size();
  std::vector<bool> carries(n, true);
  // Each round drops the point that would pull most; at most all of them.
  for (std::size_t round = 0; round < n; ++round) {
    // Alike springs under a rigid plate: load = a + b x + c y, with sums of loads and torques
    // given.
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < n; ++i) {
      if (!carries[i]) continue;
      const Eigen::Vector3d row(1, points[i].x() - com.x(), points[i].y() - com.y());
      A += row * row.transpose();
    }
    const Eigen::Vector3d sums(weight_n, 0, 0);
    // Points on a line leave a direction free; the least solution is the even one.
    const Eigen::Vector3d plate = pseudo_inverse(A) * sums;
    if ((A * plate - sums).norm() > 1e-6 * weight_n) return {};
    std::vector<double> loads(n, 0);
    std::size_t worst = n;
    for (std::size_t i = 0; i < n; ++i) {
      if (!carries[i]) continue;
      loads[i] = plate.dot(Eigen::Vector3d(1, points[i].x() - com.x(), points[i].y() - com.y()));
      if (loads[i] < -1e-9 * weight_n && (worst == n || loads[i] < loads[worst])) worst = i;
    }
    if (worst == n) return loads;
    carries[worst] = false;
  }
  return {};
}

}  // namespace gapfarm
