// How often a name was right, as counted on sealed cases (docs/diagnosis.md).
#pragma once

namespace gapfarm {

// That an effect that gained `gain` nats beyond luck, where `least_gain` names one, is there, or
// one of its aliases: grows with the gain, and stays below 1 by what the counts leave open.
double confidence_of(double gain, double least_gain);

// The same of what the sanity stage names.
double sanity_confidence();

}  // namespace gapfarm
