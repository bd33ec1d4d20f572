#include "tests/unit/report/example_diagnosis.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/random/stream.h"

namespace gapfarm {
namespace {

struct Command {
  const char* name;
  double forward;  // m/s at full duty
  double turn;     // rad/s at full duty
};

constexpr std::array<Command, 6> kCommands = {{{"forward", 0.30, 0.0},
                                               {"backward", -0.29, 0.0},
                                               {"turn_ccw", 0.0, 2.1},
                                               {"turn_cw", 0.0, -2.1},
                                               {"wide_ccw", 0.17, 1.1},
                                               {"wide_cw", 0.17, -1.1}}};
constexpr std::array<double, 3> kDurations = {0.6, 1.0, 1.5};
constexpr std::array<double, 3> kLevels = {0.5, 0.75, 1.0};
constexpr int kSessions = 3;
constexpr int kTrialsPerSession = 180;
const Eigen::Vector3d kNoise(0.0022, 0.0018, 0.011);  // m, m, rad

double score(const Eigen::Vector3d& r, const Eigen::Matrix3d& cov) {
  return -0.5 * (r.dot(cov.inverse() * r) + std::log(cov.determinant()) +
                 3 * std::log(2 * std::numbers::pi));
}

Pose driven(const Command& c, double level, double duration, double speed) {
  const double scale = level * duration * speed;
  return exp(Twist(c.forward * scale, 0, c.turn * scale));
}

// What the true robot does that the tuned base model does not know.
Pose truth(const Command& c, const DiagnosedTrial& t, bool with_effects) {
  if (!with_effects) return driven(c, t.level, t.duration_s, 1);
  const double sag = 1.05 - 0.006 * t.session_time_s / 60;
  const double along = 0.009 * std::cos(t.X_WS.theta - 0.7) * t.duration_s;
  const double across = -0.007 * std::sin(t.X_WS.theta - 0.7) * t.duration_s;
  return driven(c, t.level, t.duration_s, sag) * Pose{along, across, 0};
}

DiagnosedTrial example_trial(Stream& stream, int session, int i, Pose& X_WR, bool with_effects) {
  DiagnosedTrial t;
  const Command& c = kCommands[static_cast<std::size_t>(stream.uniform() * 6)];
  t.session = "charge-" + std::to_string(session + 1);
  t.trial = i;
  t.command = c.name;
  t.session_time_s = 5.2 * i + stream.uniform();
  t.duration_s = kDurations[static_cast<std::size_t>(stream.uniform() * 3)];
  t.level = kLevels[static_cast<std::size_t>(stream.uniform() * 3)];
  t.place_in_run = i % 30;
  t.held_out = i % 5 == 0;
  t.X_WS = X_WR;
  const Eigen::Vector3d noise(kNoise.x() * stream.normal(), kNoise.y() * stream.normal(),
                              kNoise.z() * stream.normal());
  Pose true_end = truth(c, t, with_effects);
  if (with_effects && X_WR.y > 1.1) true_end = true_end * Pose{0.003, 0, 0};
  t.measured = true_end * Pose{noise.x(), noise.y(), noise.z()};
  t.tuned = driven(c, t.level, t.duration_s, 1);
  t.final_ = truth(c, t, with_effects);
  t.final_cov = kNoise.cwiseAbs2().asDiagonal();
  t.tuned_cov = with_effects ? Eigen::Matrix3d(Eigen::Vector3d(4.5e-5, 2e-5, 5e-4).asDiagonal())
                             : t.final_cov;
  t.tuned_residual = local_difference(t.tuned, t.measured);
  t.final_residual = local_difference(t.final_, t.measured);
  t.tuned_score = score(t.tuned_residual, t.tuned_cov);
  t.final_score = score(t.final_residual, t.final_cov);
  X_WR = X_WR * t.measured;
  if (std::hypot(X_WR.x - 0.8, X_WR.y - 0.7) > 0.9) {
    X_WR = {0.8 + 0.3 * stream.normal(), 0.7 + 0.3 * stream.normal(), X_WR.theta};
  }
  return t;
}

std::vector<DiagnosedTrial> example_trials(bool with_effects) {
  std::vector<DiagnosedTrial> trials;
  for (int session = 0; session < kSessions; ++session) {
    Stream stream({.run_seed = 11, .birth_id = static_cast<std::uint64_t>(session)});
    Pose X_WR{0.8, 0.7, 0.3};
    for (int i = 0; i < kTrialsPerSession; ++i) {
      trials.push_back(example_trial(stream, session, i, X_WR, with_effects));
    }
  }
  return trials;
}

void add_inputs(Diagnosis& d) {
  d.provenance = {{"trials", "540 in 3 sessions: logs/charge-1.csv, charge-2.csv, charge-3.csv"},
                  {"data hash", "b1f6a0c92d5f4c2f8e6a7d3b90c4e512"},
                  {"base model", "run/base/model.toml, tuned in 41 generations on the same log"},
                  {"held out", "every fifth block of 6 trials, 108 trials"},
                  {"seed", "1"},
                  {"run stores", "out/base.sqlite, out/battery_sag.sqlite, out/floor_tilt.sqlite"},
                  {"program", "gapfarm 0.1.0, 5f2ac01b77d0e4c3"}};
  d.timing_s = {{"tune the base", 19.2}, {"floor", 0.3},  {"where", 0.9},
                {"screen", 6.4},         {"refit", 14.8}, {"report", 0.2}};
}

NamedEffect battery_sag() {
  NamedEffect e;
  e.name = "battery_sag";
  e.confidence = 0.98;
  e.parameters = {{"rate", 0.0061, 0.0056, 0.0067, "1/min"}};
  e.gap_before = 1.31;
  e.gap_after = 0.62;
  e.position_mm_after = 6.9;
  e.heading_mrad_after = 13.1;
  e.closed = 0.53;
  e.closed_lo = 0.46;
  e.closed_hi = 0.59;
  e.text = "Every command gets slower by 0.6 % a minute within each session.";
  return e;
}

NamedEffect floor_tilt() {
  NamedEffect e;
  e.name = "floor_tilt";
  e.aliases = {"floor_nap"};
  e.alias_reason =
      "Both push the robot along one direction of the room; their traces have |cos| 0.96.";
  e.confidence = 0.93;
  e.parameters = {{"angle", 0.021, 0.017, 0.026, "rad"}, {"direction", 0.71, 0.6, 0.83, "rad"}};
  e.gap_before = 0.62;
  e.gap_after = 0.14;
  e.position_mm_after = 3.4;
  e.heading_mrad_after = 12.3;
  e.closed = 0.36;
  e.closed_lo = 0.29;
  e.closed_hi = 0.44;
  e.text = "The robot drifts toward 41 degrees in the room, whatever it does.";
  return e;
}

std::vector<Screened> example_screening() {
  return {{"battery_sag", 402.1, 1e-7, "rate 0.0063 1/min", {}, ""},
          {"floor_tilt", 271.0, 1e-7, "angle 0.019 rad, direction 0.7 rad", {"floor_nap"}, ""},
          {"floor_nap", 263.8, 1e-7, "strength 0.014, direction 0.71 rad", {"floor_tilt"}, ""},
          {"camera_seam", 31.5, 0.012, "y at 0.81 m, offset 3.6 mm", {}, "too weak to name"},
          {"camera_aspect", 9.2, 0.21, "ratio 1.004", {"camera_distortion"}, ""},
          {"camera_distortion", 8.8, 0.24, "k1 0.02 1/m^2", {"camera_aspect"}, ""},
          {"com_offset", 3.4, 0.61, "x 1.2 mm, y -0.4 mm", {"marker_offset"}, ""},
          {"marker_offset", 3.1, 0.64, "x 0.9 mm, y 0.2 mm", {"com_offset"}, ""},
          {"motor_asymmetry", 0.6, 0.8, "ratio 0.0008", {}, ""},
          {"motor_lag", 0, 1, "", {}, "cannot be seen: rest poses alone were logged"},
          {"pose_quantisation", 0, 1, "", {}, ""}};
}

std::vector<ParameterRow> example_parameters() {
  return {
      {"contact_length", "m", "", "front to rear contact", 0.051, 0.02, 0.02, 0.023, 0.02, 0.14, "",
       ""},
      {"full_speed", "m/s", "", "of a tread at full duty", 0.271, 0.283, 0.281, 0.285, 0.05, 0.8,
       "", ""},
      {"friction",
       "-",
       "",
       "between treads and floor",
       0.5,
       0.5,
       {},
       {},
       0.05,
       2,
       "",
       "the data hardly move it"},
      {"battery_sag.rate",
       "1/min",
       "battery_sag",
       "share of the speed lost a minute",
       {},
       0.0061,
       0.0056,
       0.0067,
       -0.05,
       0.05,
       "",
       ""},
      {"floor_tilt.angle", "rad", "floor_tilt", "slope", {}, 0.021, 0.017, 0.026, 0, 0.3, "", ""},
      {"floor_tilt.direction",
       "rad",
       "floor_tilt",
       "downhill, world frame",
       {},
       0.71,
       0.6,
       0.83,
       -3.14159,
       3.14159,
       "",
       ""}};
}

std::vector<PathSample> straight(double reach_m) {
  std::vector<PathSample> path;
  for (int i = 0; i <= 10; ++i) path.push_back({0.1 * i, {reach_m * i / 10, 0, 0}});
  return path;
}

}  // namespace

Diagnosis example_diagnosis() {
  Diagnosis d;
  d.verdict = Verdict::kEffectAndUnknown;
  d.headline = "The battery sags and the floor tilts; together they explain 89 % of the gap.";
  d.effects = {battery_sag(), floor_tilt()};
  d.gap = {1.31, 0.14, 0.0};
  d.position_mm = {10.7, 3.4, 2.9};
  d.heading_mrad = {22.6, 12.3, 11.0};
  d.where = {{"forward", "x", "trend", "time", 7.9, 0.49, 1e-9,
              "Forward travel falls steadily by 16 mm from the start of a session to its end."},
             {"all", "y", "trend", "start heading", 9.4, 0.33, 3e-8,
              "Sideways error swings once around as the start heading turns once around."},
             {"turn_ccw", "theta", "trend", "time", 34, 0.07, 4e-5,
              "Turns to the left fall short later in the session."},
             {"forward", "x", "bias", "", 3.1, 0.02, 0.03,
              "Forward ends 3 mm farther than predicted on average."}};
  d.unexplained = {{"all", "x", "trend", "start y", 3.7, 0.08, 0.004,
                    "Trials that begin beyond y = 0.8 m end 4 mm too far ahead."}};
  d.screening = example_screening();
  d.next = {
      {"Drive forward and backward, 1 s at full duty, from headings 41 and 221 degrees: a tilt "
       "helps one and hinders the other alike, a nap only hinders.",
       {"floor_tilt", "floor_nap"},
       48},
      {"Start turns on both sides of y = 0.8 m: a seam between cameras shows as a jump.",
       {"camera_seam"},
       60}};
  d.cautions = {"End poses only: motor_lag and pose_latency cannot be seen without paths.csv.",
                "Three sessions: the interval over sessions is wide."};
  d.trials = example_trials(true);
  d.action = "Charge before a session, or paste the parameters below into your config.";
  d.findings = {d.effects[0].text, d.effects[1].text};
  d.parameters = example_parameters();
  d.correlations = {{"full_speed", "battery_sag.rate", 0.93}};
  d.drives = {{7, "worst of all", {}, straight(0.3), straight(0.28)},
              {20, "median of all", straight(0.29), straight(0.3), straight(0.28)}};
  add_inputs(d);
  return d;
}

Diagnosis null_diagnosis() {
  Diagnosis d;
  d.verdict = Verdict::kNone;
  d.headline = "No effect of the catalogue shows: the tuned model is as good as these data.";
  d.gap = {0.01, 0.01, 0.0};
  d.position_mm = {2.9, 2.9, 2.8};
  d.heading_mrad = {11.1, 11.1, 11.0};
  d.screening = example_screening();
  for (Screened& s : d.screening) {
    s.gain *= 0.01;
    s.p = 0.5;
  }
  d.trials = example_trials(false);
  add_inputs(d);
  return d;
}

}  // namespace gapfarm
