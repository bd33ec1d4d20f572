#include "common/progress/number_text.h"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "common/base/text.h"

namespace gapfarm {
std::string format_duration(double seconds) {
  if (!(seconds >= 0) || seconds > 1e9) return "?";
  if (seconds < 9.95) return formatted("%.1f s", seconds);
  const long whole = std::lround(seconds);
  if (whole < 60) return formatted("%ld s", whole);
  if (whole < 3600) return formatted("%ld min %02ld s", whole / 60, whole % 60);
  return formatted("%ld h %02ld min", whole / 3600, whole / 60 % 60);
}

std::string utc_text(double unix_s, const char* format) {
  const auto seconds = static_cast<std::time_t>(unix_s);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[40];
  return {text, std::strftime(text, sizeof text, format, &utc)};
}

std::string format_share(double share) {
  const double percent = 100 * std::clamp(share, 0.0, 1.0);
  if (percent > 0 && percent < 0.95) return formatted("%.1f %%", percent);
  // Never "100 %" before the end.
  return formatted("%.0f %%", share < 1 ? std::min(99.0, std::round(percent)) : 100.0);
}

std::string format_number(const std::optional<double>& value, int digits) {
  return value ? formatted("%.*g", digits, *value) : "-";
}

std::string rate_text(double rate_per_s) {
  return rate_per_s > 0 ? formatted(", %.3g/s", rate_per_s) : "";
}

std::string progress_text(std::string_view what, double rate_per_s,
                          std::optional<double> time_left_s) {
  std::string text = std::string(what) + rate_text(rate_per_s);
  if (time_left_s) text += ", about " + format_duration(*time_left_s) + " left";
  return text;
}

}  // namespace gapfarm
