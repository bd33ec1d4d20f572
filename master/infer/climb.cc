#include "master/infer/climb.h"

#include <nlopt.hpp>

namespace gapfarm::infer {

double climb(const std::function<double(const std::vector<double>&)>& objective, const Climb& how,
             std::vector<double>* x) {
  auto function = objective;
  nlopt::opt search(how.subplex ? nlopt::LN_SBPLX : nlopt::LN_NELDERMEAD,
                    static_cast<unsigned>(x->size()));
  search.set_max_objective(
      [](unsigned n, const double* at, double*, void* self) {
        return (*static_cast<decltype(function)*>(self))(std::vector<double>(at, at + n));
      },
      &function);
  if (!how.lower.empty()) search.set_lower_bounds(how.lower);
  if (!how.upper.empty()) search.set_upper_bounds(how.upper);
  search.set_initial_step(how.step);
  if (how.x_tolerance > 0) search.set_xtol_abs(how.x_tolerance);
  if (how.tolerance > 0) search.set_ftol_abs(how.tolerance);
  search.set_maxeval(how.evaluations);
  double value = 0;
  try {
    search.optimize(*x, value);
  } catch (const std::exception&) {
    // Roundoff stops the search where nothing is left to gain; x holds the best point so far.
  }
  return objective(*x);
}

}  // namespace gapfarm::infer
