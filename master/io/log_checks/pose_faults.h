// In which ways the poses of a log are the wrong way round or in another unit, and put right.
#pragma once

#include <cmath>

#include "common/pose/pose.h"

namespace gapfarm {

struct PoseFault {
  const char* name;
  const char* text;
  const char* remedy;
  double metres;       // a logged length
  double x_x, x_y;     // x put right, of x and y as logged
  double y_x, y_y;     // and y
  double sense, turn;  // of headings; rad

  Pose put_right(const Pose& X) const {
    return {metres * (x_x * X.x + x_y * X.y), metres * (y_x * X.x + y_y * X.y),
            sense * X.theta + turn};
  }
};

inline constexpr PoseFault kPoseFaults[] = {
    {"unit_error", "These look like centimetres.", "Multiply x and y by 0.01.", 0.01, 1, 0, 0, 1, 1,
     0},
    {"unit_error", "These look like millimetres.", "Multiply x and y by 0.001.", 0.001, 1, 0, 0, 1,
     1, 0},
    {"sides_swapped", "What should turn left turns right.",
     "Exchange left and right in the commands, or mirror the poses.", 1, 1, 0, 0, -1, -1, 0},
    {"heading_flipped", "Headings grow the other way round than turns do.", "Negate theta.", 1, 1,
     0, 0, 1, -1, 0},
    {"axis_mirrored", "One axis points the other way than headings say.", "Negate x or y.", 1, 1, 0,
     0, -1, 1, 0},
    {"axis_mirrored", "One axis points the other way than headings say.", "Negate x or y.", 1, -1,
     0, 0, 1, 1, 0},
    {"axes_swapped", "x and y are exchanged.", "Exchange x and y.", 1, 0, 1, 1, 0, 1, 0},
    {"heading_turned", "Headings are half a turn off.", "Add pi to theta, or set marker.yaw.", 1, 1,
     0, 0, 1, 1, M_PI},
    {"heading_turned", "Headings are a quarter turn off.", "Add pi/2 to theta, or set marker.yaw.",
     1, 1, 0, 0, 1, 1, M_PI / 2},
    {"heading_turned", "Headings are a quarter turn off.",
     "Subtract pi/2 from theta, or set marker.yaw.", 1, 1, 0, 0, 1, 1, -M_PI / 2}};

}  // namespace gapfarm
