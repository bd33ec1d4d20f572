// Columns guessed by their names, their types and the numbers in them.
#include <algorithm>
#include <cmath>
#include <regex>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "common/recordings/run.h"
#include "master/io/logs/column_map.h"
#include "master/io/logs/topics.h"

namespace gapfarm {
namespace {

// Nothing on wheels in a user's log goes faster, m/s; headings and rates are judged alike.
constexpr double kFastest_m_s = 30;
// A stamp further from the time of recording is on a clock of its own, or was never set.
constexpr double kNearClocks_s = 60;
// Whole numbers, of which rows are this many apart, count ms, us or ns: a robot's rows are between
// 1 ms and 5 s apart.
constexpr double kFewestMs = 5, kFewestUs = 1e3, kFewestNs = 1e6;

struct Role {
  const char* name;
  Aliases aliases;
};

const Aliases kTime = {
    "t",    "time",   "*.header.stamp",       "timestamp", "stamp",   "%time", "__time", "time_s",
    "secs", "*.time", "elapsed.time.sensors", "dt",        "delta_t", "period"};
const Aliases kRun = {"run", "step", "trial", "take"}, kKeep = {"pose_new"};

const std::vector<Role> kPoseRoles = {
    {"x",
     {"x", "*.position.x", "vicon.x", "*.pose.x", "*.translation.x", "px", "pos_x", "x_m", "dx"}},
    {"y",
     {"y", "*.position.y", "vicon.y", "*.pose.y", "*.translation.y", "py", "pos_y", "y_m", "dy"}},
    {"z", {"z", "*.position.z", "*.translation.z"}},
    {"theta",
     {"theta", "yaw", "heading", "vicon.yaw", "*.pose.theta", "*.pose.yaw", "theta_rad", "yaw_deg",
      "theta_deg", "heading_deg", "dtheta", "dyaw"}},
    {"qx", {"qx", "*.orientation.x", "*.rotation.x"}},
    {"qy", {"qy", "*.orientation.y", "*.rotation.y"}},
    {"qz", {"qz", "*.orientation.z", "*.rotation.z"}},
    {"qw", {"qw", "*.orientation.w", "*.rotation.w"}}};

const Aliases kAhead = {"v",        "cmd_v", "v_cmd", "*.cmd_vel.linear.x", "*.twist.linear.x",
                        "linear.x", "vx"};
const Aliases kTurning = {
    "w", "omega", "cmd_w", "w_cmd", "*.cmd_vel.angular.z", "*.twist.angular.z", "angular.z", "wz"};

// Sets of channels that go together; the first that is whole counts.
const std::vector<std::vector<Role>> kCommandRoles = {
    {{"left", {"cmd_left", "command_left", "left_cmd", "left"}},
     {"right", {"cmd_right", "command_right", "right_cmd", "right"}}},
    {{"throttle", {"throttle", "*.throttle"}}, {"steering", {"steering", "*.steering"}}},
    {{"v", kAhead},
     {"vy", {"vy", "*.cmd_vel.linear.y", "*.twist.linear.y", "linear.y"}},
     {"omega", kTurning}},
    {{"v", kAhead}, {"omega", kTurning}},
    {{"speed", {"drive.speed", "speed", "cmd_speed"}},
     {"steering", {"drive.steering_angle", "steering_angle", "cmd_steering"}}},
    {{"left", {"vl", "v_left"}}, {"right", {"vr", "v_right"}}},
    {{"w1", {"w1"}}, {"w2", {"w2"}}, {"w3", {"w3"}}, {"w4", {"w4"}}}};

const std::vector<Role> kWheelRoles = {
    {"left", {"wheel_left", "left_wheel", "enc_left", "odol"}},
    {"right", {"wheel_right", "right_wheel", "enc_right", "odor"}}};

std::string whole(double number) { return std::to_string(static_cast<long>(number)); }

double greatest(const std::vector<double>& values) {
  return max_of(values, [](double value) { return std::abs(value); });
}

class Guess {
 public:
  explicit Guess(const std::vector<Recording>& recordings) : recordings_(recordings) {}

  LogMap run() {
    for (const Recording& recording : recordings_) {
      for (const LogTable& table : recording.tables) consider(recording, table);
    }
    if (!odometry_.empty()) {
      map_.notes.push_back("poses are odometry (" + odometry_ +
                           "): wheels' slip cannot be seen in what wheels say; record poses by "
                           "motion capture, laser or tags");
    }
    return std::move(map_);
  }

 private:
  // The stamp of the message where it is set and on the recorder's clock, else the recorder's time.
  static std::string time_of(const LogTable& table) {
    const std::string stamp = column_of(table, {"*.header.stamp"});
    const std::string time = column_of(table, kTime);
    if (stamp.empty()) return time;
    const auto stamps = table.numbers(stamp), times = table.numbers("t");
    if (table.topic.empty()) {
      const bool set = !stamps.empty() && greatest(stamps) > 0;
      return set || time.empty() ? stamp : time;
    }
    const bool near = stamps.size() == times.size() && !times.empty() &&
                      std::abs(stamps.back() - times.back()) < kNearClocks_s &&
                      std::abs(stamps.front() - times.front()) < kNearClocks_s &&
                      stamps.front() <= times.back() && times.front() <= stamps.back();
    return near ? stamp : time;
  }

  void consider(const Recording& recording, const LogTable& table) {
    const std::string time = time_of(table);
    if (time.empty() && sides_of(table).empty()) return;
    // A better pose than odometry replaces it: odometry cannot show slip.
    const bool odometry = is_odometry(table);
    const bool wanted = map_.poses.columns.empty() || (!odometry_.empty() && !odometry);
    if (wanted && shows_robot(recording, table)) guess_poses(table, time, odometry);
    const bool measured = table.type.find("Odometry") != std::string::npos;
    if (map_.commands.columns.empty() && !measured) guess_commands(table, time);
    if (map_.wheels.columns.empty()) guess_wheels(table, time);
    if (map_.wheels.columns.empty() && map_.commands.columns.empty()) guess_sides(table, time);
    const std::string rate = column_of(table, {"angular_velocity.z", "yaw_rate", "gyro_z"});
    if (!map_.gyro.columns.empty() || rate.empty()) return;
    start(table, time, map_.gyro);
    map_.gyro.columns.push_back({"yaw_rate", rate, rate_unit(table, rate)});
  }

  void start(const LogTable& table, const std::string& time, TableMap& to) {
    to = {};
    to.source = table.topic;
    to.session = column_of(table, {"session"});
    to.run = column_of(table, kRun);
    if (time.empty()) {
      to.intervals = true;
      to.columns.push_back({"t", table.columns.front(), "s", /*scale=*/0, /*offset=*/1});
      return;
    }
    to.columns.push_back({"t", time, time_unit(table, time)});
    const std::string& unit = to.columns.back().unit;
    to.intervals =
        are_durations(table.numbers(time), unit_factor(unit.empty() ? table.unit_of(time) : unit));
  }

  static void add_columns(const LogTable& table, const std::vector<Role>& roles, TableMap& to) {
    for (const Role& role : roles) {
      const std::string column = column_of(table, role.aliases);
      if (!column.empty()) to.columns.push_back({role.name, column, ""});
    }
  }

  void guess_poses(const LogTable& table, const std::string& time, bool odometry) {
    TableMap found;
    start(table, time, found);
    add_columns(table, kPoseRoles, found);
    const auto there = [&](const char* role) { return found.find(role) != nullptr; };
    if (!there("x") && !there("y") && !there("theta")) guess_motions(table, found);
    const bool quaternion = there("qx") && there("qy") && there("qz") && there("qw");
    const bool place = there("x") && there("y");
    found.increments |= place && plain_name(found.find("x")->column) == "dx";
    if (found.increments) guess_noise(table, found);
    const bool heading = quaternion || there("theta");
    if (place && !heading && map_.no_heading.empty()) map_.no_heading = table.source;
    if (!place || !heading) return;
    if (table.type == "motive") found.up = "y";
    found.keep = column_of(table, kKeep);
    auto& columns = found.columns;
    const bool has_theta = there("theta");
    std::erase_if(columns, [&](const MappedColumn& c) {
      const bool part = c.role[0] == 'q' && c.role.size() == 2;
      return (c.role == "z" && found.up == "z") || (part && has_theta);
    });
    const std::string unit = length_unit(table, found);
    for (MappedColumn& c : columns) {
      if (c.role == "x" || c.role == "y" || c.role == "z") c.unit = unit;
      if (c.role == "theta") c.unit = angle_unit(table, c.column);
    }
    odometry_ = odometry ? table.source : "";
    map_.poses = std::move(found);
  }

  // "sx", "sy", "stheta": what a matcher of scans calls increments.
  static void guess_motions(const LogTable& table, TableMap& found) {
    for (const std::string& column : table.columns) {
      std::string prefix = plain_name(column);
      if (prefix.size() < 2 || prefix.back() != 'x') continue;
      prefix.pop_back();
      const std::string y = column_of(table, {prefix + "y"});
      const std::string theta =
          column_of(table, {prefix + "theta", prefix + "th", prefix + "yaw", prefix + "heading"});
      if (y.empty() || theta.empty()) continue;
      for (const auto& [role, of] : {std::pair{"x", column}, {"y", y}, {"theta", theta}}) {
        found.columns.push_back({role, of, ""});
      }
      found.increments = true;
      return;
    }
  }

  static void guess_noise(const LogTable& table, TableMap& increments) {
    for (const auto* roles : {&kCovarianceColumns, &kDeviationColumns}) {
      if (!increments.noise().empty()) return;
      const auto of = [&](const std::string& role) {
        const std::string rest = role.substr(role.find('_'));
        return column_of(table, roles == &kDeviationColumns
                                    ? Aliases{role, "sigma" + rest, "std" + rest}
                                    : Aliases{role});
      };
      if (std::ranges::any_of(*roles, [&](const auto& role) { return of(role).empty(); })) continue;
      for (const std::string& role : *roles) {
        increments.columns.push_back({role, of(role), unit_in_name(of(role))});
      }
    }
  }

  // A Twist has a speed aside whether the robot can go there or not, and vx beside poses is as
  // likely what was measured.
  static bool is_no_command(const LogTable& table, const TableMap& found) {
    const MappedColumn *aside = found.find("vy"), *ahead = found.find("v");
    return (aside != nullptr && greatest(table.numbers(aside->column)) == 0) ||
           (ahead != nullptr && ahead->column == "vx" && !column_of(table, {"x"}).empty());
  }

  void guess_commands(const LogTable& table, const std::string& time) {
    for (const std::vector<Role>& set : kCommandRoles) {
      TableMap found;
      start(table, time, found);
      add_columns(table, set, found);
      if (found.columns.size() != set.size() + 1 || is_no_command(table, found)) continue;
      for (MappedColumn& c : found.columns) {
        if (c.role == "t" || stated(table, c.column)) continue;
        c.unit = unit_in_name(c.column);
        if (!c.unit.empty()) continue;
        if (c.role == "omega") c.unit = rate_unit(table, c.column);
        const bool rim = c.role == "left" || c.role == "right" || c.role == "speed";
        if (rim) c.unit = rim_unit(table, c.column);
      }
      map_.commands = std::move(found);
      return;
    }
  }

  // A joint's name as a key of the map: plain letters, each once, none of the map's own.
  static std::string role_of(const std::string& joint, const TableMap& taken) {
    std::string role = joint;
    const auto odd = [](unsigned char c) { return std::isalnum(c) == 0 && c != '-'; };
    std::ranges::replace_if(role, odd, '_');
    for (const char* own : {"", "source", "session", "run", "keep", "up", "wheel_radius"}) {
      if (role == own) role += "_joint";
    }
    while (taken.find(role) != nullptr) role += "_2";
    return role;
  }

  void guess_wheels(const LogTable& table, const std::string& time) {
    TableMap found;
    start(table, time, found);
    add_columns(table, kWheelRoles, found);
    for (std::size_t k = 1; k < found.columns.size(); ++k) {
      found.columns[k].unit = rim_unit(table, found.columns[k].column);
    }
    // Joint states: a column velocity.NAME a joint.
    if (found.columns.size() == 1 && table.type.find("JointState") != std::string::npos) {
      for (const std::string& column : table.columns) {
        if (column.rfind("velocity.", 0) == 0) {
          found.columns.push_back({role_of(column.substr(9), found), column, "rad/s"});
        }
      }
    }
    if (found.columns.size() > 1) map_.wheels = std::move(found);
  }

  // Wheels by a name that nobody knows: what they hold is what explains the motions beside them.
  void guess_sides(const LogTable& table, const std::string& time) {
    const std::vector<std::string> sides = sides_of(table);
    if (sides.empty() || !has_all(table, map_.poses)) return;
    start(table, time, map_.wheels);
    const bool speed =
        std::regex_search(plain_name(sides[0]), std::regex("omega|vel|speed|rpm|^w"));
    for (std::size_t k = 0; k < 2; ++k) {
      MappedColumn c{k == 0 ? "left" : "right", sides[k], unit_in_name(sides[k])};
      c.increment = !speed;
      map_.wheels.columns.push_back(std::move(c));
    }
    const WheelReading as = best_reading(table, map_.poses, map_.wheels);
    for (std::size_t k = 1; k < 3; ++k) {
      map_.wheels.columns[k].rate = as.rate;
      map_.wheels.columns[k].increment = as.increment;
    }
    map_.poses.increments = as.increments;
    if (as.increments && map_.poses.noise().empty()) guess_noise(table, map_.poses);
    map_.notes.push_back(
        "wheels by the names of columns: " + sides[0] + " and " + sides[1] + " are taken as " +
        (as.rate        ? "counts"
         : as.increment ? "what each turned by in a row"
                        : "speeds") +
        " in " + (map_.wheels.columns[1].unit.empty() ? "rad" : map_.wheels.columns[1].unit) +
        "; of ticks write scale = (2 pi over those of a turn) into the map");
    if (time.empty()) {
      map_.notes.push_back(
          "no column of times: each row is taken to last 1 s, which changes no "
          "speed of wheels that were measured a row");
    }
  }

  // Whether the file has a row of units: what it states is not guessed.
  static bool stated(const LogTable& table, const std::string& column) {
    return !table.unit_of(column).empty();
  }

  std::string taken_as(const std::string& unit, const std::string& why) {
    std::string note = why + ": taken as " + unit;
    if (!contains(map_.notes, note)) map_.notes.push_back(std::move(note));
    return unit;
  }

  // Clocks count seconds since 1970 or since something; a day has 86,400.
  std::string time_unit(const LogTable& table, const std::string& column) {
    if (stated(table, column)) return "";
    for (const char* unit : {"ns", "us", "ms"}) {
      if (has_word(column, unit)) return unit;
    }
    const std::vector<double> times = table.numbers(column);
    const double most = greatest(times);
    if (most > 1e11) return most > 1e17 ? "ns" : most > 1e14 ? "us" : "ms";
    std::vector<double> steps;
    for (std::size_t i = 1; i < times.size(); ++i) {
      if (times[i] != std::floor(times[i])) return "s";
      if (times[i] > times[i - 1]) steps.push_back(times[i] - times[i - 1]);
    }
    const double step = steps.empty() ? 0 : median(steps);
    if (step < kFewestMs) return "s";
    return taken_as(step < kFewestUs   ? "ms"
                    : step < kFewestNs ? "us"
                                       : "ns",
                    column + " grows by " + whole(step) + " a row");
  }

  std::string length_unit(const LogTable& table, const TableMap& found) {
    const std::string& x = found.find("x")->column;
    if (stated(table, x)) return "";
    for (const char* unit : {"mm", "cm"}) {
      if (has_word(x, unit)) return unit;
    }
    if (found.increments || found.find("t")->scale == 0) return "m";
    const auto xi = table.find(x), ti = table.find(found.find("t")->column);
    // The median outlives jumps between runs and stamps that hardly differ.
    std::vector<double> speeds;
    const MappedColumn& t = *found.find("t");
    const double second = unit_factor(t.unit.empty() ? table.unit_of(t.column) : t.unit);
    for (std::size_t r = 1; r < table.rows(); ++r) {
      const double dt = (table.at(r, *ti) - table.at(r - 1, *ti)) * second;
      const double dx = std::abs(table.at(r, *xi) - table.at(r - 1, *xi));
      if (dt > 0 && dx > 0) speeds.push_back(dx / dt);
    }
    const double middle = speeds.size() < 2 ? 0 : median(speeds);
    if (middle < kFastest_m_s) return "m";
    return taken_as("mm", "x changes by " + whole(middle) + " a second, half of the time by more");
  }

  // Headings in radians stay within a turn or grow smoothly past it; 60 rad are ten turns.
  std::string angle_unit(const LogTable& table, const std::string& column) {
    if (stated(table, column)) return "";
    if (has_word(column, "mrad")) return "mrad";
    if (has_word(column, "deg") || column.find("_deg") != column.npos) return "deg";
    const std::vector<double> values = table.numbers(column);
    double jump = 0;
    for (std::size_t i = 1; i < values.size(); ++i) {
      jump = std::max(jump, std::abs(values[i] - values[i - 1]));
    }
    if (greatest(values) < 60 && jump < 60) return "rad";
    if (jump < 60 && greatest(values) < 361 && values.size() > 1) {
      return taken_as("deg", column + " reaches " + whole(greatest(values)));
    }
    return jump >= 60 ? "deg" : "rad";
  }

  static std::string rate_unit(const LogTable& table, const std::string& column) {
    if (stated(table, column)) return "";
    if (column.find("deg") != column.npos) return "deg/s";
    return greatest(table.numbers(column)) > 60 ? "deg/s" : "rad/s";
  }

  static std::string rim_unit(const LogTable& table, const std::string& column) {
    if (stated(table, column)) return "";
    if (column.find("rpm") != column.npos) return "rpm";
    const std::string name = plain_name(column);
    const bool speed = name == "vl" || name == "vr" || name == "v_left" || name == "v_right" ||
                       name.find("speed") != name.npos;
    return speed ? "m/s" : "rad/s";
  }

  const std::vector<Recording>& recordings_;
  LogMap map_;
  std::string odometry_;  // the table, where poses are such
};

}  // namespace

LogMap guess_map(const std::vector<Recording>& recordings) { return Guess(recordings).run(); }

}  // namespace gapfarm
