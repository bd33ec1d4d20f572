// Readers of the three kinds of bags.  All give the topics that serve ground robots as tables, and
// say what they left.  Errors: "FILE:BYTE: found ..., expected ...; remedy"; nothing is half-read.
#pragma once

#include "master/io/logs/byte_source.h"
#include "master/io/logs/log_table.h"

namespace gapfarm {

// ROS 1 bags 2.0 (wiki.ros.org/Bags/Format/2.0): chunks plain, bz2, lz4.
Result<Recording> read_ros1_bag(ByteSource& source, const std::string& file);
// MCAP (mcap.dev/spec): chunks plain, lz4, zstd; messages ros1 and cdr.
Result<Recording> read_mcap(ByteSource& source, const std::string& file);
// rosbag2's SQLite files; `path` on disk.
Result<Recording> read_db3(const std::string& path);

// Any log, recognised by its content.
Result<Recording> read_recording(const std::string& path);

}  // namespace gapfarm
