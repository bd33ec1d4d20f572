// Faults of the file system, in this process: the calls that change files go through here instead
// of straight to the C library (io_faults.cc defines them), and one of them, or all from one on,
// can be made to fail.
#pragma once

#include <string>

namespace gapfarm {

struct IoFaults {
  // Counts the calls under `folder` from now on: open, write, fsync, truncate, rename, unlink and
  // mkdir, in all their forms.  No faults yet.
  static void watch(const std::string& folder);
  // The call of this index (from 0) under the folder fails with `error`, and with `for_good` every
  // later one, as if the disk had gone or the process had died.
  static void fail(const std::string& folder, long index, bool for_good, int error);
  // No counting and no faults.
  static void rest();
  // Since watch() or fail().
  static long calls();
  // What call failed first: "fdatasync run.sqlite-journal"; empty: none.
  static std::string failed();
};

}  // namespace gapfarm
