#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>
#include <span>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/recordings/run.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/column_map.h"
#include "master/io/logs/row_order.h"

namespace gapfarm {
namespace {

// Seconds since 1970 are 2e9; what is greater than this was never measured.
constexpr double kGreatest = 1e12;

// A file's name without its ending; its folder's where the name says nothing.
std::string stem_of(const std::string& file) {
  const std::filesystem::path path(file);
  const std::string stem = path.stem().string();
  const bool plain = contains(kRowKinds, stem, &RowKind::name);
  const std::string folder = path.parent_path().filename().string();
  return plain && !folder.empty() ? folder : stem;
}

class Importer {
 public:
  Importer(const std::vector<Recording>& recordings, const LogMap& map)
      : recordings_(recordings), map_(map) {}

  Result<ImportedRuns> run() {
    for (std::size_t i = 0; i < recordings_.size(); ++i) {
      for (const RowKind& kind : kRowKinds) RETURN_IF_ERROR(take(i, kind));
    }
    for (const RowKind& kind : kRowKinds) {
      const RowTally& tally = tallies_[kind.name];
      const bool wanted = kind.map == &LogMap::poses || kind.map == &LogMap::commands;
      if (wanted && !(map_.*kind.map).columns.empty() && tally.taken == 0)
        return no_rows(recordings_, map_.*kind.map, kind.name);
      RETURN_IF_ERROR(check_order(tally, map_.*kind.map, kind.name));
    }
    assemble();
    // A run or two may be short beside what the clocks differ by; a command or two hold on.
    const bool shared = std::ranges::any_of(out_.log.runs, [](const LoggedRun& one) {
      return one.commands.size() < 3 || check_times(one, "", 0);
    });
    for (const LoggedRun& one : out_.log.runs) {
      RETURN_IF_ERROR(check_times(one, recordings_.front().file, shared ? kClocksApart_s : 0));
    }
    shift_clocks();
    report();
    return std::move(out_);
  }

 private:
  Status take(std::size_t recording, const RowKind& kind) {
    const TableMap& map = map_.*kind.map;
    if (map.columns.empty()) return {};
    for (const LogTable& table : recordings_[recording].tables) {
      if (&map == &map_.commands && has_all(table, map) && has_all(table, map_.poses)) {
        RETURN_IF_ERROR(check_reading(table, map_));
      }
      if (!map.source.empty() && table.topic != map.source && !table.source.ends_with(map.source)) {
        continue;
      }
      if (!has_all(table, map)) continue;
      return take_table(recording, table, kind);
    }
    return {};
  }

  Status take_table(std::size_t recording, const LogTable& table, const RowKind& kind) {
    const TableMap& map = map_.*kind.map;
    const bool poses = kind.rows == nullptr;
    std::vector<std::size_t> at;
    std::vector<SiLine> lines;
    for (const MappedColumn& c : map.columns) {
      at.push_back(*table.find(c.column));
      ASSIGN_OR_RETURN(const auto line, si_line(table, map, c, poses));
      lines.push_back(line);
      if (c.rate && c.wraps == 0 && seems_to_wrap(table, at.back())) {
        out_.report.push_back(
            "column " + c.column +
            " steps by more than half of its range: if its counter wraps, write wraps = (how many "
            "it counts to) for it in the map");
      }
    }
    std::optional<std::size_t> session, run, keep;
    for (const auto& [name, to] :
         {std::pair{&map.session, &session}, {&map.run, &run}, {&map.keep, &keep}}) {
      if (name->empty()) continue;
      *to = table.find(*name);
      if (!*to) {
        return Error{table.source + ":1: found no column " + quoted_word(*name) +
                     ", expected it for [" + kind.name + "]" + suggestion(*name, table.columns)};
      }
    }
    std::vector<double> counts(at.size(), NAN);
    std::map<RunKey, std::vector<double>> before;  // of each run: its last row
    RowTally& tally = tallies_[kind.name];
    const std::set<std::size_t> broken = broken_rows(table);
    std::size_t part = 0, legible = 0, garbled = 0;
    std::string first_garbled;
    for (std::size_t r = 0; r < table.rows(); ++r) {
      if (broken.contains(r)) {
        ++part;
        ++tally.blank;
        continue;
      }
      if (keep && !(table.at(r, *keep) != 0)) {
        ++tally.dropped;
        continue;
      }
      std::vector<double> values;
      for (std::size_t c = 0; c < at.size(); ++c) {
        const double count = counted_on(map.columns[c].wraps, counts[c], table.at(r, at[c]));
        values.push_back(lines[c].slope * count + lines[c].offset);
        if (std::isfinite(count)) counts[c] = count;
      }
      const bool whole =
          std::ranges::all_of(values, [](double v) { return std::abs(v) < kGreatest; });
      if (!whole || (poses && !to_pose(map, values))) {
        if (map.increments || map.intervals) return broken_chain(table, r, kind.name);
        ++tally.blank;
        for (const std::size_t column : at) {
          const std::string text = cell(table, column, r);
          if (text.empty() || parse_double(text)) continue;
          if (garbled++ == 0)
            first_garbled = quoted_word(text) + " in row " + std::to_string(r + 1);
          break;
        }
        continue;
      }
      ++legible;
      const RunKey key{cell(table, session, r), part_of(cell(table, run, r), part)};
      const bool leads_on = poses && (map.intervals || before.count(key) != 0);
      if (leads_on && map.increments && std::abs(values[3]) > std::numbers::pi) {
        return Error{table.source + ": found a turn of " + format_double(values[3]) +
                     " rad in row " + std::to_string(r + 1) +
                     ", expected at most half a turn of an increment; of degrees say so in the "
                     "map: theta = { column = ..., unit = \"deg\" }"};
      }
      if (leads_on && values.size() > 4) {
        if (const auto fault = fault_of_noise(std::span(values).subspan(4))) {
          return Error{table.source + ": found " + fault->found + " in row " +
                       std::to_string(r + 1) + ", expected " + fault->expected + "; " +
                       fault->remedy};
        }
      }
      if (!at_its_time(map, poses, before[key], values)) continue;
      Stretches& stretches = stretches_[kind.name][recording];
      const auto [stretch, begun] = stretches.try_emplace(key);
      if (begun) stretch->second.place = stretches.size();
      put_row(tally, stretch->second, values, table.source, r);
    }
    if (legible > 0 && garbled > legible) {  // of none the column is named
      return Error{
          table.source + ": found no numbers for [" + kind.name + "] in " +
          std::to_string(garbled) + " of " + std::to_string(table.rows()) + " rows, the first " +
          first_garbled +
          ", expected numbers in most of them; write them without signs between thousands"};
    }
    used_.insert(table.source);
    return {};
  }

  static Error broken_chain(const LogTable& table, std::size_t row, const std::string& kind) {
    return Error{table.source + ": found no number for [" + kind + "] in row " +
                 std::to_string(row + 1) +
                 ", expected one in every row, since each leads on from the row before; name what "
                 "lies before and behind it apart by a column and say run = \"COLUMN\" in the map"};
  }

  // Where each row leads on from the row before, those without a number of theirs part the run;
  // none where a kind has a table of its own, which would not be parted with it.
  std::set<std::size_t> broken_rows(const LogTable& table) const {
    std::set<std::size_t> broken;
    for (const RowKind& kind : kRowKinds) {
      const TableMap& map = map_.*kind.map;
      if (!has_all(table, map)) return {};
      if (!map.increments && !map.intervals) continue;
      for (const MappedColumn& c : map.columns) {
        for (std::size_t r = 0; r < table.rows(); ++r) {
          if (!std::isfinite(table.at(r, *table.find(c.column)))) broken.insert(r);
        }
      }
    }
    return broken;
  }

  // A name as it stands: 007 is not 7.
  static std::string cell(const LogTable& table, const std::optional<std::size_t>& column,
                          std::size_t row) {
    if (!column) return "";
    const std::size_t width = table.texts.size() / table.rows();
    if (*column < width) return table.texts[row * width + *column];
    const double number = table.at(row, *column);
    return std::isfinite(number) ? format_double(number) : "";
  }

  static std::string part_of(const std::string& name, std::size_t part) {
    if (part == 0) return name;
    return (name.empty() ? "part" : name) + "_" + std::to_string(part);
  }

  // Recordings that have both kinds are drives of their own; others are put together in order.
  std::vector<std::vector<std::size_t>> groups() {
    std::vector<std::vector<std::size_t>> whole;
    std::vector<std::size_t> only_poses, others;
    for (std::size_t i = 0; i < recordings_.size(); ++i) {
      const auto has = [&](const RowKind& kind) { return stretches_[kind.name].count(i) != 0; };
      const bool poses = has(kRowKinds[0]);
      const bool commanded = std::ranges::any_of(std::span(kRowKinds).subspan(1), has);
      if (poses && commanded) whole.push_back({i});
      if (poses && !commanded) only_poses.push_back(i);
      if (!poses && commanded) others.push_back(i);
    }
    if (only_poses.size() == 1) {
      // One log of poses, with commands and wheels in files of their own.
      only_poses.insert(only_poses.end(), others.begin(), others.end());
      whole.push_back(only_poses);
    } else {
      for (std::size_t k = 0; k < only_poses.size() && k < others.size(); ++k) {
        whole.push_back({only_poses[k], others[k]});
      }
    }
    return whole;
  }

  void assemble() {
    RunLog& log = out_.log;
    log.relative = map_.poses.increments;
    for (const auto& [map, channels] :
         {std::pair{&map_.commands, &log.channels}, {&map_.wheels, &log.wheel_channels}}) {
      for (const MappedColumn& c : map->columns) {
        if (c.role != "t") channels->push_back(c.role);
      }
    }
    const auto all = groups();
    for (const auto& group : all) {
      std::map<RunKey, LoggedRun> runs;
      std::vector<RunKey> order;
      for (const RowKind& kind : kRowKinds) {
        for (const std::size_t i : group) {
          const auto found = stretches_[kind.name].find(i);
          if (found == stretches_[kind.name].end()) continue;
          std::vector<const Stretches::value_type*> appearing;
          for (const auto& named : found->second) appearing.push_back(&named);
          std::ranges::sort(appearing, {}, [](const auto* named) { return named->second.place; });
          for (const auto* named : appearing) {
            add(kind, named->second, runs[named->first], order, named->first);
          }
        }
      }
      // Within a session by their numbers, else by time, and as they appear where each begins at 0.
      const bool numbered = std::ranges::all_of(order, [](const RunKey& key) {
        return std::isfinite(parse_double(key.second).value_or(NAN));
      });
      const std::vector<RunKey> appearing = order;
      std::ranges::stable_sort(order, {}, [&](const RunKey& key) {
        return std::pair(std::ranges::find(appearing, key.first, &RunKey::first),
                         numbered ? *parse_double(key.second) : first_time(runs[key]));
      });
      for (const RunKey& key : order) {
        const auto& [session, name] = key;
        LoggedRun& run = runs[key];
        const std::string stem = stem_of(recordings_[group.front()].file);
        run.session = session;
        run.run = name.empty() ? stem : all.size() == 1 ? name : stem + "_" + name;
        for (std::string* text : {&run.session, &run.run}) {
          for (char& c : *text) c = c == ',' || static_cast<unsigned char>(c) < 0x20 ? '_' : c;
        }
        if (run.poses.size() < 2 || (run.commands.empty() && !log.channels.empty())) {
          out_.report.push_back("left: run " + run_name(run.session, run.run) + ", which has " +
                                (run.poses.empty()      ? "no poses"
                                 : run.poses.size() < 2 ? "one pose"
                                                        : "no commands"));
          continue;
        }
        log.runs.push_back(std::move(run));
      }
    }
  }

  static double first_time(const LoggedRun& run) {
    double first = 1e300;
    if (!run.poses.empty()) first = std::min(first, run.poses.front().t_s);
    if (!run.commands.empty()) first = std::min(first, run.commands.front().t_s);
    return first;
  }

  void add(const RowKind& kind, const Stretch& stretch, LoggedRun& run, std::vector<RunKey>& order,
           const RunKey& key) const {
    if (!contains(order, key)) order.push_back(key);
    const bool increments = kind.rows == nullptr && map_.poses.increments;
    if (increments && map_.poses.intervals) run.poses.push_back({0, {}});
    for (std::size_t i = 0; i < stretch.t_s.size(); ++i) {
      const std::vector<double>& row = stretch.rows[i];
      if (kind.rows != nullptr) {
        (run.*kind.rows).push_back({stretch.t_s[i], row});
        continue;
      }
      // The first one's leads on from a pose that nobody has.
      Pose X{row[0], row[1], row[2]};
      std::optional<Eigen::Matrix3d> noise;
      if (row.size() > 3 && !run.poses.empty()) noise = noise_of(std::span(row).subspan(3));
      if (increments) X = run.poses.empty() ? Pose() : run.poses.back().X_WM * X;
      run.poses.push_back({stretch.t_s[i], X, noise});
    }
  }

  // Times from zero: Unix seconds would eat the digits of milliseconds.
  void shift_clocks() {
    double first = 1e300;
    for (const LoggedRun& run : out_.log.runs) first = std::min(first, first_time(run));
    if (out_.log.runs.empty() || std::abs(first) < 1e6) return;
    out_.clock_start_s = std::floor(first);
    for (LoggedRun& run : out_.log.runs) {
      for (PoseRow& row : run.poses) row.t_s -= out_.clock_start_s;
      for (auto* rows : {&run.commands, &run.wheel_speeds, &run.yaw_rates}) {
        for (CommandRow& row : *rows) row.t_s -= out_.clock_start_s;
      }
    }
  }

  void report() {
    for (const RowKind& kind : kRowKinds) {
      const TableMap& map = map_.*kind.map;
      if (map.columns.empty()) continue;
      const RowTally& tally = tallies_[kind.name];
      const std::string source = map.source.empty() ? "" : " of " + map.source;
      out_.report.push_back(
          "took: " + std::to_string(tally.taken) + " " + kind.name + source + " (" +
          joined(map.columns, ", ", [](const MappedColumn& c) { return c.column; }) + ")");
      const std::pair<std::size_t, std::string> omitted[] = {
          {tally.dropped, " where " + map.keep + " is 0"},
          {tally.blank, " without all their numbers"},
          {tally.back, " whose time goes back"}};
      for (const auto& [n, why] : omitted) {
        if (n > 0)
          out_.report.push_back("omitted: " + std::to_string(n) + " rows of " + kind.name + why);
      }
    }
    const MappedColumn* left = map_.commands.find("left");
    if (left != nullptr && map_.commands.intervals && !left->rate && !left->increment) {
      out_.report.push_back(
          "left and right are taken as speeds; of what they turned by in a row "
          "write increment = true into the map");
    }
    for (const Recording& recording : recordings_) {
      for (const LogTable& table : recording.tables) {
        if (used_.count(table.source) != 0) continue;
        out_.report.push_back("omitted: " + table.source + " (" + table.type + ", " +
                              std::to_string(table.rows()) + " rows)");
      }
      for (const std::string& note : recording.notes) out_.report.push_back(note);
    }
  }

  const std::vector<Recording>& recordings_;
  const LogMap& map_;
  std::map<std::string, std::map<std::size_t, Stretches>> stretches_;  // by kind and recording
  std::map<std::string, RowTally> tallies_;
  std::set<std::string> used_;
  ImportedRuns out_;
};

}  // namespace

Result<ImportedRuns> to_runs(const std::vector<Recording>& recordings, const LogMap& map) {
  LogMap ordered = map;
  // The time stands first in every row.
  for (const RowKind& kind : kRowKinds) {
    std::ranges::stable_partition((ordered.*kind.map).columns,
                                  [](const MappedColumn& c) { return c.role == "t"; });
  }
  return Importer(recordings, ordered).run();
}

}  // namespace gapfarm
