// Makes a push log of tangram pieces by a simulation that shares no code and no method with
// gapfarm's: explicit steps of 0.1 ms, friction regularised by speed at Gauss points of a mesh of
// the face, a finger of spring and damper with a bristle of friction.
//   c++ -std=c++20 -O2 tests/planar_push/make_log.cc -o make_log
//   ./make_log FOLDER SEED [effect.parameter=value ...]
// writes FOLDER/trials.csv and tips.csv; effects and parameters are those of docs/pushing.md.
// An even seed makes 95 pushes of which no two are alike, an odd one 19 pushes five times.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "planar.h"

namespace {

using namespace planar;  // NOLINT: a program of its own

constexpr int kPushes = 95, kRepeats = 5;

// A tangram whose square is 12 cm wide.
std::vector<Shape> tangram(Random& random) {
  const double s = 0.12, h = s * std::sqrt(2.0);
  std::vector<Shape> shapes = {
      {"square", {{0, 0}, {s, 0}, {s, s}, {0, s}}, 0.15},
      {"parallelogram", {{0, 0}, {h, 0}, {1.5 * h, h / 2}, {h / 2, h / 2}}, 0.15},
      {"triangle_s", {{0, 0}, {h, 0}, {h / 2, h / 2}}, 0.075},
      {"triangle_l", {{0, 0}, {2 * h, 0}, {h, h}}, 0.3}};
  for (Shape& shape : shapes) {
    const Vec middle = middle_of(shape.corners);
    for (Vec& corner : shape.corners) corner = corner - middle;
    std::vector<GaussPoint> points;
    for (std::size_t i = 0; i < shape.corners.size(); ++i) {
      mesh_triangle({}, shape.corners[i], shape.corners[(i + 1) % shape.corners.size()], 3, points);
    }
    double area = 0, moment = 0;
    for (const GaussPoint& g : points) area += g.load;
    for (const GaussPoint& g : points) moment += g.load * dot(g.p, g.p);
    shape.gyration_m2 = moment / area;
    shape.rim = random.uniform(-0.35, 0.5);
  }
  return shapes;
}

PushPlan drawn_push(const std::vector<Shape>& shapes, int number, Random& random) {
  PushPlan plan;
  plan.shape = static_cast<std::size_t>(number) % shapes.size();
  plan.start = {{random.uniform(0.3, 0.7), random.uniform(0.3, 0.7)}, random.uniform(-kPi, kPi)};
  const std::vector<Vec>& corners = shapes[plan.shape].corners;
  const auto side =
      static_cast<std::size_t>(random.uniform(0, static_cast<double>(corners.size())));
  const Vec a = corners[side], b = corners[(side + 1) % corners.size()];
  const Vec touch = a + random.uniform(0.15, 0.85) * (b - a);
  const Vec inward = 1 / norm(b - a) * Vec{a.y - b.y, b.x - a.x};
  const Vec heading = turn(random.uniform(-0.45, 0.45), inward);
  const Vec begin = touch - (0.02 + kFingerRadius_m) * heading;
  const auto to_world = [&](Vec p) { return plan.start.p + turn(plan.start.angle, p); };
  plan.from = to_world(begin);
  plan.to = to_world(begin + (0.02 + random.uniform(0.06, 0.2)) * heading);
  plan.speed_m_s = random.uniform(0.02, 0.12);
  return plan;
}

// What the camera says of a pose.
Pose2 seen(const World& world, const Pose2& X, Random& random) {
  const double root = std::sqrt(world.at("camera_aspect.ratio"));
  Vec p = X.p + turn(X.angle, {world.at("marker_offset.x"), world.at("marker_offset.y")});
  const Vec centre = {world.at("camera_distortion.x"), world.at("camera_distortion.y")};
  const Vec d = p - centre;
  p = centre + (1 + world.at("camera_distortion.k1") * dot(d, d)) * d;
  p = {p.x / root, p.y * root};
  p = world.at("pose_scale.ratio") * p;
  p = p + Vec{world.at("frame_offset.x"), world.at("frame_offset.y")};
  const double x = random.normal(5e-4), y = random.normal(5e-4);
  return {p + Vec{x, y}, std::remainder(X.angle + random.normal(5e-3), 2 * kPi)};
}

void write_log(const std::string& folder, std::uint64_t seed, World world) {
  Random random(seed);
  const std::vector<Shape> shapes = tangram(random);
  world.table_friction = random.uniform(0.2, 0.5);
  world.finger_friction = random.uniform(0.15, 0.6);
  std::ofstream trials(folder + "/trials.csv"), tips(folder + "/tips.csv");
  trials << "session,trial,object,x0,y0,theta0,x1,y1,theta1\n";
  tips << "session,trial,t,x,y\n";
  PushPlan plan;
  char line[256];
  for (int i = 0; i < kPushes; ++i) {
    const bool again = seed % 2 == 1 && i % kRepeats > 0;
    if (!again) plan = drawn_push(shapes, seed % 2 == 1 ? i / kRepeats : i, random);
    Pose2 put = plan.start;  // a hand misses
    put.p = put.p + Vec{random.normal(1e-3), random.normal(1e-3)};
    put.angle += random.normal(0.01);
    const Pose2 before = seen(world, put, random);
    put.p = put.p + Vec{world.at("placement_bias.x"), world.at("placement_bias.y")};
    put.angle += world.at("placement_bias.angle");
    // No two touchings of a table are alike.
    World now = world;
    now.finger_friction *= std::exp(random.normal(0.03));
    const Vec load_centre = {random.normal(3e-4), random.normal(3e-4)};
    const Shape& shape = shapes[plan.shape];
    const Pose2 after = seen(world, Simulation(shape, now, load_centre).run(put, plan), random);
    std::snprintf(line, sizeof line, "planar,%d,%s,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", i, shape.name,
                  before.p.x, before.p.y, before.angle, after.p.x, after.p.y, after.angle);
    trials << line;
    const double end_s = norm(plan.to - plan.from) / plan.speed_m_s;
    const int samples = static_cast<int>(std::ceil(end_s / 0.05));
    for (int k = 0; k <= samples; ++k) {
      const double share = static_cast<double>(k) / samples;
      const Vec p = plan.from + share * (plan.to - plan.from);
      std::snprintf(line, sizeof line, "planar,%d,%.5f,%.6f,%.6f\n", i, share * end_s, p.x, p.y);
      tips << line;
    }
  }
  if (!trials || !tips)
    throw std::runtime_error(folder + ": trials.csv and tips.csv cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: make_log FOLDER SEED [effect.parameter=value ...]\n");
    return 2;
  }
  try {
    World world;
    for (int i = 3; i < argc; ++i) {
      const std::string word = argv[i];
      const std::size_t equals = word.find('=');
      const auto found = world.effect.find(word.substr(0, equals));
      if (equals == std::string::npos || found == world.effect.end()) {
        throw std::runtime_error("'" + word + "' is no effect.parameter=value of pushes");
      }
      found->second = std::stod(word.substr(equals + 1));
    }
    write_log(argv[1], std::stoull(argv[2]), world);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "make_log: %s\n", e.what());
    return 1;
  }
  return 0;
}
