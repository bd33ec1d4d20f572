// The diagnosis as one self-contained page: no network, its own scripts and styles only.
#pragma once

#include <string>
#include <vector>

#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// The whole file, UTF-8.  It holds the diagnosis as JSON too (see script_safe() for how), plots it
// with scripts whose hashes its content security policy names, and reads as text without them.
// The same diagnosis gives the same bytes.
// `served`: by `gapfarm serve`.
std::string report_html(const Diagnosis& diagnosis, bool served = false);

enum class GapUnit { kNats, kMillimetres, kMilliradians };

struct GapPart {
  enum class Kind { kFloor, kUnexplained, kEffect };
  Kind kind = Kind::kFloor;
  std::string label;
  // In the split's unit.  Negative when adding the effect made held-out trials worse, which
  // lengthens the bar after, or when the final model does better than the floor: drawn as nothing.
  double amount = 0;
};

// tuned = floor + unexplained + every effect's part, exactly: an effect's part is how much the gap
// fell when it was added, in the order found, and the last one's reaches the final model.
struct GapSplit {
  GapUnit unit = GapUnit::kNats;
  double tuned = 0;
  double final_ = 0;
  std::vector<GapPart> parts;  // floor, unexplained, effects in order
};

// Where the steps of a unit were not measured for several effects, they share one part.
GapSplit split_gap(const Diagnosis& diagnosis, GapUnit unit);

// The section of the page.
std::string gap_split_html(const Diagnosis& diagnosis);

}  // namespace gapfarm
