#include "master/ground/watch/watch_report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/base/text_table.h"
#include "common/json/fields.h"
#include "common/math/laws.h"
#include "master/infer/settings.h"
#include "master/report/figures/figures.h"
#include "master/report/page_frame.h"

namespace gapfarm {
namespace {

constexpr double kShownShare = 0.05;  // of other values that a change may be of

template <class Change>
std::string change_text(const WatchedValue& value, const Change& of) {
  return value.unit == "-" ? with_interval("%+.2f", 100 * of.change, 100 * of.lo, 100 * of.hi, "%")
                           : with_interval("%+.4g", of.change, of.lo, of.hi) + " " + value.unit;
}

std::string names_of(const WatchedFleet& fleet, const std::vector<std::size_t>& robots) {
  if (robots.size() > 1 && robots.size() == fleet.robots.size()) return "all robots";
  return joined(robots, ", ", [&](std::size_t u) { return fleet.robots[u].name; });
}

TextTable findings_of(const WatchedFleet& fleet, const FleetChanges& changes) {
  TextTable table{{"robot", "since run", "within runs", "what", "by (90 %)", "chance"}};
  for (const ValueStep& step : changes.steps) {
    const WatchedRobot& robot = fleet.robots[step.robots.front()];
    const WatchedValue& value = fleet.rows.values[step.value];
    std::string what = value.thing;
    for (std::size_t k = 0; k < step.shares.size(); ++k) {
      if (k == step.value || step.shares[k] < kShownShare) continue;
      what += fmt::format("; or {} ({:.0f} %)", fleet.rows.values[k].thing, 100 * step.shares[k]);
    }
    table.rows.push_back({names_of(fleet, step.robots), robot.runs[step.onset],
                          robot.runs[step.onset_first] + " to " + robot.runs[step.onset_last], what,
                          change_text(value, step),
                          fmt::format("{:.0f} %", 100 * step.shares[step.value])});
  }
  for (const OddRobot& odd : changes.odd_robots) {
    const WatchedValue& value = fleet.rows.values[odd.value];
    table.rows.push_back({fleet.robots[odd.robot].name, "the first", "",
                          value.thing + ", from the others'", change_text(value, odd), ""});
  }
  return table;
}

std::string run_name(const WatchedFleet& fleet, std::size_t robot, std::size_t run) {
  return fleet.robots[robot].name + "/" + fleet.robots[robot].runs[run];
}

std::string odd_run_text(const WatchedFleet& fleet, const OddRun& odd) {
  const bool last = odd.run + 1 == fleet.robots[odd.robot].runs.size();
  return run_name(fleet, odd.robot, odd.run) + " is off by itself and counts little" +
         (last ? "; it is the last one, so the next one shows whether this stays" : "");
}

// Of robots whose runs are all rejected by now, the first that is.
std::vector<WatchedSkip> stops_of(const WatchedFleet& fleet) {
  return mapped(
      filtered(fleet.robots,
               [](const WatchedRobot& robot) { return robot.rejected.size() >= kFewestAlike; }),
      [](const WatchedRobot& robot) { return robot.rejected.front(); });
}

std::string verdict(const WatchedFleet& fleet, const FleetChanges& changes) {
  const std::string first = first_to_look_at(fleet, changes);
  const bool shown = std::ranges::any_of(
      fleet.robots, [](const auto& robot) { return robot.runs.size() >= 2 * kFewestAlike; });
  const std::string stops = joined(stops_of(fleet), "", [](const WatchedSkip& stop) {
    return " Since " + stop.robot + "/" + stop.run + " every run of " + stop.robot +
           " is omitted; that one: " + stop.why + (stop.why.ends_with('.') ? "" : ".");
  });
  return std::string(something_changed(fleet, changes) ? "Something changed."
                     : shown                           ? "Nothing changed that these runs show."
                             : "Too few runs: a change has three of them before it and three "
                               "behind it.") +
         stops + (first.empty() ? "" : " The first run to look at: " + first + ".");
}

// Where a step of a robot begins and a reading by run, with what was fitted.
LineChart value_chart(const WatchedFleet& fleet, const FleetChanges& changes, std::size_t value) {
  const WatchedValue& watched = fleet.rows.values[value];
  LineChart chart;
  chart.title = watched.thing;
  chart.x_title = "run";
  chart.y_title =
      watched.value + (watched.unit == "-" ? ", ratio to the file" : ", " + watched.unit);
  chart.whole_x = true;
  for (std::size_t u = 0; u < fleet.robots.size(); ++u) {
    ChartSeries series;
    series.name = fleet.robots[u].name;
    const auto& readings = changes.readings[u][value];
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const double run = static_cast<double>(i + 1), half = kNormal90 * readings[i].deviation;
      const auto meant = [&](double of) { return std::max(of, watched.least); };
      series.line.push_back({run, meant(readings[i].value)});
      series.lower.push_back({run, meant(readings[i].value - half)});
      series.upper.push_back({run, meant(readings[i].value + half)});
    }
    chart.series.push_back(std::move(series));
  }
  return chart;
}

constexpr auto kSkip = [](auto& v, auto& row) { FIELDS(robot, run, why); };
constexpr auto kChange = [](auto& v, auto& row) { FIELDS(change, lo, hi, statistic); };

Json value_json(const WatchedFleet& fleet, std::size_t robot, std::size_t value) {
  const WatchedValue& watched = fleet.rows.values[value];
  return {{"robot", fleet.robots[robot].name},
          {"effect", watched.effect},
          {"value", watched.value},
          {"thing", watched.thing},
          {"unit", watched.unit}};
}

Json steps_json(const WatchedFleet& fleet, const FleetChanges& changes) {
  Json steps = Json::array();
  for (const ValueStep& step : changes.steps) {
    const std::vector<std::string>& runs = fleet.robots[step.robots.front()].runs;
    Json json = value_json(fleet, step.robots.front(), step.value);
    for (const std::size_t u : step.robots) json["robots"].push_back(fleet.robots[u].name);
    json.update({{"onset", runs[step.onset]},
                 {"onset_first", runs[step.onset_first]},
                 {"onset_last", runs[step.onset_last]},
                 {"onset_number", step.onset + 1}});
    json.update(FieldWriter::written(step, kChange));
    for (std::size_t k = 0; k < step.shares.size(); ++k) {
      json["chances"][fleet.rows.values[k].value] = step.shares[k];
    }
    steps.push_back(std::move(json));
  }
  return steps;
}

Json shared_json(const WatchedFleet& fleet, const FleetChanges& changes) {
  Json shared = Json::object();
  for (std::size_t k = 0; k < fleet.rows.rows.size(); ++k) {
    Json& to = shared[fleet.rows.rows[k].name];
    to = FieldWriter::written(changes.shared[k], [](auto& v, auto& row) {
      FIELDS(value, error, between_robots, between_runs);
    });
    to["unit"] = fleet.rows.rows[k].unit;
  }
  return shared;
}

Json robots_json(const WatchedFleet& fleet, const FleetChanges& changes) {
  Json robots = Json::array();
  for (std::size_t u = 0; u < fleet.robots.size(); ++u) {
    Json values = Json::object(), runs = Json::array(), detectable = Json::object();
    for (std::size_t k = 0; k < fleet.rows.rows.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      values[fleet.rows.rows[k].name] = {{"value", changes.owned[u][i]},
                                         {"error", changes.owned_errors[u][i]}};
    }
    for (std::size_t k = 0; k < fleet.rows.values.size(); ++k) {
      detectable[fleet.rows.values[k].value] = changes.detectable[u][k];
    }
    for (std::size_t i = 0; i < fleet.robots[u].runs.size(); ++i) {
      Json run = {{"run", fleet.robots[u].runs[i]}};
      for (std::size_t k = 0; k < fleet.rows.values.size(); ++k) {
        const RunReading& reading = changes.readings[u][k][i];
        run[fleet.rows.values[k].value] = {reading.value, reading.deviation};
      }
      runs.push_back(std::move(run));
    }
    robots.push_back({{"robot", fleet.robots[u].name},
                      {"values", values},
                      {"detectable", detectable},
                      {"runs", runs}});
  }
  return robots;
}

}  // namespace

std::string skip_text(const WatchedSkip& skip) {
  return skip.robot + (skip.run.empty() ? "" : "/" + skip.run) + ": omitted: " + skip.why;
}

bool something_changed(const WatchedFleet& fleet, const FleetChanges& changes) {
  return !changes.steps.empty() || !changes.odd_robots.empty() || !stops_of(fleet).empty();
}

std::string first_to_look_at(const WatchedFleet& fleet, const FleetChanges& changes) {
  const std::vector<WatchedSkip> stops = stops_of(fleet);
  if (!stops.empty()) return stops.front().robot + "/" + stops.front().run;
  const auto most = std::ranges::max_element(changes.steps, {}, &ValueStep::statistic);
  if (most != changes.steps.end()) return run_name(fleet, most->robots.front(), most->onset);
  if (!changes.odd_robots.empty()) return run_name(fleet, changes.odd_robots.front().robot, 0);
  if (changes.odd_runs.empty()) return "";
  return run_name(fleet, changes.odd_runs.front().robot, changes.odd_runs.front().run);
}

std::string watch_text(const WatchedFleet& fleet, const FleetChanges& changes) {
  const auto runs =
      sum_of(fleet.robots, [](const WatchedRobot& robot) { return robot.runs.size(); });
  std::string text = fmt::format("{} robots, {} runs, {} of them fitted now\n", fleet.robots.size(),
                                 runs, fleet.fitted);
  text += findings_of(fleet, changes).text();
  for (const OddRun& odd : changes.odd_runs) text += odd_run_text(fleet, odd) + "\n";
  for (const WatchedSkip& skip : fleet.skipped) text += skip_text(skip) + "\n";
  return text + verdict(fleet, changes) + "\n";
}

Json watch_json(const WatchedFleet& fleet, const FleetChanges& changes) {
  Json odd_robots = Json::array(), odd_runs = Json::array();
  for (const OddRobot& odd : changes.odd_robots) {
    odd_robots.push_back(value_json(fleet, odd.robot, odd.value));
    odd_robots.back().update(FieldWriter::written(odd, kChange));
  }
  for (const OddRun& odd : changes.odd_runs) {
    odd_runs.push_back({{"robot", fleet.robots[odd.robot].name},
                        {"run", fleet.robots[odd.robot].runs[odd.run]},
                        {"weight", odd.weight}});
  }
  Json thresholds = {{"robot", changes.thresholds.robot}};
  for (std::size_t k = 0; k < fleet.rows.values.size(); ++k) {
    thresholds[fleet.rows.values[k].value] = changes.thresholds.steps[k];
  }
  return {{"version", 1},
          {"changed", something_changed(fleet, changes)},
          {"first_run", first_to_look_at(fleet, changes)},
          {"steps", steps_json(fleet, changes)},
          {"odd_robots", odd_robots},
          {"odd_runs", odd_runs},
          {"stops", FieldWriter::list(stops_of(fleet), kSkip)},
          {"skipped", FieldWriter::list(fleet.skipped, kSkip)},
          {"false_alarms", changes.thresholds.false_alarms},
          {"thresholds", thresholds},
          {"shared", shared_json(fleet, changes)},
          {"robots", robots_json(fleet, changes)}};
}

std::string watch_page(const WatchedFleet& fleet, const FleetChanges& changes) {
  PlainPage page("What changed since when");
  page.paragraph(verdict(fleet, changes));
  const TextTable findings = findings_of(fleet, changes);
  if (!findings.rows.empty()) page.table(findings);
  for (const OddRun& odd : changes.odd_runs) page.paragraph(odd_run_text(fleet, odd));
  page.heading("Values over runs");
  page.paragraph(
      "Each run's value with its 90 % interval, all other values as the robot's own. An interval "
      "holds what differs from run to run; how unsure the robot's own values are (watch.json: "
      "error) moves all its runs alike and is not in it.");
  // What changed first.
  std::vector<std::size_t> order = mapped(changes.steps, &ValueStep::value);
  append(order, mapped(changes.odd_robots, &OddRobot::value));
  append(order, indices(fleet.rows.values.size()));
  std::vector<char> drawn(fleet.rows.values.size(), 0);
  for (const std::size_t k : order) {
    if (drawn[k]++ != 0) continue;
    const LineChart chart = value_chart(fleet, changes, k);
    page.picture(line_chart(chart), chart.title);
  }
  page.heading("What all share, and by how much robots and runs differ");
  TextTable table{
      {"value", "shared", "standard error", "from robot to robot", "from run to run", "unit"}};
  for (std::size_t k = 0; k < fleet.rows.rows.size(); ++k) {
    const SharedValue& of = changes.shared[k];
    const auto short_text = [](double number) { return fmt::format("{:.2g}", number); };
    table.rows.push_back({fleet.rows.rows[k].name, fmt::format("{:.5g}", of.value),
                          short_text(of.error), short_text(of.between_robots),
                          short_text(of.between_runs), fleet.rows.rows[k].unit});
  }
  page.table(table);
  if (!fleet.skipped.empty()) page.heading("Omitted");
  for (const WatchedSkip& skip : fleet.skipped) page.paragraph(skip_text(skip));
  return page.finish();
}

}  // namespace gapfarm
