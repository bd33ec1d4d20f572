#include <cmath>
#include <optional>

#include "common/base/text.h"
#include "common/trials/files.h"
#include "common/trials/read.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

constexpr double kDay_s = 86400;
constexpr double kUnit_m = 0.01;

std::optional<double> number(std::string_view word) {
  const auto value = parse_double(word);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

// "16:12:42:973:999" in seconds of the day.
std::optional<double> time_of(std::string_view word) {
  constexpr double kParts_s[] = {3600, 60, 1, 1e-3, 1e-6};
  double time_s = 0;
  for (std::size_t part = 0; part < 5; ++part) {
    const std::size_t end = part < 4 ? word.find(':') : word.size();
    if (end == std::string_view::npos) return {};
    const auto value = number(word.substr(0, end));
    if (!value || *value < 0) return {};
    time_s += *value * kParts_s[part];
    word.remove_prefix(std::min(end + 1, word.size()));
  }
  return time_s;
}

class Reader {
 public:
  // The sentence of what is wrong with a line, if anything.
  std::optional<std::string> take(const std::vector<std::string_view>& tokens) {
    if (tokens.size() < 5) return {};
    const bool pose = tokens[4] == "CAMPOSE", targets = tokens[4] == "WAYPOINTS";
    if (!pose && !targets) return {};
    auto time_s = time_of(tokens[0]);
    if (!time_s) return "a time HH:MM:SS:mmm:uuu";
    std::vector<double> numbers;
    for (std::size_t i = 6; i < tokens.size() && tokens[i] != "["; ++i) {
      const auto value = number(tokens[i]);
      if (!value) return "a number in place of '" + std::string(tokens[i]) + "'";
      numbers.push_back(*value);
    }
    return pose ? take_pose(*time_s, numbers) : take_targets(*time_s, numbers);
  }

  WaypointLog log;

 private:
  double since_first(double time_s) const {
    const double since = time_s - *first_s_;
    return since < 0 ? since + kDay_s : since;
  }

  std::optional<std::string> take_pose(double time_s, const std::vector<double>& numbers) {
    if (numbers.size() != 3) return "x, y and theta after CAMPOSE id";
    if (!first_s_) {
      before_ = Pose{numbers[0] * kUnit_m, numbers[1] * kUnit_m, wrap_angle(numbers[2])};
      return {};
    }
    log.path.push_back({since_first(time_s),
                        {numbers[0] * kUnit_m, numbers[1] * kUnit_m, wrap_angle(numbers[2])}});
    return {};
  }

  std::optional<std::string> take_targets(double time_s, const std::vector<double>& numbers) {
    if (numbers.empty() || numbers.size() != 1 + 2 * static_cast<std::size_t>(numbers[0])) {
      return "a count and as many x and y after WAYPOINTS id";
    }
    const Eigen::Vector2d target = kUnit_m * Eigen::Vector2d(numbers[1], numbers[2]);
    if (target.isZero()) return {};
    if (!first_s_) {
      first_s_ = time_s;
      if (before_) log.path.push_back({0, *before_});
    }
    if (log.targets.empty() || log.targets.back() != target) log.targets.push_back(target);
    return {};
  }

  std::optional<double> first_s_;  // of the first order
  std::optional<Pose> before_;
};

}  // namespace

Result<WaypointLog> parse_waypoint_log(std::string_view text, const std::string& file) {
  Reader reader;
  std::size_t line_number = 0;
  for (const std::string_view line : lines_of(text)) {
    ++line_number;
    if (const auto expected = reader.take(tokens_of(line))) {
      return text_error(file, {line_number, 1}, "a broken line", *expected);
    }
  }
  if (reader.log.targets.empty() || reader.log.path.empty()) {
    return Error{file +
                 ": there are no WAYPOINTS with CAMPOSE lines after them; is it a blendersim "
                 "way-point log?"};
  }
  return reader.log;
}

Result<WaypointLog> read_waypoint_log(const std::string& file) {
  return parse_file(file, parse_waypoint_log);
}

}  // namespace gapfarm
