// Probability laws.  Boost.Math stands behind this header alone: what it is made into is compiled
// once.
//
// Nothing throws.  Where an argument is not finite or a law does not know it (a negative
// chi-squared), a probability is 1, so that a p value is no evidence, any other value is NaN, and
// undefined_laws() counts it.
#pragma once

#include <cstdint>

namespace gapfarm {

// Calls of this process so far whose arguments had no law; a command that sees it grow warns.
std::uint64_t undefined_laws();

// Standard normal: P(Z > z), and z with P(Z <= z) = share in (0, 1).
double normal_above(double z);
double normal_quantile(double share);

// Chi squared with `freedom` > 0 degrees: P(X <= x), P(X > x), and x with P(X <= x) = share in
// [0, 1).
double chi_squared_below(double freedom, double x);
double chi_squared_above(double freedom, double x);
double chi_squared_quantile(double freedom, double share);

// Chi squared around a noncentrality > 0: P(X > x), and the noncentrality that makes it
// `probability` in (0, 1).
double noncentral_chi_squared_above(double freedom, double noncentrality, double x);
double noncentrality_of(double freedom, double x, double probability);

// Fisher's F: P(F > f).
double fisher_above(double freedom, double freedom_below, double f);

// Hits of `trials` that hit with `share` each: P(K <= hits) and P(K > hits).
double binomial_below(double trials, double share, double hits);
double binomial_above(double trials, double share, double hits);

// Beta law of a, b > 0: x with P(X <= x) = share in [0, 1].
double beta_quantile(double a, double b, double share);

// Logarithm of the gamma function of x > 0.
double log_gamma(double x);

inline constexpr double kNormal90 = 1.645;  // half a 90 % interval, in standard deviations
inline constexpr double kLogTwoPi = 1.8378770664093454836;  // ln(2 pi)

}  // namespace gapfarm
