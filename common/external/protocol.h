// What gapfarm and a simulator or an objective of the user's say to one another: a line of JSON
// each way (docs/external.md, docs/objective.md).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/parameters/external.h"
#include "common/pose/pose.h"
#include "common/recordings/run.h"

namespace gapfarm {

inline constexpr int kExternalProtocol = 1;

struct ExternalSide {
  double speed = 0;  // share of the speed at full duty, effects and noise included
  double lag_s = 0;
  double dead_travel_m = 0;
};

struct ExternalFloor {
  double tilt_rad = 0, tilt_direction_rad = 0;
  double nap_strength = 0, nap_direction_rad = 0;
  double rolling_resistance = 0;
  double patch_x_m = 0, patch_y_m = 0, patch_radius_m = 0, patch_ratio = 1;
};

// One command from rest to rest, in the start frame (x ahead, y left); of an objective only the
// values and the seed count.
struct ExternalRequest {
  std::uint64_t id = 0;
  const ExternalDeclaration* declaration = nullptr;  // says what the program takes
  std::vector<double> values;                        // one a declared parameter
  ExternalSide left, right;
  double duration_s = 0;
  double interval_s = 0;  // between the poses of the path; 0: none wanted
  ExternalFloor floor;
  std::uint32_t seed = 0;
  std::vector<std::string> objectives = {};  // what is wanted in place of one value; none: that
};

// The commands of a run, in the frame of its first pose.
struct ExternalRunRequest {
  std::uint64_t id = 0;
  const ExternalDeclaration* declaration = nullptr;
  std::vector<double> values;  // one a declared parameter
  double start_s = 0;          // on the commands' clock, and how fast it is then
  double speed_m_s = 0, turn_rad_s = 0;
  std::vector<CommandRow> commands;
  std::span<const double> times_s;  // at which poses are wanted; ascending, none before the start
};

struct ExternalSample {
  double t_s = 0;
  Pose X_SB;
};

struct ExternalAnswer {
  bool diverged = false;  // or an objective that has no value
  std::string message;    // why it did; an objective's notes
  Pose X_SE;
  std::vector<ExternalSample> path;
  double rest_time_s = 0;
  // Of an objective.
  double value = 0;            // of several objectives the first
  std::vector<double> values;  // one an objective that was asked for
  double violation = 0;  // sum of the positive violations; more than 0: the value does not count
};

struct ExternalRunAnswer {
  bool diverged = false;
  std::string message;      // of a simulation that did
  std::vector<Pose> poses;  // one a time
};

// The line that begins a conversation; the program answers with what it declares.
std::string hello_line();
// Errors: no JSON, another version of the protocol, a parameter that check_declaration() refuses,
// an input that is none, a condition on no earlier whole number or choice.
Result<ExternalDeclaration> parse_declaration(const std::string& line, bool objective = false);

// A program as a problem has it: how it is started, what it reported of itself, the table of that.
struct ExternalProgram {
  ExternalCommand command;
  std::string introduction;  // the line
  ExternalTable table;
};

// Errors: no words, parse_declaration()'s.
Result<std::shared_ptr<const ExternalProgram>> make_external_program(ExternalCommand command,
                                                                     std::string introduction,
                                                                     bool objective);

std::string request_line(const ExternalRequest& request);
// Errors: no JSON, the answer to another question, no pose, numbers that are not finite, a place
// farther than kGreatestCoordinate_m, a path that was asked for and is not there.  An objective's
// number that is not finite is no error: it has no value.
Result<ExternalAnswer> parse_answer(const std::string& line, const ExternalRequest& request);
std::string request_line(const ExternalRunRequest& request);
// Errors: as above; not a pose a time.
Result<ExternalRunAnswer> parse_answer(const std::string& line, const ExternalRunRequest& request);

}  // namespace gapfarm
