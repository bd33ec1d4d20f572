#include "common/math/fronts.h"

#include <algorithm>
#include <cassert>
#include <limits>

#include "common/base/ranges.h"

namespace gapfarm {
namespace {

// Within the first `dimensions` costs; `points` may be put in another order.
double volume(std::span<Costs> points, const Costs& reference, std::size_t dimensions) {
  const std::size_t last = dimensions - 1;
  const auto less = [last](const Costs& a, const Costs& b) { return a[last] < b[last]; };
  if (points.empty()) return 0;
  if (dimensions == 1) {
    return reference[0] - (*std::min_element(points.begin(), points.end(), less))[0];
  }
  std::sort(points.begin(), points.end(), less);
  if (dimensions == 2) {
    double sum = 0, height = reference[0];
    for (const Costs& point : points) {
      if (point[0] >= height) continue;
      sum += (height - point[0]) * (reference[1] - point[1]);
      height = point[0];
    }
    return sum;
  }
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double until = i + 1 < points.size() ? points[i + 1][last] : reference[last];
    const double depth = until - points[i][last];
    if (depth <= 0) continue;
    std::vector<Costs> slice(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    sum += depth * volume(slice, reference, last);
  }
  return sum;
}

template <class Choose>
Costs extreme_of(std::span<const Costs> points, Choose choose) {
  assert(!points.empty());
  Costs extreme = points.front();
  for (const Costs& point : points) {
    for (std::size_t m = 0; m < extreme.size(); ++m) extreme[m] = choose(extreme[m], point[m]);
  }
  return extreme;
}

}  // namespace

bool dominates(const Costs& a, const Costs& b) {
  bool less = false;
  for (std::size_t m = 0; m < a.size(); ++m) {
    if (a[m] > b[m]) return false;
    less = less || a[m] < b[m];
  }
  return less;
}

std::vector<std::size_t> front_numbers(
    std::size_t count, const std::function<bool(std::size_t, std::size_t)>& dominates) {
  std::vector<std::vector<std::size_t>> beats(count);
  std::vector<std::size_t> beaten_by(count), number(count), front;
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = 0; b < count; ++b) {
      if (a == b || !dominates(a, b)) continue;
      beats[a].push_back(b);
      ++beaten_by[b];
    }
  }
  for (std::size_t a = 0; a < count; ++a) {
    if (beaten_by[a] == 0) front.push_back(a);
  }
  for (std::size_t k = 0; !front.empty(); ++k) {
    std::vector<std::size_t> next;
    for (const std::size_t a : front) {
      number[a] = k;
      for (const std::size_t b : beats[a]) {
        if (--beaten_by[b] == 0) next.push_back(b);
      }
    }
    front = std::move(next);
  }
  return number;
}

std::vector<std::size_t> first_front(std::span<const Costs> points) {
  std::vector<std::size_t> front;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool beaten = std::ranges::any_of(
        points, [&](const Costs& other) { return dominates(other, points[i]); });
    if (!beaten) front.push_back(i);
  }
  return front;
}

std::vector<double> crowding_distances(std::span<const Costs> front) {
  std::vector<double> distances(front.size());
  if (front.empty()) return distances;
  for (std::size_t m = 0; m < front.front().size(); ++m) {
    const std::vector<std::size_t> order =
        order_of(front, [&](const Costs& a, const Costs& b) { return a[m] < b[m]; });
    const double range = front[order.back()][m] - front[order.front()][m];
    distances[order.front()] = distances[order.back()] = std::numeric_limits<double>::infinity();
    if (!(range > 0)) continue;
    for (std::size_t k = 1; k + 1 < order.size(); ++k) {
      distances[order[k]] += (front[order[k + 1]][m] - front[order[k - 1]][m]) / range;
    }
  }
  return distances;
}

Costs least_of(std::span<const Costs> points) {
  return extreme_of(points, [](double a, double b) { return std::min(a, b); });
}

Costs greatest_of(std::span<const Costs> points) {
  return extreme_of(points, [](double a, double b) { return std::max(a, b); });
}

std::size_t knee_of(std::span<const Costs> front) {
  const Costs least = least_of(front), greatest = greatest_of(front);
  std::size_t knee = 0;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < front.size(); ++i) {
    double sum = 0;
    for (std::size_t m = 0; m < least.size(); ++m) {
      const double range = greatest[m] - least[m];
      if (range > 0) sum += (front[i][m] - least[m]) / range;
    }
    if (sum < best) knee = i;
    best = std::min(best, sum);
  }
  return knee;
}

double hypervolume(std::vector<Costs> points, const Costs& reference) {
  assert(reference.size() <= kMostHypervolumeCosts);
  std::erase_if(points, [&](const Costs& point) {
    for (std::size_t m = 0; m < reference.size(); ++m) {
      if (!(point[m] < reference[m])) return true;
    }
    return false;
  });
  return volume(points, reference, reference.size());
}

}  // namespace gapfarm
