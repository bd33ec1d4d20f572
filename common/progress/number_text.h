// Times, shares and numbers in words.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace gapfarm {

// "1 h 02 min", "3 min 20 s", "12 s", "0.4 s"; "?" for what is no time.
std::string format_duration(double seconds);

// In UTC, as strftime() writes it, up to 39 characters.
std::string utc_text(double unix_s, const char* format);

// "0 %", "0.4 %", "37 %"; "100 %" only for all of it.
std::string format_share(double share);

// Six significant digits, "-" for none.
std::string format_number(const std::optional<double>& value, int digits = 6);
// ", 210/s"; "" while there is none.
std::string rate_text(double rate_per_s);
// "generation 41 of 100, 210/s, about 12 s left": the text of a progress line.
std::string progress_text(std::string_view what, double rate_per_s,
                          std::optional<double> time_left_s);

}  // namespace gapfarm
