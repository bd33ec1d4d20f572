// How much more uncertain an effect's parameters are than its fit says.
#pragma once

#include <cstddef>

#include "common/math/normal.h"
#include "master/diagnose/study.h"

namespace gapfarm {

// Standard deviation, in the unit of table row `row`, of what the fit's linearisation cannot see:
// that another simulation of the same effect gives it another size, and that places are searched.
// `at` holds the effect's values; the effect gained `gain` nats.
double error_beyond_fit(const Study& study, const ParameterTable& table, std::size_t row,
                        const Overrides& at, double gain);

}  // namespace gapfarm
