#include <filesystem>

#include "common/base/text.h"
#include "common/recordings/increment_noise.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/to_runs.h"

namespace gapfarm {
namespace {

// Nanoseconds of a clock, micrometres of a pose: more digits are noise.
std::string digits(double value, int decimals) {
  std::string out = formatted("%.*f", decimals, value);
  while (out.find('.') != out.npos && (out.back() == '0' || out.back() == '.')) {
    const bool point = out.back() == '.';
    out.pop_back();
    if (point) break;
  }
  return out == "-0" ? "0" : out;
}

// Covariances have no digits that count from the point.
std::string short_number(double value) { return formatted("%.6g", value); }

std::string format_commands(const std::vector<std::string>& channels, const RunLog& log,
                            std::vector<CommandRow> LoggedRun::*rows) {
  std::string out = "run,t";
  for (const std::string& channel : channels) out += "," + csv_field(channel);
  out += "\n";
  bool any = false;
  for (const LoggedRun& run : log.runs) {
    for (const CommandRow& row : run.*rows) {
      out += csv_field(run.run) + "," + digits(row.t_s, 6);
      for (const double value : row.values) out += "," + digits(value, 9);
      out += "\n";
      any = true;
    }
  }
  return any ? out : "";
}

}  // namespace

Result<FileSource> FileSource::open(const std::string& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) {
    return Error{path + ": a folder; give the file in it (.db3, .mcap, .bag or .csv)"};
  }
  FileSource source;
  source.file_.open(path, std::ios::binary);
  source.size_ = std::filesystem::file_size(path, code);
  if (!source.file_ || code) {
    return Error{path + ": no such file, or it cannot be read; check the path"};
  }
  return source;
}

bool FileSource::read(std::uint64_t offset, std::size_t count, std::string& to) {
  if (offset > size_ || size_ - offset < count) return false;
  to.resize(count);
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(offset));
  file_.read(to.data(), static_cast<std::streamsize>(count));
  return file_.gcount() == static_cast<std::streamsize>(count);
}

Result<Recording> read_recording(const std::string& path, bool skip_invalid) {
  ASSIGN_OR_RETURN(auto source, FileSource::open(path));
  std::string head;
  source.read(0, std::min<std::uint64_t>(source.size(), 16), head);
#define FORMAT(file, begins) \
  if (head.rfind(begins, 0) == 0) return read_##file(source, path);
#include "master/io/logs/formats.inc"
  ASSIGN_OR_RETURN(const auto text, read_text_file(path));
  return parse_text_log(text, path, skip_invalid);
}

RunFiles format_runs(const RunLog& log) {
  RunFiles files;
  files.commands = format_commands(log.channels, log, &LoggedRun::commands);
  files.wheels = format_commands(log.wheel_channels, log, &LoggedRun::wheel_speeds);
  files.gyro = format_commands({"yaw_rate"}, log, &LoggedRun::yaw_rates);
  const bool noisy = std::ranges::any_of(
      log.runs, [](const LoggedRun& run) { return !run.poses.empty() && run.poses.back().noise; });
  files.poses = log.relative ? "run,t,dx,dy,dtheta" : "run,t,x,y,theta";
  for (const std::string& name : kCovarianceColumns) files.poses += noisy ? "," + name : "";
  files.poses += "\n";
  // Increments add up, and so does what is rounded off.
  const int places = log.relative ? 9 : 6;
  for (const LoggedRun& run : log.runs) {
    Pose before = run.poses.empty() ? Pose() : run.poses.front().X_WM;
    for (const PoseRow& row : run.poses) {
      const Pose X = log.relative ? inverse(before) * row.X_WM : row.X_WM;
      files.poses += csv_field(run.run) + "," + digits(row.t_s, 6) + "," + digits(X.x, places) +
                     "," + digits(X.y, places) + "," + digits(X.theta, places + 1);
      const Eigen::Matrix3d noise = row.noise.value_or(Eigen::Matrix3d::Zero());
      for (Eigen::Index r = 0; r < 3 && noisy; ++r) {
        for (Eigen::Index c = r; c < 3; ++c) files.poses += "," + short_number(noise(r, c));
      }
      files.poses += "\n";
      before = row.X_WM;
    }
  }
  return files;
}

std::string LogTable::unit_of(std::string_view name) const {
  const auto at = find(name);
  if (!at || *at >= units.size()) return "";
  std::string unit = units[*at].text;
  if (unit.size() > 2 && (unit.front() == '[' || unit.front() == '(')) {
    unit = unit.substr(1, unit.size() - 2);
  }
  return unit;
}

}  // namespace gapfarm
