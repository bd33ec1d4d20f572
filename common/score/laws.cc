#include "common/score/laws.h"

#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/special_functions/gamma.hpp>

namespace gapfarm {

namespace law = boost::math;

double normal_above(double z) { return law::cdf(law::complement(law::normal(), z)); }

double normal_quantile(double share) { return law::quantile(law::normal(), share); }

double chi_squared_below(double freedom, double x) {
  return law::cdf(law::chi_squared(freedom), x);
}

double chi_squared_above(double freedom, double x) {
  return law::cdf(law::complement(law::chi_squared(freedom), x));
}

double chi_squared_quantile(double freedom, double share) {
  return law::quantile(law::chi_squared(freedom), share);
}

double noncentral_chi_squared_above(double freedom, double noncentrality, double x) {
  return law::cdf(law::complement(law::non_central_chi_squared(freedom, noncentrality), x));
}

double noncentrality_of(double freedom, double x, double probability) {
  return law::non_central_chi_squared::find_non_centrality(freedom, x, 1 - probability);
}

double fisher_above(double freedom, double freedom_below, double f) {
  return law::cdf(law::complement(law::fisher_f(freedom, freedom_below), f));
}

double binomial_below(double trials, double share, double hits) {
  return law::cdf(law::binomial(trials, share), hits);
}

double binomial_above(double trials, double share, double hits) {
  return law::cdf(law::complement(law::binomial(trials, share), hits));
}

double beta_quantile(double a, double b, double share) {
  return law::quantile(law::beta_distribution<>(a, b), share);
}

double log_gamma(double x) { return law::lgamma(x); }

}  // namespace gapfarm
