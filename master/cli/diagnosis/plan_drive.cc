#include "master/cli/diagnosis/plan_drive.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/base/ranges.h"
#include "common/base/text_table.h"
#include "common/parameters/ground.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/column_map.h"
#include "master/report/figures/figures.h"

namespace gapfarm {
namespace {

using plan::DrivePlan;
using plan::WidthsAt;

constexpr double kUsual = 0.02;  // of a recorded channel's rows lie beyond its limits, each way
constexpr double kRecordedEvery_s = 1;
constexpr double kMarks_s[] = {5, 10, 20, 30, 60, 120, 300, 600};

std::optional<double> number_of(std::string_view text) {
  const double scale = text.ends_with('%') ? 0.01 : 1;
  if (text.ends_with('%')) text.remove_suffix(1);
  const auto value = parse_double(text);
  return value && std::isfinite(*value) ? std::optional(scale * *value) : std::nullopt;
}

Result<std::vector<plan::Wanted>> wanted_of(const std::vector<std::string>& texts,
                                            const std::vector<KinematicRow>& rows) {
  std::vector<plan::Wanted> all;
  for (const std::string& text : texts) {
    const auto [name, width_text] = cut_at(text, '=');
    plan::Wanted wanted{name, 0};
    if (!contains(rows, wanted.name, &KinematicRow::name)) {
      return Error{"this robot has no value \"" + wanted.name + "\", expected one of " +
                   joined(rows, ", ", &KinematicRow::name)};
    }
    if (width_text) {
      const auto width = number_of(*width_text);
      if (!width || *width <= 0) {
        return Error{"--want is '" + text +
                     "', expected a value's name and how wide its 90 % interval may be, such as "
                     "separation=0.5% or delay=0.02"};
      }
      if (*width >= 1) {
        return Error{"--want is '" + text + "', a width of " + fmt::format("{:g}", 100 * *width) +
                     " %, or of a metre, a second or a radian and more, which nobody has to drive "
                     "for; for a hundredth write " +
                     name + "=1%"};
      }
      wanted.width = *width;
    }
    all.push_back(wanted);
  }
  return all;
}

// What the recorded runs command, but for the rarest values.
std::map<std::string, Interval> recorded_limits(const std::vector<std::string>& channels,
                                                const RunLog& log) {
  std::map<std::string, Interval> limits;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    std::vector<double> values;
    for (const LoggedRun& run : log.runs) {
      for (const CommandRow& row : run.commands) values.push_back(row.values[c]);
    }
    if (values.empty()) continue;
    std::ranges::sort(values);
    const auto at = [&](double share) {
      return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
    };
    limits[channels[c]] = {std::min(0.0, at(kUsual)), std::max(0.0, at(1 - kUsual))};
  }
  return limits;
}

Result<std::vector<Interval>> limits_of(const std::vector<std::string>& texts,
                                        const std::vector<std::string>& channels,
                                        const RunLog& recorded) {
  std::map<std::string, Interval> limits = recorded_limits(channels, recorded);
  for (const std::string& text : texts) {
    const auto [name, range] = cut_at(text, '=');
    auto ends = mapped(parts_of(range.value_or(""), ','), number_of);
    if (ends.size() == 1 && ends[0]) ends.insert(ends.begin(), -*ends[0]);
    if (ends.size() != 2 || !ends[0] || !ends[1] || *ends[0] >= *ends[1] ||
        !contains(channels, name)) {
      return Error{"--limit is '" + text + "', expected CHANNEL=MOST or CHANNEL=LEAST,MOST with " +
                   "one of the robot's channels " + joined(channels) + ", such as " +
                   channels.front() + "=0.5"};
    }
    limits[name] = {*ends[0], *ends[1]};
  }
  std::vector<Interval> all;
  for (const std::string& channel : channels) {
    if (limits.count(channel) == 0 || limits[channel].lower >= limits[channel].upper) {
      return Error{"nothing says how much of channel " + channel +
                   " may be commanded; add --limit " + channel +
                   "=MOST, or a config with runs, whose limits are taken"};
    }
    all.push_back(limits[channel]);
  }
  return all;
}

std::string width_text(const KinematicRow& row, double width) {
  return row.key == "ratio" ? fmt::format("{:.3g} %", 100 * width)
                            : fmt::format("{:.3g} {}", width, row.unit);
}

const WidthsAt& last_before(const std::vector<WidthsAt>& widths, double t_s) {
  const WidthsAt* last = &widths.front();
  for (const WidthsAt& at : widths) {
    if (at.t_s <= t_s + 1e-9) last = &at;
  }
  return *last;
}

struct NamedWidths {
  std::string name;  // "recorded", "random moves"
  std::vector<WidthsAt> widths;
};

TextTable table_of(const DrivePlan& drive, const std::vector<NamedWidths>& others) {
  const double end = drive.widths.back().t_s;
  TextTable table{{"90 % interval"}, mapped(drive.rows, [](const KinematicRow& row) {
                    return TextTable::Row{row.name};
                  })};
  const auto column = [&](const std::vector<WidthsAt>& widths, double t, const std::string& name) {
    const WidthsAt& at = last_before(widths, t);
    table.head.push_back(fmt::format("{:.0f} s{}", at.t_s, name));
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
      table.rows[k].push_back(width_text(drive.rows[k], at.widths[k]));
    }
  };
  for (const double mark : kMarks_s) {
    if (mark < 0.9 * end) column(drive.widths, mark, "");
  }
  column(drive.widths, end, "");
  for (const NamedWidths& other : others) column(other.widths, end, " " + other.name);
  return table;
}

Json widths_json(const std::vector<WidthsAt>& widths) {
  return mapped(widths, [](const WidthsAt& at) -> Json {
    return {{"seconds", at.t_s},
            {"widths", std::vector<double>(at.widths.begin(), at.widths.end())}};
  });
}

// For people, and for programs.
std::pair<std::string, Json> result_of(const DrivePlan& drive,
                                       const std::vector<NamedWidths>& others,
                                       const plan::DriveNoise& noise,
                                       const std::vector<plan::Wanted>& wanted,
                                       const std::string& out) {
  std::string text =
      fmt::format(
          "noise (of the config; a fitted model knows it better): "
          "{:.2g} m and {:.2g} rad a reading, {:.2g} m and {:.2g} rad after a metre\n",
          noise.position_m, noise.heading_rad, noise.travel, noise.turn) +
      table_of(drive, others).text("<>");
  Json json = {{"out", out}};
  json["values"] = mapped(drive.rows, [](const KinematicRow& row) -> Json {
    return {{"name", row.name}, {"unit", row.unit}};
  });
  json["planned"] = widths_json(drive.widths);
  for (const NamedWidths& other : others) {
    json[other.name] = widths_json(other.widths);
    const WidthsAt& at = last_before(other.widths, drive.widths.back().t_s);
    const auto seconds = plan::seconds_until(drive, wanted, at.widths);
    json[other.name + "_reached_after_s"] = nullptr;
    if (!seconds) continue;
    json[other.name + "_reached_after_s"] = *seconds;
    text += fmt::format(
        "As narrow as after {:.0f} s {}, for the wanted together: after {:.1f} s of this drive\n",
        at.t_s, other.name, *seconds);
  }
  const WidthsAt& end = drive.widths.back();
  json["wider_than_wanted"] = Json::array();
  for (const plan::Wanted& w : wanted) {
    const auto row = std::ranges::find(drive.rows, w.name, &KinematicRow::name);
    const double width = end.widths[row - drive.rows.begin()];
    if (w.width == 0 || width <= w.width) continue;
    json["wider_than_wanted"].push_back(w.name);
    text += fmt::format(
        "{} stays wider than wanted: {} after {:.0f} s, wanted {}; give more --seconds (widths "
        "shrink as the root of them), or a larger floor\n",
        w.name, width_text(*row, width), end.t_s, width_text(*row, w.width));
  }
  json["best_share"] = drive.best_share;
  text += fmt::format(
      "No drive of as many seconds of such moves makes them more than {:.0f} % narrower, for the "
      "wanted together, even if the pose were known between moves\n",
      std::ceil(100 * (1 - drive.best_share)));
  const auto commands = sum_of(drive.drive.runs, [](auto& run) { return run.commands.size(); });
  text += fmt::format(
      "{}/commands.csv: {} commands in {} run(s), {:.1f} s; waypoints.csv: where the marker should "
      "be as each ends, from the middle of the floor, heading along x\n",
      out, commands, drive.drive.runs.size(), drive.widths.back().t_s);
  return {text, json};
}

std::string drive_picture(const DrivePlan& drive, const plan::DriveSettings& settings) {
  const double x = settings.length_m / 2, y = settings.width_m / 2;
  const auto place = [](const Pose& X) { return SvgPoint{X.x, X.y}; };
  ChartSeries floor{"the floor", {{-x, -y}, {x, -y}, {x, y}, {-x, y}, {-x, -y}}};
  ChartSeries headings{.name = "heading as a move ends", .arrows = true};
  LineChart chart;
  chart.title = "The drive";
  chart.x_title = "x, m";
  chart.y_title = "y, m";
  chart.equal_axes = true;
  for (const LoggedRun& run : drive.drive.runs) {
    const auto X_WM = mapped(run.poses, &PoseRow::X_WM);
    chart.series.push_back({"run " + run.run, mapped(X_WM, place)});
    for (const Pose& X : X_WM) {
      headings.line.insert(headings.line.end(),
                           {place(X), place(X * Pose{0.03 * settings.length_m, 0, 0})});
    }
  }
  chart.series.insert(chart.series.end(), {headings, floor});
  return line_chart(chart);
}

}  // namespace

Result<int> run_plan_drive(PlanOptions& options, const Config& config, CliContext& context) {
  Outputs& outputs = options.outputs;
  const Problem& problem = config.problem;
  const GroundRobot robot = problem.ground->robot_at(problem.values);
  const auto value = [&](const char* key) { return problem.values[problem.table().row(key)]; };
  const plan::DriveNoise noise{value(kGroundTravelNoise), value(kGroundTurnNoise),
                               value(kGroundPositionNoise), value(kGroundHeadingNoise)};
  RunLog recorded;
  if (!config.trial_files.empty()) {
    outputs.reads_runs(config.trial_files);
    ASSIGN_OR_RETURN(recorded, read_run_folders(config.trial_files, robot.channels));
  }
  plan::DriveSettings& settings = options.drive;
  ASSIGN_OR_RETURN(settings.wanted, wanted_of(options.wanted, kinematic_rows(robot)));
  ASSIGN_OR_RETURN(settings.limits, limits_of(options.limits, robot.channels, recorded));
  RETURN_IF_ERROR(outputs.plan_in(options.out, {"commands.csv", "waypoints.csv"}));
  RETURN_IF_ERROR(outputs.plan({options.picture}));
  if (context.dry_run) {
    return print_dry_run(fmt::format("plan a drive of {:.0f} s for {} into {}", settings.seconds,
                                     options.source, options.out),
                         {{"out", options.out}, {"seconds", settings.seconds}}, {}, config.farm,
                         context);
  }
  context.begun = true;
  context.console.progress(fmt::format("planning {:.0f} s of driving", settings.seconds));
  ASSIGN_OR_RETURN(DrivePlan drive, plan::plan_drive(robot, noise, settings));
  std::vector<NamedWidths> others;
  settings.random = true;
  ASSIGN_OR_RETURN(const DrivePlan random, plan::plan_drive(robot, noise, settings));
  others.push_back({"random", random.widths});
  if (!recorded.runs.empty()) {
    others.push_back({"recorded", plan::widths_of(robot, noise, recorded, kRecordedEvery_s)});
  }
  drive.drive.channels = robot.channels;
  const RunFiles files = format_runs(drive.drive);
  RETURN_IF_ERROR(outputs.write_in(
      options.out, {{"commands.csv", files.commands}, {"waypoints.csv", files.poses}}));
  if (!options.picture.empty()) {
    RETURN_IF_ERROR(outputs.write(options.picture, drive_picture(drive, settings)));
  }
  const auto [text, json] = result_of(drive, others, noise, settings.wanted, options.out);
  context.console.result(text, json);
  return kExitDone;
}

}  // namespace gapfarm
