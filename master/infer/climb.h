// Searches without slopes of a handful of values (NLopt's).
#pragma once

#include <functional>
#include <vector>

namespace gapfarm::infer {

struct Climb {
  bool subplex = false;                        // in place of one simplex (Nelder and Mead)
  std::vector<double> lower = {}, upper = {};  // empty: no bounds
  std::vector<double> step = {};               // the first, a dimension
  double x_tolerance = 0, tolerance = 0;       // of the values and of the objective; 0: none
  int evaluations = 0;                         // at most

  void add(double least, double most, double first_step) {
    lower.push_back(least);
    upper.push_back(most);
    step.push_back(first_step);
  }
};

// Moves `x` uphill to the best point that is found; the objective there.
double climb(const std::function<double(const std::vector<double>&)>& objective, const Climb& how,
             std::vector<double>* x);

}  // namespace gapfarm::infer
