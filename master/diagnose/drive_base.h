// The base of a scenario of drives: what of it tuning may move, and what another value of it does.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/problem/problem.h"

namespace gapfarm {

// A base parameter that tuning moves, with a weak prior on the logarithm of its value: the data
// cannot distinguish some of them, and the prior keeps those where the config had them.
struct BaseParameter {
  std::size_t row = 0;
  double prior_log_sd = 1;
};

// A parameter of which no effect may claim what another value would do.
struct RetunedParameter {
  std::size_t row = 0;
  // Standard deviation of the prior: of its logarithm where `unit` is 0, else in such units.
  double prior_sd = 1;
  double unit = 0;
};

struct DriveBase {
  std::vector<BaseParameter> tuned;
  std::vector<std::size_t> kept;  // others with a value in Study::base
  std::vector<RetunedParameter> retuned;
  // Row of the speed at full duty.  Of a program's parameters tune_base() finds it, if there is
  // one.
  std::optional<std::size_t> speed;
  std::optional<std::size_t> mass_height;
};

// Of srv1, or of what the problem's program declares: of that, `genes` are tuned whose values are
// positive, all such parameters where the config searches none of the program's.
DriveBase drive_base(const Problem& problem, std::span<const Gene> genes);

}  // namespace gapfarm
