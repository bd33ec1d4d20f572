#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/base/text.h"
#include "common/recordings/run.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/column_map.h"

namespace gapfarm {
namespace {

constexpr std::uint64_t kMostBytes = 1ull << 30;
// Logs of numbers pack ten times; more than this is a broken size and not worth the memory.
constexpr std::uint64_t kMostRatio = 5000;

bool unpack_lz4(std::string_view bytes, std::string& to) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) return false;
  std::size_t in = 0, out = 0, hint = 1;
  while (hint != 0 && in < bytes.size()) {
    std::size_t room = to.size() - out, rest = bytes.size() - in;
    hint = LZ4F_decompress(context, to.data() + out, &room, bytes.data() + in, &rest, nullptr);
    if (LZ4F_isError(hint) || (room == 0 && rest == 0)) break;
    in += rest;
    out += room;
  }
  const bool fine = !LZ4F_isError(hint) && out == to.size();
  LZ4F_freeDecompressionContext(context);
  return fine;
}

bool unpack_bz2(std::string_view bytes, std::string& to) {
  auto size = static_cast<unsigned>(to.size());
  // bzlib takes what it reads as char*.
  const int code = BZ2_bzBuffToBuffDecompress(to.data(), &size, const_cast<char*>(bytes.data()),
                                              static_cast<unsigned>(bytes.size()), 0, 0);
  return code == BZ_OK && size == to.size();
}

bool unpack_zstd(std::string_view bytes, std::string& to) {
  const std::size_t size = ZSTD_decompress(to.data(), to.size(), bytes.data(), bytes.size());
  return !ZSTD_isError(size) && size == to.size();
}

}  // namespace

Result<std::string> decompress(std::string_view bytes, const std::string& how, std::uint64_t size) {
  if (how.empty() || how == "none") return std::string(bytes);
  const bool lz4 = how == "lz4", bz2 = how == "bz2", zstd = how == "zstd";
  if (!lz4 && !bz2 && !zstd) {
    return Error{"found a chunk packed by " + quoted_word(how) +
                 ", expected none, bz2, lz4 or zstd"};
  }
  if (size > kMostBytes || size > (bytes.size() + 64) * kMostRatio) {
    return Error{"found a chunk of " + std::to_string(bytes.size()) +
                 " bytes that claims to hold " + std::to_string(size) +
                 ", expected at most 1 GiB and " + std::to_string(kMostRatio) +
                 " times its own size"};
  }
  std::string to(size, '\0');
  const bool fine = lz4   ? unpack_lz4(bytes, to)
                    : bz2 ? unpack_bz2(bytes, to)
                          : unpack_zstd(bytes, to);
  if (fine) return to;
  return Error{"found a chunk that " + how + " does not unpack to its " + std::to_string(size) +
               " bytes, expected whole chunks"};
}

namespace {

// Nanoseconds of a clock, micrometres of a pose: more digits are noise.
std::string digits(double value, int decimals) {
  std::string out = formatted("%.*f", decimals, value);
  out.erase(out.find_last_not_of('0') + 1);
  if (out.ends_with('.')) out.pop_back();
  return out == "-0" ? "0" : out;
}

bool has_sessions(const RunLog& log) {
  return std::ranges::any_of(log.runs, [](const LoggedRun& run) { return !run.session.empty(); });
}

// "session,run," of a row, as the head has it.
std::string key_of(const RunLog& log, const LoggedRun& run) {
  return (has_sessions(log) ? csv_field(run.session) + "," : "") + csv_field(run.run) + ",";
}

std::string format_commands(const std::vector<std::string>& channels, const RunLog& log,
                            std::vector<CommandRow> LoggedRun::*rows) {
  std::string out = has_sessions(log) ? "session,run,t" : "run,t";
  for (const std::string& channel : channels) out += "," + csv_field(channel);
  out += "\n";
  bool any = false;
  for (const LoggedRun& run : log.runs) {
    const std::string key = key_of(log, run);
    for (const CommandRow& row : run.*rows) {
      out += key + digits(row.t_s, 6);
      for (const double value : row.values) out += "," + digits(value, 9);
      out += "\n";
      any = true;
    }
  }
  return any ? out : "";
}

class FileSource : public ByteSource {
 public:
  static Result<FileSource> open(const std::string& path) {
    if (is_folder(path)) {
      return Error{path + ": a folder; give the file in it (.db3, .mcap, .bag or .csv)"};
    }
    FileSource source;
    std::error_code code;
    source.file_.open(path, std::ios::binary);
    source.size_ = std::filesystem::file_size(path, code);
    if (!source.file_ || code) {
      return Error{path + ": no such file, or it cannot be read; check the path"};
    }
    return source;
  }
  std::uint64_t size() const override { return size_; }
  bool read(std::uint64_t offset, std::size_t count, std::string& to) override {
    if (offset > size_ || size_ - offset < count) return false;
    to.resize(count);
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(offset));
    file_.read(to.data(), static_cast<std::streamsize>(count));
    return file_.gcount() == static_cast<std::streamsize>(count);
  }

 private:
  std::ifstream file_;
  std::uint64_t size_ = 0;
};

}  // namespace

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
  files.poses = has_sessions(log) ? "session," : "";
  files.poses += log.relative ? "run,t,dx,dy,dtheta" : "run,t,x,y,theta";
  for (const std::string& name : kCovarianceColumns) files.poses += noisy ? "," + name : "";
  files.poses += "\n";
  // Increments add up, and so does what is rounded off.
  const int places = log.relative ? 9 : 6;
  for (const LoggedRun& run : log.runs) {
    const std::string key = key_of(log, run);
    Pose before = run.poses.empty() ? Pose() : run.poses.front().X_WM;
    for (const PoseRow& row : run.poses) {
      const Pose X = log.relative ? inverse(before) * row.X_WM : row.X_WM;
      files.poses += key + digits(row.t_s, 6) + "," + digits(X.x, places) + "," +
                     digits(X.y, places) + "," + digits(X.theta, places + 1);
      const Eigen::Matrix3d noise = row.noise.value_or(Eigen::Matrix3d::Zero());
      for (Eigen::Index r = 0; r < 3 && noisy; ++r) {
        // Covariances have no digits that count from the point.
        for (Eigen::Index c = r; c < 3; ++c) files.poses += formatted(",%.6g", noise(r, c));
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

std::vector<double> LogTable::numbers(std::string_view name) const {
  std::vector<double> there;
  const auto column = find(name);
  for (std::size_t r = 0; column && r < rows(); ++r) {
    if (std::isfinite(at(r, *column))) there.push_back(at(r, *column));
  }
  return there;
}

}  // namespace gapfarm
