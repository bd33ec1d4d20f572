// Short words for what algorithms do to whole ranges.  A projection is a member or a function.
#pragma once

#include <algorithm>
#include <functional>
#include <iterator>
#include <type_traits>
#include <vector>

namespace gapfarm {

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

}  // namespace gapfarm
