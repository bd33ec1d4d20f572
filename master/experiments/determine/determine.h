// Which parameters do the data determine?  Very different genomes may explain the same log; a best
// one says nothing about that.
//
// Around a tuned point the log likelihood (mean log score times trials) is fitted by a quadratic
// over points drawn in a box.  The box is as wide in each gene as changes the likelihood by some
// nats, shrinks while the quadratic fits badly, and follows the quadratic to its top.  There its
// curvature gives every gene's covariance, given that all genes may move.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/progress/overall_progress.h"

namespace gapfarm {

struct DetermineSettings {
  double half_width = 0.3;   // greatest, of the box, share of each gene's range
  double points_a_term = 4;  // evaluations a coefficient of the quadratic
  double share = 0.5;        // of its range that a determined gene's 95 % interval may cover
  std::uint64_t seed = 1;
};

struct GeneDetermined {
  Gene gene;
  double value = 0;      // at the point, the parameter's unit
  double deviation = 0;  // s.d., share of the range; no more than leads out of some gene's range
  Interval interval_95;  // about the quadratic's top, cut off at the range
  bool determined = false;
  // The point, or a determined gene's interval, comes within a hundredth of an end of the range.
  bool at_bound = false;
};

struct Compensation {  // two genes that make up for one another
  std::size_t a = 0, b = 0;
  double correlation = 0;
};

struct DetermineReport {
  std::vector<GeneDetermined> genes;
  std::vector<Compensation> compensations;  // |correlation| above 0.9, greatest first
  double roughness = 0;                     // s.d. of the likelihood about the quadratic, nats
  double explained = 0;                     // share of its variance that the quadratic explains
  bool reliable = false;                    // false: too rough or too bent to read anything off
  double rise = 0;                          // of the log likelihood from the point to the top, nats
  bool outside = false;  // it rises beyond the last box, too: the top was not reached
  std::size_t evaluations = 0, failures = 0;
};

// Mean log score of each genome; not finite where the simulation did not end well.
using LikelihoodOf = std::function<Result<std::vector<double>>(const std::vector<Genome>& genomes)>;

// `problem` with its genes and its log; `point`: the tuned genome.  Only real genes and integers of
// at least ten levels take part; the others keep the point's value.  Errors: none take part, of the
// likelihood, fewer usable points than coefficients.
Result<DetermineReport> determine(const Problem& problem, const Genome& point,
                                  const LikelihoodOf& likelihood, const DetermineSettings& settings,
                                  const StageHooks& hooks = {});

std::string determine_text(const DetermineReport& report, const ParameterTable& table);
std::string determine_csv(const DetermineReport& report, const ParameterTable& table);

}  // namespace gapfarm
