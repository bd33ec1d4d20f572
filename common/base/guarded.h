// The border to libraries that throw.
#pragma once

#include <exception>
#include <string>
#include <type_traits>

#include "common/base/result.h"

namespace gapfarm {

// What `call` returns (a Result or Status), or an Error where a library throws instead: its code
// says that a result could not be had, so that who calls can report what is known without it.
template <class Call>
std::invoke_result_t<Call> guarded(Call call) {
  try {
    return call();
  } catch (const std::exception& thrown) {
    return Error{std::string("a library failed on these numbers (") + thrown.what() + ")",
                 ErrorCode::kSimulation};
  }
}

}  // namespace gapfarm
