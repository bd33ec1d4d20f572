// Result<T>: a value or an Error whose sentence names the thing, the value found and the remedy.
#pragma once

#include <cassert>
#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace gapfarm {

// What a caller may have to distinguish; everything else is for people to read.
enum class ErrorCode {
  kOther,
  kStopped,     // by request
  kSimulation,  // a simulation did not end well, or cannot be asked for
  kNoProgram,   // a user's program cannot be started, or is another one
};

struct Error {
  std::string message;
  ErrorCode code = ErrorCode::kOther;
};

template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}      // NOLINT: implicit by design
  Result(Error error) : state_(std::move(error)) {}  // NOLINT: implicit by design

  bool ok() const { return std::holds_alternative<T>(state_); }
  explicit operator bool() const { return ok(); }

  // REQUIRES: ok().
  T& value() & {
    assert(ok());
    return std::get<T>(state_);
  }
  const T& value() const& {
    assert(ok());
    return std::get<T>(state_);
  }
  T&& value() && {
    assert(ok());
    return std::get<T>(std::move(state_));
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  // REQUIRES: !ok().
  const Error& error() const {
    assert(!ok());
    return std::get<Error>(state_);
  }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT: implicit by design

  bool ok() const { return !error_; }
  explicit operator bool() const { return ok(); }
  const Error& error() const {
    assert(error_);
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

// `result`; an error's sentence begins with "`where`: ".
template <class T>
Result<T> under(const std::string& where, Result<T> result) {
  if (result) return result;
  return Error{where + ": " + result.error().message, result.error().code};
}

}  // namespace gapfarm

// What passes errors on, in one line each.
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
