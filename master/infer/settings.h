// The numbers that steer a diagnosis: from where on something is named or believed (thresholds),
// how far is looked (budgets), and how large something may be beforehand (priors).
//
// Each has its unit, where it comes from, and what it decides, parted by bars; scripts/settings.py
// prints them as docs/evidence/settings.md.  `round` is a number of which no measurement is on
// record.  Steps of differences and grids, what keeps numbers finite and what fits on a page stand
// where they are used, tolerances of single values in the rows of these values.
#pragma once

#include <cstddef>

namespace gapfarm {

// -- Fits
// - | cited: Lange, Little and Taylor 1989 advise 3 to 5; the heaviest whose variance is finite |
// Degrees of freedom of Student's t by which trials are scored: a piece that slides off the finger
// in the simulation alone is no measure of the rest.
inline constexpr double kStudentTail = 3;
// noises of the readings | round | The least scale of the noise: below it would be a fit to
// chance.
inline constexpr double kLeastNoiseScale = 0.2;
// sizes of a careless laboratory | round | Standard deviation of an effect's prior.
inline constexpr double kPriorSizes = 4;
// upper bound | round | Least value of what must be positive and is bounded by 0.
inline constexpr double kLeastShareOfRange = 0.005;
// s.d. of ends | chosen: pushes of the tangram | What a finite difference moves the ends by, root
// mean square: large beside a contact's jumps, small beside its curvature.
inline constexpr double kGoodMove = 1;
// units of a coordinate | round | The longest step.
inline constexpr double kLongestStep = 3;
// - | round | Realised over promised gain up to which slopes are trusted, and down to its inverse.
inline constexpr double kMostTrust = 2;
// nats | derived: what one more parameter gains by luck | A step that gains less is the last.
inline constexpr double kSettledGain = 0.5;
// s.d. of the noise, units of a coordinate | round | Standard deviation of what is left open.
inline constexpr double kAsGoodAsFree = 100;
// s.d. | round | What is farther off counts linearly in fits (Huber 1964).
inline constexpr double kFarDeviations = 4;
// s.d. | round | Farther off no trial says what a slope, a late reading or a gap is about.
inline constexpr double kOutlierDeviations = 5;

// -- Contest
// nats | derived: what a parameter or two gain by luck | A hypothesis whose slopes promise less is
// not followed, slips that gain less are not fitted further.
inline constexpr double kLeastPromise = 4;
// observations | round | From so many on, half of them do for the first steps.
inline constexpr std::size_t kManyObservations = 60;
// starts | round | Of a hypothesis, that are tried from every base.
inline constexpr std::size_t kFewStarts = 16;
// steps | round | Of the leaders; before that every start has one, the better half one more, and
// so on.
inline constexpr int kMiddleSearch = 4;
// steps | round | Of the finalists.
inline constexpr int kLongSearch = 10;
// predictions a dimension | measured: as BOBYQA has a gene (docs/evidence/optimisers.md) | Where
// slopes lie.
inline constexpr int kBlindSearch = 40;
// units of a coordinate | round | Its first step.
inline constexpr double kBlindStep = 0.5;
// hypotheses | round | That go on with all observations; of a ground robot, values that are
// predicted held out.
inline constexpr std::size_t kLeaders = 5;
// hypotheses, patches, headings | round | That go on to the end.
inline constexpr std::size_t kFinalists = 3;
// s.e., tolerances | derived: one case in forty | A lead over an alternative or a value that moved
// is no chance from here on.
inline constexpr double kSureGain = 2;
// s.e. | round | The same for a gain to be considered at all, and to stay: a few observations carry
// it otherwise. Against chance guards the least gain.
inline constexpr double kLeastSure = 1;
// effects | chosen: a robot of which four values were wrong | That are named of one log.
inline constexpr std::size_t kMostNames = 4;
// parts of a log | cited: five to ten are customary (Hastie, Tibshirani and Friedman 2009, 7.10) |
// That are held out in turn.
inline constexpr int kFolds = 5;
// parts of a log | round | The same of many sessions.
inline constexpr std::size_t kMostFolds = 8;
// draws | derived: they know an end of a 90 % interval to a tenth of a standard deviation | Of
// runs, trials or whole fleets, with replacement, for an interval or a threshold.
inline constexpr int kDraws = 400;
// runs, trials, windows | round | Fewer of one kind do not show how far they scatter.
inline constexpr std::size_t kEnoughToScatter = 10;
// runs, trials, pushes | derived: the fewest of which one that is off can be seen | Fewer of one
// kind show nothing that lasts.
inline constexpr std::size_t kFewestAlike = 3;
// trials | round | Of one command, for their mean to be worth something.
inline constexpr std::size_t kFewInCell = 4;
// readings | round | Gaps between readings, starts of another kind: fewer show nothing of the
// rest.
inline constexpr std::size_t kFewestReadings = 20;
// range | round | A parameter so near to an end of its range sits there.
inline constexpr double kAtBound = 1e-3;
// probability | the customary one | With which what is called detectable is named.
inline constexpr double kDetectablePower = 0.95;
// nats | derived: Bayes factors of 7 hardly show (Kass and Raftery 1995) | What explains a log as
// well is not distinguished.
inline constexpr double kNotDistinguished = 2;

// -- Names of trials and pushes
// nats | chosen: the best of the catalogue gained 4.4 at most in 90 of 100 null logs, 6.7 in 99 |
// That an effect must gain to be named.
inline constexpr double kLeastGainOfDrives = 9;
// nats | chosen: the best gained 14.2 at most in twenty null logs of another simulator, and 50 at
// least where something clear was | The same of pushes: two sound simulations differ by that much.
inline constexpr double kLeastGainOfPushes = 20;
// log10 of p | chosen: the least of twelve blocks was -3.8 in 400 null logs | A leftover
// dependence below it is no chance.
inline constexpr double kUnknownLog10P = -4.2;
// what the others explain | round | Small systematic errors of a strong effect's model look like
// weaker effects: a further one explains and closes so much.
inline constexpr double kLeastShare = 0.02;
// nats | derived: noise alone reaches half of that at the best of a thousand places | A second
// seam or patch, since an error of the first one's place or bend looks like one; a line of the
// correction.
inline constexpr double kLeastSecondOfAKind = 20;
// all that is explained | round | The same.
inline constexpr double kSecondOfAKindShare = 0.05;
// nats | round | Before its penalty, for a mark to be searched from.
inline constexpr double kWorthSearching = 8;
// the best one's gain | round | The same: no search makes up for less; its turn comes when the
// best is explained.
inline constexpr double kWorthSearchingShare = 0.3;
// nats | chosen: blind checks; where there are no patches the sketch reaches 11 | For a patch of
// the sketch to be simulated.
inline constexpr double kWorthSketched = 12.5;
// - | round | Times what a simulated disc does, or a part of it: where a fit would have more, or
// the opposite, the data ask for no such disc.
inline constexpr double kMostOfItself = 3;
// m | round | Two seams nearer than that are one.
inline constexpr double kLeastApart_m = 0.3;
// sum of the radii | round | Two patches nearer than that are one.
inline constexpr double kPatchesApart = 0.75;
// m | round | Prior s.d. of a patch's place and radius for a gain of half a nat: its mark changes
// within a few cm and has several hills when it is weak.
inline constexpr double kPatchPlace_m = 0.25;
// distance from 1 | round | The same of its ratio.
inline constexpr double kPatchRatio = 1;
// - | round | Marks that are so much alike are not distinguished before anything is fitted.
inline constexpr double kAliasCosine = 0.9;
// nats | chosen: null logs stay below 8 | Slips, and outliers of any kind.
inline constexpr double kLeastSlipGain = 11;
// what readings lie apart by, at most | derived: the bend is a quarter of the slope there | A lens
// whose middle is farther away does to all readings what a sheared picture would.
inline constexpr double kFarView = 2;
// what the effects on the means explain | round | The same of outliers beside effects.
inline constexpr double kLeastOutlierShare = 0.03;
// squared s.d. | derived: chi-squared of 3 degrees, one in 110 | A trial beyond it is an outlier.
inline constexpr double kFarSquared = 11.5;
// nats | chosen: the share and the age are searched on a grid | Late readings, and a lag of paths,
// whose samples go together.
inline constexpr double kLeastLatencyGain = 14;
// s | round | A reading that comes later is a move of the robot.
inline constexpr double kOldestReading_s = 0.5;
// s | round | For so long another robot may roll on by itself: what a late reading's age is
// counted from is its recorder's secret.
inline constexpr double kCoasting_s = 0.04;
// fourth moment over squared second | derived: 3 of a Gaussian, and four times what 450 gaps
// scatter by | Tails that are worth fitting.
inline constexpr double kHeavyTails = 3.6;
// the same | derived: the same, of one value a gap | The same of headings' gaps.
inline constexpr double kHeavyHeading = 3.9;
// nats | chosen: Gaussian residuals stay below 6, 155 drives of a real robot gain 13 | That two
// tail weights must gain.
inline constexpr double kLeastTailGain = 10;
// - | derived: 4 degrees of freedom in 3 dimensions; below 3 no density | Tail of the noise.
inline constexpr double kNoiseTail = 7;
// s.d. of a chi-squared | round | From here on a spread is there.
inline constexpr double kClearlyThere = 4.5;
// squared s.d. | derived: chi-squared of 3 degrees, one in 340 | Beyond it a trial pulls as the
// noise's tail does.
inline constexpr double kTailFromSquared = 14;

// -- Verdicts of trials and pushes
// - | round | Scale of what is left, over the noise, at least.
inline constexpr double kLeastLeftoverScale = 0.9;
// - | round | The same, at most.
inline constexpr double kMostLeftoverScale = 1.4;
// what the named effects explain | chosen: right effects left 1 to 4 %, effects outside the
// catalogue under a wrong name 18 % and more | Who leaves more is not the cause.
inline constexpr double kWrongShare = 0.15;
// nats a trial | chosen: the worst of 11 practice logs and of the real forward log keep 0.2 with
// their effects | A model that misses more, against its own noise, is not the cause.
inline constexpr double kMostMissed = 3;
// nats a trial | chosen: nulls of other simulators keep 0 to 0.8, an outline that is 5 % too large
// 2.1 to 2.9 | The same where nothing is named.
inline constexpr double kMostOfNothing = 1.3;

// -- Base and noise of trials and pushes
// rounds | chosen: a base alone that is left to settle takes up what an effect does (of MuJoCo's
// log) | Of tuning a drive's base.
inline constexpr int kTuningRounds = 6;
// rounds | round | The same of pushes.
inline constexpr int kPushTuningRounds = 4;
// trials | round | Where more of them hardly repeat a command, commands are free.
inline constexpr double kFreeShare = 1.0 / 3;
// logarithm | round | Prior s.d. of a program's parameter that the config searches.
inline constexpr double kSearchedSd = 0.5;
// logarithm | round | The same of its others.
inline constexpr double kOtherSd = 0.2;
// range | round | The same where a logarithm has no meaning.
inline constexpr double kShareOfRange = 1.0 / 6;
// logarithm | round | Prior s.d. of a push's frictions and pressures.
inline constexpr double kFactorPrior = 1;
// logarithm | round | The same of the ground's friction, which slow pushes hardly show.
inline constexpr double kGroundPrior = 0.3;
// m | round | To which outline and finger are known.
inline constexpr double kOutline_m = 3e-4;
// the finger's way after the touch | chosen: the simulator with friction all over the face
// (docs/pushing.md) | What a simulation of other physics gets wrong as a smooth function of the
// push; a turn is over that in gyration radii.
inline constexpr double kMisfit = 0.01;
// what is got wrong of one push by itself | measured: what repeats of three logs of another
// simulator have in common then has squares of 53, 57 and 64 of 57 degrees | What two simulations
// with friction all over the face differ by.
inline constexpr double kSoundMisfit = 0.3;
// moves | chosen: CPU seconds, on blind checks of seeds 41, 43 and 47 | To somewhere better, in a
// profile.
inline constexpr int kMostMoves = 4;
// s.e. of the slopes | round | Most that a profile widens an interval by.
inline constexpr double kWidest = 3;

// -- What nothing explains
// terms | round | Of the smooth correction.
inline constexpr std::size_t kMostFittedTerms = 3;
// centres | round | Of a term, of one command.
inline constexpr std::size_t kMostOfCommand = 24;
// centres | round | Of a term that all share.
inline constexpr std::size_t kMostOfAll = 40;
// s.d. | round | Beyond it a trial pulls no harder at the correction.
inline constexpr double kFarthestPull = 10;
// windows of a length | derived: 40 bumps of three values are as well known from these as from all
// | That a ground robot's correction is learned from.
inline constexpr std::size_t kMostLessons = 600;

// -- Names of ground robots' values
// nats | chosen: a separation 4.8 % off comes to 4.1 on runs of two poses | That a name must gain
// over what the tolerances allow, to be predicted held out at all.
inline constexpr double kLeastGroundGain = 3;
// nats | round | The same of a change from one log to the next, of what a reference has beside the
// file, and, a run, of clocks that are apart.
inline constexpr double kLeastChangeGain = 6;
// nats | derived: a chi-squared of one degree reaches twice that in one case of 20 | That a second
// value of one name must gain.
inline constexpr double kPriceOfAValue = 2;
// nats | derived: the logarithm of some tens of lines or circles that differ | Beside that, of a
// border between floors.
inline constexpr double kPriceOfLooking = 4;
// the best gain | round | For an offer to compete held out.
inline constexpr double kShareOfBest = 0.5;
// what the names before moved a window by, gained | chosen: traces in the cases come to 0.2 | What
// a name leaves of itself to others, above which the next change stands; a simpler word may gain
// so much less.
inline constexpr double kTraceShare = 0.25;
// nats a window | derived: residuals 10 % smaller, 3 ln 1.1 | May be left unexplained for none.
inline constexpr double kToleratedGap = 0.286;
// - | chosen: the practice cases | Residuals shrink by it for a fault of the log.
inline constexpr double kFaultShrinks = 1.4;
// nats | chosen: the practice cases | The same.
inline constexpr double kFaultGain = 10;
// faults | round | Of one log.
inline constexpr std::size_t kMostFaults = 2;
// - | round | Residuals shrink by it for a change of a robot.
inline constexpr double kChangeShrinks = 1.01;
// tolerances | derived: 99 % of what is normal | The same of several values.
inline constexpr double kFarTolerances = 2.58;
// tolerances | measured: slopes of MuJoCo's robots on 0.02 to 0.1 rad come to 0.01 to 0.8
// (scripts/ground_floors.sh) | Prior s.d. of values without a plausible error of their own.
inline constexpr double kPlausibleTolerances = 30;
// the prior's s.d. | round | A log that leaves more of it does not show the value.
inline constexpr double kUnshown = 0.7;
// the other runs' misses | chosen: real runs reach 4.2, one that is mirrored alone 50 and more | A
// run is off by itself; of windows, half of the others' misses.
inline constexpr double kFarRun = 10;
// of the windows | measured: 0.07 at most of those of 136 robots, 0.14 and more where a wheel
// slipped for 2 s of each 15 | So many that are off by themselves are more than chance.
inline constexpr double kFarShare = 0.12;
// deviation of the motions | chosen: real runs of the cases leave 0.24 at most, with the commands
// of other runs 0.69 and more | Commands do not explain the motions.
inline constexpr double kUnexplained = 0.5;
// way, rad | round | Motions are all alike.
inline constexpr double kEvenMotion = 0.1;
// frames on the way | chosen: the Warthog's laser poses repeat 2 % | Stale frames are named.
inline constexpr double kLeastStaleShare = 0.03;
// scatter of the shortest windows | derived: a tenth of its variance | Rounding is named.
inline constexpr double kLeastRounding = 0.3;
// how far the wheels reach | chosen: logs of the cases have grids of 0.001 and less | Rounding is
// named whatever it adds to the scatter.
inline constexpr double kCoarseRounding = 0.05;
// the file's value | round | A robot of less is another robot, and one of none or of the opposite
// sign none at all.
inline constexpr double kLeastRatio = 0.1;

// -- Fits of ground robots
// - | cited: Lange, Little and Taylor 1989 | Degrees of freedom of a window's residual.
inline constexpr double kWindowTail = 4;
// runs | round | Of fewer, stretches are held out in place of runs.
inline constexpr std::size_t kLeastRunsHeldOut = 4;
// stretches | round | Of increments, which know of nothing that lasts: tens of stretches say
// better than ten how far values scatter.
inline constexpr std::size_t kLeastRelativeBlocks = 30;
// stretches | derived: n of n - 3 scatter as Student's t of n - 1 degrees does | Of a single run so
// many fewer are drawn than it has for the intervals of values.
inline constexpr std::size_t kSparedStretches = 3;
// share | round | That what turns add to commands differs by from run to run.
inline constexpr double kAddedByTurnsSd = 0.1;
// - | round | A matcher that states its deviations is too sure by so much at most.
inline constexpr double kMostTooSmall = 4;
// m, rad in the root of a metre | measured: whole runs of OptiOdom's robots and a Create end 0.01
// to 0.05 off (docs/evidence/ground.md) | What wheels slip by.
inline constexpr double kSlip = 0.03;
// what the places scatter by | round | Radius of a patch that may be named.
inline constexpr double kLargestPatch = 2;
// wheels' places | round | On either side of a border.
inline constexpr double kLeastInside = 0.015;
// tolerances | round | How far off a file may be of which nothing is asked.
inline constexpr double kFarOff = 20;
// median way and turn | round | Rows of a reference may be nearly as unsure as they are long.
inline constexpr double kExplained = 0.6;
// the file's value | round | Of a reference that is the same robot, either way.
inline constexpr double kMostRatio = 2;
// names | round | That a reference has beside the file.
inline constexpr int kMostTraits = 3;
// a gene's range | round | Prior s.d. of a program's gene.
inline constexpr double kTunedShare = 0.25;

}  // namespace gapfarm
