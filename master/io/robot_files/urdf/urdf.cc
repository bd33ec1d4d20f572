#include "master/io/robot_files/urdf/urdf.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "common/base/constants.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/algebra.h"
#include "common/trials/text/csv.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {
namespace {

std::string at_line(const std::string& file, int line) {
  return file + ":" + std::to_string(line) + ": ";
}

// The one link that is nobody's child, when everything hangs together.
Status check_tree(UrdfModel& model) {
  std::map<std::string, const UrdfJoint*, std::less<>> above;
  std::set<std::string, std::less<>> names, joints;
  std::vector<std::string> known;
  for (const UrdfLink& link : model.links) {
    if (!names.insert(link.name).second) {
      return Error{at_line(model.file, link.line) + "found link " + quoted_word(link.name) +
                   " again, expected each name once; rename one of the two"};
    }
    known.push_back(link.name);
  }
  for (const UrdfJoint& joint : model.joints) {
    if (!joints.insert(joint.name).second) {
      return Error{at_line(model.file, joint.line) + "found joint " + quoted_word(joint.name) +
                   " again, expected each name once; rename one of the two"};
    }
    for (const std::string& end : {joint.parent, joint.child}) {
      if (names.count(end) == 0) {
        return Error{at_line(model.file, joint.line) + "joint " + quoted_word(joint.name) +
                     " names link " + quoted_word(end) + ", which the file does not have" +
                     suggestion(end, known)};
      }
    }
    if (!above.emplace(joint.child, &joint).second) {
      return Error{at_line(model.file, joint.line) + "found a second joint above link " +
                   quoted_word(joint.child) + ", expected one; a URDF is a tree"};
    }
  }
  for (const UrdfLink& link : model.links) {
    if (above.count(link.name) != 0) continue;
    if (!model.root.empty()) {
      return Error{at_line(model.file, link.line) + "found a second root link " +
                   quoted_word(link.name) + " beside " + quoted_word(model.root) +
                   ", expected one; join the two by a joint or remove one"};
    }
    model.root = link.name;
  }
  if (model.root.empty()) {
    return Error{at_line(model.file, 1) +
                 "found joints that run in a circle, expected one link that is nobody's child"};
  }
  return {};
}

std::optional<RoundShape> roundest(const std::vector<UrdfGeometry>& shapes,
                                   const Eigen::Isometry3d& X_BL) {
  std::optional<RoundShape> best;
  for (const UrdfGeometry& shape : shapes) {
    const bool ball = shape.shape == UrdfShape::kSphere;
    if (!ball && shape.shape != UrdfShape::kCylinder) continue;
    if (shape.radius_m <= 0) continue;
    // A cylinder shows its axis; a ball only when there is none.
    const bool better =
        !best || (best->ball && !ball) || (best->ball == ball && shape.radius_m > best->radius_m);
    if (!better) continue;
    const Eigen::Isometry3d X_BG = X_BL * shape.X_LG;
    RoundShape round;
    round.radius_m = shape.radius_m;
    if (!ball) round.width_m = shape.length_m;
    round.axis_B = X_BG.linear().col(2);
    round.centre_B_m = X_BG.translation();
    round.ball = ball;
    round.from = std::string(ball ? "sphere" : "cylinder") + ", line " + std::to_string(shape.line);
    best = round;
  }
  return best;
}

// Corners of what bounds the shape, in B; a cylinder's rims as sixteen points each.
std::vector<Eigen::Vector3d> hull_points(const Eigen::Isometry3d& X_BL, const UrdfGeometry& shape) {
  constexpr int kRim = 16;
  std::vector<Eigen::Vector3d> points;
  const Eigen::Isometry3d X_BG = X_BL * shape.X_LG;
  if (shape.shape == UrdfShape::kBox) {
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      points.push_back(X_BG * Eigen::Vector3d(0.5 * sign.cwiseProduct(shape.size_m)));
    }
  } else if (shape.shape == UrdfShape::kCylinder) {
    for (int i = 0; i < 2 * kRim; ++i) {
      const double angle = 2 * std::numbers::pi * (i / 2) / kRim;
      points.push_back(X_BG * Eigen::Vector3d(shape.radius_m * std::cos(angle),
                                              shape.radius_m * std::sin(angle),
                                              (i % 2 ? 0.5 : -0.5) * shape.length_m));
    }
  } else if (shape.shape == UrdfShape::kSphere) {
    for (int i = 0; i < kRim; ++i) {
      const double angle = 2 * std::numbers::pi * i / kRim;
      points.push_back(X_BG.translation() +
                       shape.radius_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
    }
    points.push_back(X_BG.translation() - shape.radius_m * Eigen::Vector3d::UnitZ());
  }
  return points;
}

double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a - o).x() * (b - o).y() - (a - o).y() * (b - o).x();
}

// Andrew's monotone chain.
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points) {
  std::ranges::sort(points, [](const auto& a, const auto& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  if (points.size() < 3) return points;
  std::vector<Eigen::Vector2d> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t start = hull.size();
    for (const Eigen::Vector2d& point : points) {
      while (hull.size() >= start + 2 && cross(hull[hull.size() - 2], hull.back(), point) <= 0) {
        hull.pop_back();
      }
      hull.push_back(point);
    }
    hull.pop_back();
    std::ranges::reverse(points);
  }
  return hull;
}

}  // namespace

const UrdfLink* UrdfModel::find_link(std::string_view wanted) const {
  return find_by(links, wanted, &UrdfLink::name);
}

const UrdfJoint* UrdfModel::joint_above(std::string_view link) const {
  return find_by(joints, link, &UrdfJoint::child);
}

Result<UrdfModel> parse_urdf(std::string_view text, const std::string& file) {
  Result<UrdfModel> model = read_urdf_xml(text, file);
  if (!model) return model;
  if (model->links.empty()) {
    return Error{at_line(file, 1) + "found no <link>, expected a robot's links and joints"};
  }
  RETURN_IF_ERROR(check_tree(*model));
  if (link_poses(*model).size() != model->links.size()) {
    return Error{
        at_line(file, 1) +
        "found links that hang on one another in a circle, expected all of them to hang on " +
        quoted_word(model->root)};
  }
  return model;
}

LinkPoses link_poses(const UrdfModel& model) {
  std::multimap<std::string_view, const UrdfJoint*> below;
  for (const UrdfJoint& joint : model.joints) below.emplace(joint.parent, &joint);
  LinkPoses poses;
  std::vector<std::string> open = {model.root};
  poses[model.root] = Eigen::Isometry3d::Identity();
  while (!open.empty()) {
    const std::string parent = std::move(open.back());
    open.pop_back();
    const auto [begin, end] = below.equal_range(parent);
    for (auto it = begin; it != end; ++it) {
      poses[it->second->child] = poses[parent] * it->second->X_PJ;
      open.push_back(it->second->child);
    }
  }
  return poses;
}

MassSum sum_masses(const UrdfModel& model, const LinkPoses& poses) {
  MassSum sum;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  std::vector<std::string> weightless;
  for (const UrdfLink& link : model.links) {
    if (!link.inertial) {
      if (!link.collisions.empty()) weightless.push_back("'" + link.name + "'");
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
    sum.remarks.push_back("links with a shape but without a mass: " + joined(weightless));
  }
  return sum;
}

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

std::optional<RoundShape> round_shape(const UrdfModel& model, const UrdfLink& link,
                                      const LinkPoses& poses) {
  const auto of = [&](const UrdfLink& l) {
    const Eigen::Isometry3d& X_BL = poses.find(l.name)->second;
    auto round = roundest(l.collisions, X_BL);
    return round ? round : roundest(l.visuals, X_BL);
  };
  if (auto round = of(link)) return round;
  for (const UrdfJoint& joint : model.joints) {
    if (joint.parent != link.name || joint.type != "fixed") continue;
    if (auto round = of(*model.find_link(joint.child))) return round;
  }
  return {};
}

Eigen::Vector3d lowest_point(const Eigen::Isometry3d& X_BL, const UrdfGeometry& shape) {
  const std::vector<Eigen::Vector3d> points = hull_points(X_BL, shape);
  if (points.empty()) return (X_BL * shape.X_LG).translation();
  double lowest = points.front().z();
  for (const Eigen::Vector3d& point : points) lowest = std::min(lowest, point.z());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const Eigen::Vector3d& point : points) {
    // Right angles are written as 1.57: a face that leans by that still lies on the floor.
    if (point.z() > lowest + 2e-4) continue;
    sum += point;
    ++count;
  }
  return sum / count;
}

std::vector<Eigen::Vector2d> outline(const Eigen::Isometry3d& X_BL, const UrdfGeometry& shape) {
  return convex_hull(
      mapped(hull_points(X_BL, shape),
             [](const Eigen::Vector3d& point) -> Eigen::Vector2d { return point.head<2>(); }));
}

}  // namespace gapfarm
