#include "common/math/laws.h"

#include <atomic>
#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <exception>
#include <limits>

namespace gapfarm {

namespace law = boost::math;

namespace {

std::atomic<std::uint64_t> undefined_count{0};

double undefined(double answer) {
  ++undefined_count;
  return answer;
}

template <class Call>
double value_or(double otherwise, Call call) {
  try {
    const double value = call();
    return std::isnan(value) ? undefined(otherwise) : value;
  } catch (const std::exception&) {  // Boost.Math's errors of domain, overflow and evaluation
    return undefined(otherwise);
  }
}

template <class Call>
double probability(Call call) {
  return value_or(1, call);
}

template <class Call>
double number(Call call) {
  return value_or(std::numeric_limits<double>::quiet_NaN(), call);
}

}  // namespace

std::uint64_t undefined_laws() { return undefined_count; }

double normal_above(double z) {
  return probability([&] { return law::cdf(law::complement(law::normal(), z)); });
}

double normal_quantile(double share) {
  return number([&] { return law::quantile(law::normal(), share); });
}

double chi_squared_below(double freedom, double x) {
  return probability([&] { return law::cdf(law::chi_squared(freedom), x); });
}

double chi_squared_above(double freedom, double x) {
  return probability([&] { return law::cdf(law::complement(law::chi_squared(freedom), x)); });
}

double chi_squared_quantile(double freedom, double share) {
  return number([&] { return law::quantile(law::chi_squared(freedom), share); });
}

double noncentral_chi_squared_above(double freedom, double noncentrality, double x) {
  return probability([&] {
    return law::cdf(law::complement(law::non_central_chi_squared(freedom, noncentrality), x));
  });
}

double noncentrality_of(double freedom, double x, double probability) {
  return number([&] {
    return law::non_central_chi_squared::find_non_centrality(freedom, x, 1 - probability);
  });
}

double fisher_above(double freedom, double freedom_below, double f) {
  return probability(
      [&] { return law::cdf(law::complement(law::fisher_f(freedom, freedom_below), f)); });
}

double binomial_below(double trials, double share, double hits) {
  return probability([&] { return law::cdf(law::binomial(trials, share), hits); });
}

double binomial_above(double trials, double share, double hits) {
  return probability([&] { return law::cdf(law::complement(law::binomial(trials, share), hits)); });
}

double beta_quantile(double a, double b, double share) {
  return number([&] { return law::quantile(law::beta_distribution<>(a, b), share); });
}

double log_gamma(double x) {
  return number([&] { return law::lgamma(x); });
}

}  // namespace gapfarm
