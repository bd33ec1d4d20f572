// What is best when several costs count: fronts of points that none beats in all.  Costs are lower
// is better, every point has as many.
#pragma once

#include <functional>
#include <span>
#include <vector>

namespace gapfarm {

using Costs = std::vector<double>;

// No cost of `a` is greater than b's, and one is less.
bool dominates(const Costs& a, const Costs& b);

// The front of each of `count` points, from 0, those that nothing dominates: the fast
// non-dominated sort (Deb, Pratap, Agarwal and Meyarivan, IEEE Trans. Evol. Comp. 6, 2002).
// `dominates`: a strict partial order of their indices.
std::vector<std::size_t> front_numbers(
    std::size_t count, const std::function<bool(std::size_t, std::size_t)>& dominates);

// The members of the first front of `points`, ascending.
std::vector<std::size_t> first_front(std::span<const Costs> points);

// Crowding distances (Deb et al. 2002) among the points of a front: the sum over the costs of the
// distance between both neighbours, as a share of the range; infinity at an end of a cost.
std::vector<double> crowding_distances(std::span<const Costs> front);

// Least and greatest of each cost.  REQUIRES: there is a point.
Costs least_of(std::span<const Costs> points);
Costs greatest_of(std::span<const Costs> points);

// The point that lies farthest towards the least of all costs from the plane through the ends of
// the front, costs as shares of their ranges (Das, Structural Optimization 18, 1999): the least sum
// of these shares; of equals the first.  REQUIRES: there is a point.
std::size_t knee_of(std::span<const Costs> front);

// The volume that the points dominate within `reference`, exactly, slice by slice along each cost.
// Takes n^(costs - 1) log n, so it is for kMostHypervolumeCosts at most.
inline constexpr std::size_t kMostHypervolumeCosts = 4;
double hypervolume(std::vector<Costs> points, const Costs& reference);

}  // namespace gapfarm
