// Which tables of a bag have the robot's poses in the world, and which only odometry's.
#pragma once

#include "master/io/logs/log_table.h"

namespace gapfarm {

// What wheels made up: by the frame of its poses, else by its type.
bool is_odometry(const LogTable& table);

// False of transforms between parts of the robot, and of a localiser's corrections.
bool shows_robot(const Recording& recording, const LogTable& table);

// Adds a table /tf:MAP:CHILD for transforms of odometry that a localiser corrects (MAP to
// odometry's frame): each with the last correction that was recorded.  None where these never
// change.
void add_localised(Recording& recording);

}  // namespace gapfarm
