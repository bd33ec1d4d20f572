// What passes errors on, in one line each.
#pragma once

#include "common/base/result.h"

#define GAPFARM_JOINED_(a, b) a##b
#define GAPFARM_JOINED(a, b) GAPFARM_JOINED_(a, b)
#define GAPFARM_RESULT GAPFARM_JOINED(result_, __LINE__)

// `declaration` from the value of a Result, or the enclosing function returns its error:
//   ASSIGN_OR_RETURN(const auto text, read_text_file(path));
#define ASSIGN_OR_RETURN(declaration, ...)            \
  auto GAPFARM_RESULT = (__VA_ARGS__);                \
  if (!GAPFARM_RESULT) return GAPFARM_RESULT.error(); \
  declaration = std::move(GAPFARM_RESULT).value()

// The enclosing function returns the error of a Status or Result, if it is one.
#define RETURN_IF_ERROR(...) \
  if (auto GAPFARM_RESULT = (__VA_ARGS__); !GAPFARM_RESULT) return GAPFARM_RESULT.error()
