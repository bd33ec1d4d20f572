// Intervals, and short words for what algorithms do to whole ranges.  A projection is a member or a
// function.
#pragma once

#include <algorithm>
#include <functional>
#include <iterator>
#include <numeric>
#include <type_traits>
#include <vector>

namespace gapfarm {

// An interval of numbers, in the unit of whatever it is one of.
struct Interval {
  double lower = 0;
  double upper = 0;
  bool operator==(const Interval&) const = default;
};

// What `of` makes of every item, in their order.
template <class Range, class Of>
auto mapped(Range&& range, Of of) {
  std::vector<std::decay_t<std::invoke_result_t<Of&, decltype(*std::begin(range))>>> all;
  for (auto&& item : range) all.push_back(std::invoke(of, item));
  return all;
}

template <class Range, class Value, class Of = std::identity>
bool contains(const Range& range, const Value& value, Of of = {}) {
  return std::ranges::find(range, value, of) != std::ranges::end(range);
}

// The first item of which `of` is this value; null: there is none.
template <class Range, class Value, class Of>
auto find_by(Range& range, const Value& value, Of of) -> decltype(&*std::begin(range)) {
  const auto found = std::ranges::find(range, value, of);
  return found == std::ranges::end(range) ? nullptr : &*found;
}

// 0 to count - 1.
inline std::vector<std::size_t> indices(std::size_t count) {
  std::vector<std::size_t> all(count);
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

// The indices of `items` in ascending order, equal ones as they stand.
template <class Items, class Less = std::ranges::less>
std::vector<std::size_t> order_of(const Items& items, Less less = {}) {
  std::vector<std::size_t> order = indices(items.size());
  std::ranges::stable_sort(order,
                           [&](std::size_t a, std::size_t b) { return less(items[a], items[b]); });
  return order;
}

}  // namespace gapfarm
