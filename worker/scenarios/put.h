// A value of a parameter table as a setting of a simulator.
#pragma once

#include <type_traits>

namespace gapfarm {

// Choices are indices, integers are whole, booleans are 0 or 1.
template <typename Setting>
void put(double value, Setting& setting) {
  if constexpr (std::is_same_v<Setting, bool>) {
    setting = value != 0;
  } else if constexpr (std::is_enum_v<Setting>) {
    setting = static_cast<Setting>(static_cast<int>(value));
  } else {
    setting = static_cast<Setting>(value);
  }
}

}  // namespace gapfarm
