// Importer of bbautotune's forward-motion runs: lines
//   x;y;theta;move(25.000000, 0.000000, 0.000000);x';y';theta'
// in centimetres and radians, one file a run.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/trials/trial.h"

namespace gapfarm {

// The text of one run as a session of that name; trials are numbered from 0, times, duties and
// durations are unknown.  Blanks around fields and in place of the last semicolon are accepted.
// Errors carry file:line:column; a move() other than (25, 0, 0) is one, since its meaning is not
// known.  A last line that breaks off was cut short with its logger: it is omitted with a note.
// Errors when `commands` has no "forward".
Result<TrialLog> parse_bbautotune(std::string_view text, const std::string& file,
                                  const std::string& session,
                                  std::span<const std::string> commands);

}  // namespace gapfarm
