// A rigid polygon pushed across a table by a finger, in the plane, by explicit steps.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace planar {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kGravity_m_s2 = 9.81;
inline constexpr double kStep_s = 1e-4;
inline constexpr double kSlowSpeed_m_s = 1e-3;  // at which table friction is 0.7 of its limit
inline constexpr double kFingerRadius_m = 0.008;
inline constexpr double kNormalStiffness_n_m = 3e4, kTangentStiffness_n_m = 2e4;
inline constexpr double kNormalDamping_n_s_m = 20, kTangentDamping_n_s_m = 2;

struct Vec {
  double x = 0, y = 0;
};
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y}; }
inline Vec operator*(double k, Vec a) { return {k * a.x, k * a.y}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y; }
inline double cross(Vec a, Vec b) { return a.x * b.y - a.y * b.x; }
inline double norm(Vec a) { return std::hypot(a.x, a.y); }
inline Vec turn(double angle, Vec a) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * a.x - s * a.y, s * a.x + c * a.y};
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ULL + 1) {}
  double unit() {  // splitmix64
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return (static_cast<double>((z ^ (z >> 31)) >> 11) + 0.5) / 9007199254740992.0;
  }
  double uniform(double lo, double hi) { return lo + (hi - lo) * unit(); }
  double normal(double sd) {
    const double r = std::sqrt(-2 * std::log(unit()));
    return sd * r * std::cos(2 * kPi * unit());
  }

 private:
  std::uint64_t state_;
};

// What differs from a plain world; neutral as they stand.
using Values = std::map<std::string, double>;
inline Values neutral() {
  return {{"friction_anisotropy.ratio", 1},
          {"friction_anisotropy.direction", 0},
          {"friction_speed.slope", 0},
          {"friction_patch.ratio", 1},
          {"friction_patch.x", 0},
          {"friction_patch.y", 0},
          {"friction_patch.radius", 0},
          {"table_tilt.angle", 0},
          {"table_tilt.direction", 0},
          {"com_offset.x", 0},
          {"com_offset.y", 0},
          {"pressure_distribution.stretch", 0},
          {"pressure_distribution.direction", 0},
          {"finger_compliance.compliance", 0},
          {"placement_bias.x", 0},
          {"placement_bias.y", 0},
          {"placement_bias.angle", 0},
          {"camera_aspect.ratio", 1},
          {"camera_distortion.k1", 0},
          {"camera_distortion.x", 0},
          {"camera_distortion.y", 0},
          {"marker_offset.x", 0},
          {"marker_offset.y", 0},
          {"frame_offset.x", 0},
          {"frame_offset.y", 0},
          {"pose_scale.ratio", 1}};
}

struct World {
  Values effect = neutral();
  double table_friction = 0.3, finger_friction = 0.3;
  double at(const char* key) const { return effect.at(key); }
};

struct Shape {
  const char* name;
  std::vector<Vec> corners;  // counter-clockwise, from the centroid
  double mass_kg;
  double gyration_m2 = 0;
  double rim = 0;  // pressure grows with the squared radius: its share at the mean square
};

struct GaussPoint {
  Vec p;  // from the centroid
  double load = 0;
};

inline Vec middle_of(const std::vector<Vec>& corners) {
  Vec sum;
  double area = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec a = corners[i], b = corners[(i + 1) % corners.size()];
    sum = sum + cross(a, b) * (a + b);
    area += 3 * cross(a, b);
  }
  return 1 / area * sum;
}

inline void mesh_triangle(Vec a, Vec b, Vec c, int depth, std::vector<GaussPoint>& points) {
  if (depth > 0) {
    const Vec ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
    mesh_triangle(a, ab, ca, depth - 1, points);
    mesh_triangle(ab, b, bc, depth - 1, points);
    mesh_triangle(ca, bc, c, depth - 1, points);
    mesh_triangle(ab, bc, ca, depth - 1, points);
    return;
  }
  const double third = cross(b - a, c - a) / 6;
  points.push_back({(2.0 / 3) * a + (1.0 / 6) * b + (1.0 / 6) * c, third});
  points.push_back({(1.0 / 6) * a + (2.0 / 3) * b + (1.0 / 6) * c, third});
  points.push_back({(1.0 / 6) * a + (1.0 / 6) * b + (2.0 / 3) * c, third});
}

// Loads that sum to 1 and have their centre at `com`: the pressure times a plane, nowhere below 0.
inline std::vector<GaussPoint> pressed(const Shape& shape, const World& world, Vec com) {
  std::vector<GaussPoint> points;
  for (std::size_t i = 0; i < shape.corners.size(); ++i) {
    mesh_triangle({}, shape.corners[i], shape.corners[(i + 1) % shape.corners.size()], 1, points);
  }
  for (GaussPoint& g : points) {
    const double square = dot(g.p, g.p) / shape.gyration_m2;
    g.load *= std::max(0.0, 1 + shape.rim * (square - 1));
  }
  const double stretch = world.at("pressure_distribution.stretch");
  const double direction = world.at("pressure_distribution.direction");
  for (GaussPoint& g : points) {
    const Vec q = turn(-direction, g.p);
    g.p = turn(direction, {std::exp(stretch / 2) * q.x, std::exp(-stretch / 2) * q.y});
  }
  for (int round = 0; round < 20; ++round) {
    double sum = 0, xx = 0, xy = 0, yy = 0;
    Vec mean;
    for (const GaussPoint& g : points) sum += g.load;
    for (GaussPoint& g : points) g.load /= sum;
    for (const GaussPoint& g : points) mean = mean + g.load * g.p;
    for (const GaussPoint& g : points) {
      const Vec d = g.p - mean;
      xx += g.load * d.x * d.x;
      xy += g.load * d.x * d.y;
      yy += g.load * d.y * d.y;
    }
    const Vec off = com - mean;
    const double det = xx * yy - xy * xy;
    const Vec slope = {(yy * off.x - xy * off.y) / det, (xx * off.y - xy * off.x) / det};
    for (GaussPoint& g : points) g.load *= std::max(0.0, 1 + dot(slope, g.p - mean));
  }
  return points;
}

struct Pose2 {
  Vec p;
  double angle = 0;
};

// The nearest point of the outline, the way out of it there, and the distance, below 0 inside.
struct Nearest {
  Vec point, out;
  double distance = 0;
};

inline Nearest nearest(const std::vector<Vec>& corners, Vec q) {
  Nearest best;
  best.distance = 1e9;
  bool inside = true;
  Nearest least;
  least.distance = -1e9;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec a = corners[i], side = corners[(i + 1) % corners.size()] - a;
    const Vec out = 1 / norm(side) * Vec{side.y, -side.x};
    const double height = dot(out, q - a);
    if (height > 0) inside = false;
    if (height > least.distance) least = {q - height * out, out, height};
    const double share = std::clamp(dot(side, q - a) / dot(side, side), 0.0, 1.0);
    const Vec foot = a + share * side;
    const double distance = norm(q - foot);
    if (distance < best.distance)
      best = {foot, 1 / std::max(distance, 1e-12) * (q - foot), distance};
  }
  return inside ? least : best;
}

struct PushPlan {
  std::size_t shape = 0;
  Pose2 start;  // as it should be put down
  Vec from, to;
  double speed_m_s = 0.1;
};

// One push, from where the piece truly lies to where it comes to rest.
class Simulation {
 public:
  Simulation(const Shape& shape, const World& world, Vec load_centre)
      : shape_(shape),
        world_(world),
        com_(Vec{world.at("com_offset.x"), world.at("com_offset.y")}),
        points_(pressed(shape, world, com_ + load_centre)) {
    const double tilt = world.at("table_tilt.angle"), toward = world.at("table_tilt.direction");
    table_.friction_n = world.table_friction * shape.mass_kg * kGravity_m_s2 * std::cos(tilt);
    table_.pull = kGravity_m_s2 * std::sin(tilt) * Vec{std::cos(toward), std::sin(toward)};
    table_.ratio = world.at("friction_anisotropy.ratio");
    table_.grain = turn(world.at("friction_anisotropy.direction"), {1, 0});
    table_.slope = world.at("friction_speed.slope");
    table_.patch = world.at("friction_patch.ratio");
    table_.patch_at = {world.at("friction_patch.x"), world.at("friction_patch.y")};
    table_.radius = world.at("friction_patch.radius");
    stiffness_n_m_ = 1 / (1 / kNormalStiffness_n_m + world.at("finger_compliance.compliance"));
  }

  Pose2 run(Pose2 start, const PushPlan& plan) {
    com_at_ = start.p + turn(start.angle, com_);
    angle_ = start.angle;
    const Vec heading = plan.to - plan.from;
    const double length = norm(heading), end_s = length / plan.speed_m_s;
    const Vec finger_velocity = plan.speed_m_s / length * heading;
    bool moved = false;
    for (long k = 0; k * kStep_s < end_s + 3; ++k) {
      const double t = k * kStep_s;
      const bool goes = t < end_s;
      finger_ = plan.from + std::min(t, end_s) * finger_velocity;
      if (!moved && clearance() > 2e-3) {
        if (!goes) break;
        k += 9;  // far away: nothing happens
        continue;
      }
      moved = true;
      step(goes ? finger_velocity : Vec{});
      if (!goes && norm(velocity_) < 4e-4 && std::abs(spin_) * 0.05 < 4e-4) break;
    }
    return {com_at_ - turn(angle_, com_), angle_};
  }

 private:
  double clearance() const {
    return nearest(shape_.corners, turn(-angle_, finger_ - com_at_) + com_).distance -
           kFingerRadius_m;
  }

  void add_table(Vec& force, double& moment) const {
    const double along = 1 / std::sqrt(table_.ratio), across = std::sqrt(table_.ratio);
    const double c = std::cos(angle_), s = std::sin(angle_);
    for (const GaussPoint& g : points_) {
      const Vec d = g.p - com_;
      const Vec r = {c * d.x - s * d.y, s * d.x + c * d.y};
      const Vec u = {velocity_.x - spin_ * r.y, velocity_.y + spin_ * r.x};
      const double speed2 = dot(u, u);
      double k = table_.friction_n * g.load / std::sqrt(speed2 + kSlowSpeed_m_s * kSlowSpeed_m_s);
      if (table_.slope != 0) k *= std::max(0.05, 1 + table_.slope * std::sqrt(speed2));
      if (table_.patch != 1 && norm(com_at_ + r - table_.patch_at) < table_.radius) {
        k *= table_.patch;
      }
      // Each direction of the grain has a friction of its own.
      const double a = along * dot(table_.grain, u), b = across * cross(table_.grain, u);
      const Vec f = -k * (a * table_.grain + b * Vec{-table_.grain.y, table_.grain.x});
      force = force + f;
      moment += cross(r, f);
    }
  }

  void add_finger(Vec finger_velocity, Vec& force, double& moment) {
    const Nearest near = nearest(shape_.corners, turn(-angle_, finger_ - com_at_) + com_);
    const double depth = kFingerRadius_m - near.distance;
    if (depth <= 0) {
      bristle_ = 0;
      return;
    }
    const Vec out = turn(angle_, near.out), arm = turn(angle_, near.point - com_);
    const Vec material = velocity_ + spin_ * Vec{-arm.y, arm.x};
    const Vec slip = material - finger_velocity;
    const double softer = std::sqrt(stiffness_n_m_ / kNormalStiffness_n_m);
    const double pressed_n =
        std::max(0.0, stiffness_n_m_ * depth + softer * kNormalDamping_n_s_m * dot(slip, out));
    const Vec left = {-out.y, out.x};
    const double aside = dot(slip, left);
    bristle_ += aside * kStep_s;
    double held_n = -kTangentStiffness_n_m * bristle_ - kTangentDamping_n_s_m * aside;
    const double most_n = world_.finger_friction * pressed_n;
    if (std::abs(held_n) > most_n) {
      held_n = std::copysign(most_n, held_n);
      bristle_ = -held_n / kTangentStiffness_n_m;
    }
    const Vec f = -pressed_n * out + held_n * left;
    force = force + f;
    moment += cross(arm, f);
  }

  void step(Vec finger_velocity) {
    Vec force;
    double moment = 0;
    add_table(force, moment);
    add_finger(finger_velocity, force, moment);
    velocity_ = velocity_ + kStep_s * (1 / shape_.mass_kg * force + table_.pull);
    spin_ += kStep_s * moment / (shape_.mass_kg * shape_.gyration_m2);
    com_at_ = com_at_ + kStep_s * velocity_;
    angle_ += kStep_s * spin_;
  }

  struct Table {
    double friction_n = 0, ratio = 1, slope = 0, patch = 1, radius = 0;
    Vec pull, grain, patch_at;
  };

  const Shape& shape_;
  const World& world_;
  Table table_;
  double stiffness_n_m_ = kNormalStiffness_n_m;
  Vec com_;
  std::vector<GaussPoint> points_;
  Vec com_at_, velocity_, finger_;
  double angle_ = 0, spin_ = 0, bristle_ = 0;
};

}  // namespace planar
