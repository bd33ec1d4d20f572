// The numbers that steer the search for causes: each with its unit, meaning and origin
// (docs/diagnosis.md shows them).
#pragma once

#include <cstddef>

namespace gapfarm::infer {

// Degrees of freedom of Student's t by which trials are scored: three, the heaviest whose variance
// is finite, since a piece that slides off the finger in the simulation alone is no measure of
// the rest (Lange, Little and Taylor 1989 advise 3 to 5).
inline constexpr double kTail = 3;
// The least scale of the noise, over what the readings are known to have: noise below it would be a
// fit to chance.
inline constexpr double kLeastScale = 0.2;
// Standard deviation of an effect's prior, in sizes of a careless laboratory.
inline constexpr double kPriorSizes = 4;
// Where a parameter must be positive and its bound is 0: of its upper bound.
inline constexpr double kLeastShareOfRange = 0.005;
// A finite difference moves the ends by this many standard deviations, root mean square: large
// beside a contact's jumps, small beside its curvature.  Chosen on pushes of the tangram.
inline constexpr double kGoodMove = 1;
// The longest step, in units of a coordinate.
inline constexpr double kLongestStep = 3;
// Realised over promised gain between which slopes are trusted.
inline constexpr double kLeastTrust = 0.5, kMostTrust = 2;
// Nats: less is no progress.
inline constexpr double kSettledGain = 0.5;

// Nats below which a hypothesis is not followed: what a parameter or two gain by luck.
inline constexpr double kLeastPromise = 4;
// Observations from which on half of them do for the first steps.
inline constexpr std::size_t kManyObservations = 60;
// How many starts of a hypothesis are searched.
inline constexpr std::size_t kStartsKept = 1;
// And how many are tried from every base.
inline constexpr std::size_t kFewStarts = 16;
// Steps of the leaders, and of the finalists; before that every start has one, the better half
// one more, and so on.
inline constexpr int kMiddleSearch = 4, kLongSearch = 10;
// Predictions a dimension where slopes lie, as BOBYQA has a gene (docs/evidence/optimisers.md), and
// the first step, in units of a coordinate.
inline constexpr int kBlindSearch = 40;
inline constexpr double kBlindStep = 0.5;
// Hypotheses that go on.
inline constexpr std::size_t kLeaders = 5, kFinalists = 3;
// Standard errors by which a lead over an alternative, or a gain that is to stay, is no chance: one
// case in forty.
inline constexpr double kSureGain = 2;
// The same for a gain to be considered at all: a few observations carry it otherwise.  Against
// chance guards the least gain, which is calibrated on null logs over the whole catalogue.
inline constexpr double kLeastSure = 1;

}  // namespace gapfarm::infer
