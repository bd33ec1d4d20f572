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

// The same of those items that `keep` takes.
template <class Range, class Keep, class Of = std::identity>
auto filtered(Range&& range, Keep keep, Of of = {}) {
  std::vector<std::decay_t<std::invoke_result_t<Of&, decltype(*std::begin(range))>>> all;
  for (auto&& item : range) {
    if (std::invoke(keep, item)) all.push_back(std::invoke(of, item));
  }
  return all;
}

template <class Items, class More>
void append(Items& to, const More& more) {
  to.insert(to.end(), std::begin(more), std::end(more));
}

// The lists that `of` makes of the items, one after another.
template <class Range, class Of>
auto flattened(Range&& range, Of of) {
  std::decay_t<std::invoke_result_t<Of&, decltype(*std::begin(range))>> all;
  for (auto&& item : range) append(all, std::invoke(of, item));
  return all;
}

// Added up in their order.
template <class Range, class Of>
auto sum_of(const Range& range, Of of) {
  std::decay_t<std::invoke_result_t<Of&, decltype(*std::begin(range))>> sum{};
  for (auto&& item : range) sum += std::invoke(of, item);
  return sum;
}

// 0 where none is greater.
template <class Range, class Of>
double max_of(const Range& range, Of of) {
  double greatest = 0;
  for (auto&& item : range) greatest = std::max<double>(greatest, std::invoke(of, item));
  return greatest;
}

template <class Range, class Value, class Of = std::identity>
bool contains(const Range& range, const Value& value, Of of = {}) {
  return std::ranges::find(range, value, of) != std::ranges::end(range);
}

// The first item of which `of` is this value; null: there is none.
template <class Range, class Value, class Of>
auto find_by(Range&& range, const Value& value, Of of) -> decltype(&*std::begin(range)) {
  const auto found = std::ranges::find(std::forward<Range>(range), value, of);
  return found == std::ranges::end(range) ? nullptr : &*found;
}

// What a map holds under this key; null: nothing.
template <class Map, class Key>
auto find_in(Map& map, const Key& key) -> decltype(&std::begin(map)->second) {
  const auto found = map.find(key);
  return found == map.end() ? nullptr : &found->second;
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
