#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/recordings/run.h"
#include "common/trials/files.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
namespace {

// What is larger was never matched: matchers that failed report such numbers, or 1e6.
constexpr double kMost_m = 10, kMost_rad = std::numbers::pi;
constexpr const char* kNoMatch =
    "a row whose match failed has no increment; name what lies before and behind it two runs";
constexpr double kLeastShare = 1e-9;  // of a correlation matrix's determinant

}  // namespace

Eigen::Matrix3d noise_of(std::span<const double> columns) {
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  if (columns.size() == 3) {
    for (Eigen::Index k = 0; k < 3; ++k) C(k, k) = std::pow(columns[k], 2);
    return C;
  }
  std::size_t at = 0;
  for (Eigen::Index r = 0; r < 3; ++r) {
    for (Eigen::Index c = r; c < 3; ++c) C(r, c) = C(c, r) = columns[at++];
  }
  return C;
}

std::optional<NoiseFault> fault_of_noise(std::span<const double> columns) {
  const bool deviations = columns.size() == 3;
  const auto& names = deviations ? kDeviationColumns : kCovarianceColumns;
  const Eigen::Matrix3d C = noise_of(columns);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const std::size_t at = static_cast<std::size_t>(deviations ? k : k == 0 ? 0 : 2 * k + 1);
    const double most = k < 2 ? kMost_m : kMost_rad, limit = deviations ? most : most * most;
    if (columns[at] > 0 && columns[at] <= limit) continue;
    return NoiseFault{names[at] + " " + format_double(columns[at]),
                      "a number above 0 and up to " + format_double(limit) +
                          (deviations ? k < 2 ? " m" : " rad"
                           : k < 2    ? " m^2"
                                      : " rad^2")};
  }
  const Eigen::Vector3d scale = C.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix3d R = scale.asDiagonal() * C * scale.asDiagonal();
  // Of a correlation matrix, with Sylvester's minors.
  const double xy = R(0, 1), xt = R(0, 2), yt = R(1, 2);
  const double minor = 1 - xy * xy;
  const double determinant = minor - xt * xt - yt * yt + 2 * xy * xt * yt;
  if (minor > kLeastShare && determinant > kLeastShare) return {};
  return NoiseFault{"a covariance that is not positive definite",
                    "cov_xy, cov_xt and cov_yt that its variances allow", kNoMatch};
}

Eigen::Matrix3d chained_noise(const Pose& X_AB, const Eigen::Matrix3d& of_AB, const Pose& X_BC,
                              const Eigen::Matrix3d& of_BC) {
  const Pose X_AC = X_AB * X_BC;
  Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
  J(0, 2) = -(X_AC.y - X_AB.y);
  J(1, 2) = X_AC.x - X_AB.x;
  return J * of_AB * J.transpose() + rotate_covariance(of_BC, X_AB.theta);
}

namespace {

constexpr double kThousand = 300;  // milliseconds for seconds, whatever else differs
constexpr std::size_t kRowsAlike = 10;

// A session and a run in it.
using RunKey = std::pair<std::string, std::string>;

// What is wrong with a row's values; `first`: of its run.
using RowCheck = std::optional<NoiseFault> (*)(std::span<const double> values, bool first);

// One file of rows "[session,]run,t,NAMES...".
class RunTable {
 public:
  static Result<RunTable> read(const std::string& path, std::span<const std::string> names,
                               const char* format, RowCheck check = nullptr) {
    ASSIGN_OR_RETURN(const auto text, read_text_file(path));
    ASSIGN_OR_RETURN(auto rows, parse_csv(text, path));
    if (rows.empty()) return text_error(path, {}, "an empty file", format);
    RunTable table;
    table.check_ = check;
    table.names_ = {"run", "t"};
    table.names_.insert(table.names_.end(), names.begin(), names.end());
    ASSIGN_OR_RETURN(auto header, CsvHeader::match(rows.front(), table.names_, path, format));
    std::optional<std::size_t> session;
    for (const std::size_t column : header.extra()) {
      if (rows.front().fields[column].text == "session") session = column;
    }
    for (std::size_t i = 1; i < rows.size(); ++i) {
      const CsvRow& row = rows[i];
      RETURN_IF_ERROR(check_width(row, header, path));
      RETURN_IF_ERROR(table.take(row, header, session, path));
    }
    if (table.rows_.empty()) return text_error(path, {2, 1}, "no rows", format);
    return table;
  }

  const std::vector<RunKey>& order() const { return order_; }
  const std::vector<CommandRow>& of(const RunKey& key) const { return rows_.at(key); }
  bool has(const RunKey& key) const { return rows_.count(key) > 0; }

 private:
  Status take(const CsvRow& row, const CsvHeader& header, std::optional<std::size_t> session,
              const std::string& path) {
    CsvRowReader reader(row, header, names_, path);
    const RunKey key{session ? row.fields[*session].text : "", reader.word(0)};
    CommandRow to;
    to.t_s = reader.number(1, -1e12, 1e12, "s");
    for (std::size_t c = 2; c < names_.size(); ++c) {
      to.values.push_back(reader.number(c, -1e9, 1e9, ""));
    }
    if (reader.error()) return *reader.error();
    auto [entry, fresh] = rows_.try_emplace(key);
    if (fresh) order_.push_back(key);
    if (const auto fault = check_ != nullptr ? check_(to.values, fresh) : std::nullopt) {
      return text_error(path, reader.field(2).place, fault->found, fault->expected, fault->remedy);
    }
    if (!fresh && to.t_s < entry->second.back().t_s) {
      return text_error(path, reader.field(1).place, reader.field(1).text,
                        "a time of at least " + format_double(entry->second.back().t_s) +
                            " s, which the row before has",
                        "times ascend within a run; sort the rows or name runs apart");
    }
    entry->second.push_back(std::move(to));
    return {};
  }

  RowCheck check_ = nullptr;
  std::vector<std::string> names_;
  std::map<RunKey, std::vector<CommandRow>> rows_;
  std::vector<RunKey> order_;
};

Result<std::vector<std::string>> header_of(const std::string& path) {
  ASSIGN_OR_RETURN(const auto text, read_text_file(path));
  ASSIGN_OR_RETURN(const auto head,
                   parse_csv(std::string_view(text).substr(0, text.find('\n')), path));
  if (head.empty()) return std::vector<std::string>();
  return mapped(head.front().fields, &CsvField::text);
}

// The columns of poses: of increments with those of their noise, where the header has some.
std::vector<std::string> pose_columns(std::span<const std::string> header) {
  const auto has = [&](const std::string& name) { return contains(header, name); };
  if (!has("dx")) return {"x", "y", "theta"};
  std::vector<std::string> names = {"dx", "dy", "dtheta"};
  for (const auto* noise : {&kCovarianceColumns, &kDeviationColumns}) {
    if (names.size() > 3 || std::none_of(noise->begin(), noise->end(), has)) continue;
    names.insert(names.end(), noise->begin(), noise->end());
  }
  return names;
}

// The first row of a run is from a pose that nobody has.
std::optional<NoiseFault> fault_of_increment(std::span<const double> values, bool first) {
  if (first) return {};
  if (std::abs(values[2]) > std::numbers::pi) {
    return NoiseFault{"dtheta " + format_double(values[2]),
                      "a turn of at most half a turn, in rad; degrees times pi / 180 are that"};
  }
  return values.size() > 3 ? fault_of_noise(values.subspan(3)) : std::nullopt;
}

std::optional<NoiseFault> fault_of_return(std::span<const double> values, bool) {
  auto fault = fault_of_noise(values);
  if (fault) fault->remedy = "say how far from where it began the robot may have stood";
  return fault;
}

// Rows at the time of the one before are omitted, but for what they moved on.
std::size_t add_poses(const std::vector<CommandRow>& rows, bool increments, LoggedRun* run) {
  std::size_t repeated = 0;
  Pose X_WM;
  for (const CommandRow& row : rows) {
    // As it stands: of degrees a wrapped heading leaves nothing.
    const Pose read{row.values[0], row.values[1], row.values[2]};
    // The first one's is from a pose that nobody has.
    X_WM = !increments ? read : run->poses.empty() ? Pose() : X_WM * read;
    std::optional<Eigen::Matrix3d> noise;
    if (increments && row.values.size() > 3 && !run->poses.empty()) {
      noise = noise_of(std::span(row.values).subspan(3));
    }
    if (run->poses.empty() || row.t_s > run->poses.back().t_s) {
      run->poses.push_back({row.t_s, X_WM, noise});
      continue;
    }
    ++repeated;
    PoseRow& last = run->poses.back();
    if (noise && last.noise && run->poses.size() > 1) {
      const Pose X_AB = between(run->poses[run->poses.size() - 2].X_WM, last.X_WM);
      last.noise = chained_noise(X_AB, *last.noise, read, *noise);
    }
    if (increments) last.X_WM = X_WM;
  }
  return repeated;
}

std::string name_of(const RunKey& key) { return run_name(key.first, key.second); }

}  // namespace

Status check_times(const LoggedRun& run, const std::string& where, double apart_s) {
  if (run.commands.empty() || run.poses.empty()) return {};
  const double a = run.commands.front().t_s, b = run.commands.back().t_s;
  const double c = run.poses.front().t_s, d = run.poses.back().t_s;
  // Logs of one drive that have about as many rows last about as long.
  const auto longer = [](double one_s, std::size_t rows, double other_s, std::size_t others) {
    return one_s > kThousand * other_s && rows < kRowsAlike * others && others < kRowsAlike * rows;
  };
  const std::size_t rows = run.commands.size(), poses = run.poses.size();
  const bool apart = c > b + apart_s || d < a - apart_s;
  const bool unit = longer(b - a, rows, d - c, poses) || longer(d - c, poses, b - a, rows);
  if (!apart && !(unit && rows > 2 && poses > 2)) return {};
  const auto span = [](double from, double end) {
    return formatted("%.2f to ", from) + formatted("%.2f s", end);
  };
  return Error{where + ": found poses of run " + quoted_word(run_name(run.session, run.run)) +
               " from " + span(c, d) + " and its commands from " + span(a, b) +
               ", expected one clock for both; does one of them count from another start, or in "
               "milliseconds? Write both in s since the same moment"};
}

Result<RunLog> read_runs(const std::string& commands_path, const std::string& poses_path,
                         std::span<const std::string> channels) {
  ASSIGN_OR_RETURN(const auto commands, RunTable::read(commands_path, channels, "a command log"));
  ASSIGN_OR_RETURN(const auto header, header_of(poses_path));
  const std::vector<std::string> columns = pose_columns(header);
  RunLog log;
  log.relative = columns.front() == "dx";
  ASSIGN_OR_RETURN(const auto poses, RunTable::read(poses_path, columns, "a pose log",
                                                    log.relative ? fault_of_increment : nullptr));
  log.channels.assign(channels.begin(), channels.end());
  for (const RunKey& key : poses.order()) {
    if (!commands.has(key)) {
      return Error{poses_path + ": run " + quoted_word(name_of(key)) + " has no commands in " +
                   commands_path};
    }
    LoggedRun run;
    run.session = key.first;
    run.run = key.second;
    run.commands = commands.of(key);
    const std::size_t repeated = add_poses(poses.of(key), log.relative, &run);
    RETURN_IF_ERROR(check_times(run, poses_path));
    if (repeated > 0 && !log.relative) {
      log.notes.push_back(poses_path + ": run " + quoted_word(name_of(key)) + ": " +
                          std::to_string(repeated) + " poses at the time of the one before");
    }
    log.runs.push_back(std::move(run));
  }
  for (const RunKey& key : commands.order()) {
    if (!poses.has(key)) {
      log.notes.push_back(commands_path + ": run " + quoted_word(name_of(key)) +
                          " has no poses and is omitted");
    }
  }
  return log;
}

namespace {

// Rows of a file beside the log's, for the runs that it names.
Status read_beside(const std::string& path, std::span<const std::string> names, const char* format,
                   RowCheck check, std::vector<CommandRow> LoggedRun::*rows, RunLog* log) {
  ASSIGN_OR_RETURN(const auto table, RunTable::read(path, names, format, check));
  for (LoggedRun& run : log->runs) {
    const RunKey key{run.session, run.run};
    if (table.has(key)) run.*rows = table.of(key);
  }
  return {};
}

}  // namespace

Status read_yaw_rates(const std::string& path, RunLog* log) {
  const std::vector<std::string> names = {"yaw_rate"};
  return read_beside(path, names, "a log of yaw rates", nullptr, &LoggedRun::yaw_rates, log);
}

Status read_returns(const std::string& path, RunLog* log) {
  return read_beside(path, kDeviationColumns, "a list of returns", fault_of_return,
                     &LoggedRun::returns, log);
}

Status read_wheel_speeds(const std::string& path, RunLog* log) {
  ASSIGN_OR_RETURN(auto wheels, header_of(path));
  std::erase_if(wheels, [](const std::string& name) {
    return name == "session" || name == "run" || name == "t";
  });
  if (!log->wheel_channels.empty() && log->wheel_channels != wheels) {
    return Error{path + ": other wheels than the logs before have; give all logs the same columns"};
  }
  RETURN_IF_ERROR(
      read_beside(path, wheels, "a log of wheel speeds", nullptr, &LoggedRun::wheel_speeds, log));
  log->wheel_channels = std::move(wheels);
  return {};
}

}  // namespace gapfarm
