// The first picture of the report: what the gap is made of, before and after.
#pragma once

#include <string>
#include <vector>

#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

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
