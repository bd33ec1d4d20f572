#include "master/io/robot_files/urdf/masses.h"

namespace gapfarm {

MassSum sum_masses(const UrdfModel& model, const LinkPoses& poses) {
  MassSum sum;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  std::string weightless;
  for (const UrdfLink& link : model.links) {
    if (!link.inertial) {
      if (!link.collisions.empty())
        weightless += (weightless.empty() ? "'" : ", '") + link.name + "'";
      continue;
    }
    sum.mass_kg += link.inertial->mass_kg;
    moment += link.inertial->mass_kg * (poses.find(link.name)->second * link.inertial->p_LC_m);
  }
  if (sum.mass_kg <= 0) return sum;
  sum.com_B_m = moment / sum.mass_kg;
  for (const UrdfLink& link : model.links) {
    if (!link.inertial || link.inertial->mass_kg <= 0) continue;
    const Eigen::Isometry3d& X_BL = poses.find(link.name)->second;
    const Eigen::Vector3d from = X_BL * link.inertial->p_LC_m - sum.com_B_m;
    const Eigen::Matrix3d I_B = X_BL.linear() * link.inertial->I_C_kgm2 * X_BL.linear().transpose();
    sum.yaw_inertia_kgm2 += I_B(2, 2) + link.inertial->mass_kg * from.head<2>().squaredNorm();
  }
  if (!weightless.empty()) {
    sum.remarks.push_back("links with a shape but without a mass: " + weightless);
  }
  return sum;
}

}  // namespace gapfarm
