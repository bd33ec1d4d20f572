// A simulator for gapfarm by MuJoCo (docs/external.md): a two-wheeler with ball casters.
//   c++ -std=c++20 -O2 bridge.cc -lmujoco -o bridge && ./bridge two_wheeler.xml
// With --runs it follows the velocity commands of logged runs instead of single commands from rest.
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

namespace {

using Json = nlohmann::json;

constexpr double kWheelRadius_m = 0.03;
constexpr double kRest_m_s = 1e-3;
constexpr double kLongestRest_s = 3;
constexpr double kSettle_s = 0.2;  // the model is put down a little over the floor

Json parameter(const char* key, const char* unit, double lower, double upper, double nominal,
               bool log, const char* summary) {
  return {{"key", key},         {"unit", unit}, {"lower", lower},    {"upper", upper},
          {"nominal", nominal}, {"log", log},   {"summary", summary}};
}

Json declaration() {
  return {{"gapfarm", 1},
          {"name", "two-wheeler in MuJoCo"},
          {"inputs", {"lag", "path"}},
          {"parameters",
           {parameter("full_speed", "m/s", 0.05, 0.6, 0.3, true, "of a wheel's rim at full duty"),
            parameter("track", "m", 0.04, 0.3, 0.1, true, "wheel to wheel"),
            parameter("friction", "-", 0.05, 2, 0.8, true, "of wheels and floor"),
            parameter("chassis_mass", "kg", 0.05, 2, 0.3, true, "without wheels")}}};
}

Json declaration_of_runs() {
  return {
      {"gapfarm", 1},
      {"name", "two-wheeler in MuJoCo, following runs"},
      {"channels", {"v", "omega"}},
      {"parameters",
       {parameter("left_gain", "-", 0.5, 1.5, 1, false, "of the left wheel's speed"),
        parameter("right_gain", "-", 0.5, 1.5, 1, false, "of the right wheel's speed"),
        parameter("track", "m", 0.04, 1, 0.1, true, "wheel to wheel"),
        parameter("believed_track", "m", 0.04, 1, 0.1, true, "what the controller takes it for"),
        parameter("lag", "s", 0.001, 1, 0.05, true, "time constant of the wheels' speeds"),
        parameter("friction", "-", 0.05, 2, 0.8, true, "of wheels and floor"),
        parameter("chassis_mass", "kg", 0.05, 20, 0.3, true, "without wheels")}}};
}

class TwoWheeler {
 public:
  explicit TwoWheeler(mjModel* model) : m_(model), d_(mj_makeData(model)) {
    nominal_mass_ = m_->body_mass[body("chassis")];
    std::copy_n(m_->body_inertia + 3 * body("chassis"), 3, nominal_inertia_);
  }
  ~TwoWheeler() {
    mj_deleteData(d_);
    mj_deleteModel(m_);
  }
  TwoWheeler(const TwoWheeler&) = delete;
  TwoWheeler& operator=(const TwoWheeler&) = delete;

  Json drive(const Json& task) {
    build(task["parameters"]);
    mj_resetData(m_, d_);
    while (d_->time < kSettle_s) mj_step(m_, d_);
    const double begun = d_->time, duration = task["duration"];
    const double origin[3] = {d_->qpos[0], d_->qpos[1], heading()};
    const double interval = task.value("interval", 0.0);
    const double longest = begun + duration + kLongestRest_s + 10 * longest_lag(task);
    Json path = Json::array();
    double speed[2] = {0, 0};
    for (; d_->time < longest; mj_step(m_, d_)) {
      const double t = d_->time - begun;
      if (interval > 0 && t >= interval * static_cast<double>(path.size()) - 1e-9) {
        path.push_back(sample(t, origin));
      }
      command(task["left"], t < duration, &speed[0]);
      command(task["right"], t < duration, &speed[1]);
      d_->ctrl[0] = speed[0] * full_speed_ / kWheelRadius_m;
      d_->ctrl[1] = speed[1] * full_speed_ / kWheelRadius_m;
      if (t > duration && at_rest()) break;
    }
    const Json end = sample(d_->time - begun, origin);
    if (!std::isfinite(end[1].get<double>() + end[2].get<double>() + end[3].get<double>())) {
      return {{"id", task["id"]}, {"outcome", "diverged"}, {"message", "not finite"}};
    }
    path.push_back(end);
    return {{"id", task["id"]},
            {"pose", {end[1], end[2], end[3]}},
            {"path", interval > 0 ? path : Json::array()},
            {"rest", std::max(0.0, d_->time - begun - duration)}};
  }

  // Begins at rest, whatever the run does: [runs] run_in has the first window begin later.
  Json follow(const Json& task) {
    const Json& p = task["parameters"];
    build(p);
    mj_resetData(m_, d_);
    while (d_->time < kSettle_s) mj_step(m_, d_);
    const double start = task["start"]["t"], begun = d_->time;
    const double origin[3] = {d_->qpos[0], d_->qpos[1], heading()};
    const double keep = std::exp(-m_->opt.timestep / p["lag"].get<double>());
    const double half = p["believed_track"].get<double>() / 2;
    const double gain[2] = {p["left_gain"], p["right_gain"]};
    const Json& commands = task["commands"];
    double speed[2] = {0, 0}, v = 0, omega = 0;
    std::size_t row = 0;
    Json poses = Json::array();
    for (const Json& wanted : task["times"]) {
      for (; d_->time - begun < wanted.get<double>() - start; mj_step(m_, d_)) {
        for (; row < commands.size() && commands[row][0] <= start + d_->time - begun; ++row) {
          v = commands[row][1];
          omega = commands[row][2];
        }
        for (int side = 0; side < 2; ++side) {
          const double goal = gain[side] * (v + (side == 0 ? -1 : 1) * omega * half);
          speed[side] = goal + (speed[side] - goal) * keep;
          d_->ctrl[side] = speed[side] / kWheelRadius_m;
        }
      }
      Json pose = sample(0, origin);
      pose.erase(0);
      for (const Json& number : pose) {
        if (!std::isfinite(number.get<double>())) {
          return {{"id", task["id"]}, {"outcome", "diverged"}, {"message", "not finite"}};
        }
      }
      poses.push_back(std::move(pose));
    }
    return {{"id", task["id"]}, {"poses", std::move(poses)}};
  }

 private:
  int body(const char* name) const { return mj_name2id(m_, mjOBJ_BODY, name); }
  int geom(const char* name) const { return mj_name2id(m_, mjOBJ_GEOM, name); }

  void build(const Json& p) {
    full_speed_ = p.value("full_speed", 1.0);
    m_->body_pos[3 * body("left") + 1] = p["track"].get<double>() / 2;
    m_->body_pos[3 * body("right") + 1] = -p["track"].get<double>() / 2;
    for (const char* name : {"floor", "left", "right"}) {
      m_->geom_friction[3 * geom(name)] = p["friction"];
    }
    const double scale = p["chassis_mass"].get<double>() / nominal_mass_;
    m_->body_mass[body("chassis")] = nominal_mass_ * scale;
    for (int i = 0; i < 3; ++i) {
      m_->body_inertia[3 * body("chassis") + i] = nominal_inertia_[i] * scale;
    }
    mj_setConst(m_, d_);
  }

  void command(const Json& side, bool runs, double* speed) const {
    const double goal = runs ? side["speed"].get<double>() : 0;
    const double lag = side.value("lag", 0.0);
    *speed = goal + (*speed - goal) * (lag > 0 ? std::exp(-m_->opt.timestep / lag) : 0);
  }
  static double longest_lag(const Json& task) {
    return std::max(task["left"].value("lag", 0.0), task["right"].value("lag", 0.0));
  }

  double heading() const {
    const double* q = d_->qpos + 3;
    return std::atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
  }
  // [t, x, y, theta] in the frame of the start.
  Json sample(double t, const double origin[3]) const {
    const double x = d_->qpos[0] - origin[0], y = d_->qpos[1] - origin[1];
    const double c = std::cos(origin[2]), s = std::sin(origin[2]);
    return {t, c * x + s * y, c * y - s * x,
            std::remainder(heading() - origin[2], 2 * std::acos(-1.0))};
  }
  bool at_rest() const {
    return std::hypot(d_->qvel[0], d_->qvel[1]) + 0.05 * std::abs(d_->qvel[5]) < kRest_m_s;
  }

  mjModel* m_;
  mjData* d_;
  double nominal_mass_ = 0, nominal_inertia_[3] = {0, 0, 0};
  double full_speed_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  const bool runs = argc == 3 && std::string(argv[2]) == "--runs";
  char error[1000] = "";
  mjModel* model = argc == 2 || runs ? mj_loadXML(argv[1], nullptr, error, sizeof error) : nullptr;
  if (model == nullptr) {
    std::cerr << "bridge: expected a model file, and --runs or nothing: " << error << "\n";
    return 2;
  }
  TwoWheeler robot(model);
  for (std::string line; std::getline(std::cin, line);) {
    const Json task = Json::parse(line);
    const bool asked = task.contains("id");
    std::cout << (runs    ? asked ? robot.follow(task) : declaration_of_runs()
                     : asked ? robot.drive(task)
                          : declaration())
              << std::endl;
  }
  return 0;
}
