#include "common/parameters/external.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/parameters/ground.h"
#include "common/parameters/rows.h"

namespace gapfarm {
namespace {

// What each effect needs of the program beyond speeds and duration.  Effects on the robot's own
// build are the program's business: a parameter of its own.
struct EffectNeed {
  const char* effect;
  unsigned inputs;
};
constexpr EffectNeed kEffectNeeds[] = {
    {"motor_lag", kExternalLag},        {"backlash", kExternalDeadTravel},
    {"floor_tilt", kExternalFloor},     {"floor_nap", kExternalFloor},
    {"friction_patch", kExternalFloor}, {"rolling_resistance", kExternalFloor},
    {"pose_latency", kExternalPath},
};
constexpr const char* kOfTheBuild[] = {"com_offset"};

std::vector<Parameter> noise_rows() {
  const auto& rows = srv1_table().rows();
  return {rows.begin() + row_of(Srv1::kDriveNoiseCommon),
          rows.begin() + row_of(Srv1::kPoseNoiseTail) + 1};
}

constexpr double kReach_m = 0.3;  // of a laboratory's robot: scales the noise that is assumed

// Around a program that follows the commands of runs.
std::vector<Parameter> run_rows(const std::vector<std::string>& channels) {
  using rows::real;
  std::vector<Parameter> all = {
      real("delay", "s", -1, 1, 0, "from a command to when the program gets it"),
      real("marker.x", "m", -1, 1, 0, "the tracked point, ahead"),
      real("marker.y", "m", -1, 1, 0, "the tracked point, to the left"),
      real("marker.yaw", "rad", -M_PI, M_PI, 0, "heading of the tracked point")};
  for (const Parameter& noise : window_noise_rows(kReach_m)) all.push_back(noise);
  for (const std::string& channel : channels) {
    all.push_back(real(channel + kChannelGain, "-", 0.1, 10, 1,
                       "what " + channel + " is multiplied by before the program gets it"));
  }
  for (const std::string& channel : channels) {
    all.push_back(
        real(channel + kChannelOffset, "-", -100, 100, 0, "what is added to " + channel + " then"));
  }
  return all;
}

bool can_be_applied(const Effect& effect, unsigned inputs) {
  for (const char* name : kOfTheBuild) {
    if (effect.kind() == name) return false;
  }
  // A request has a place for one of what is on the floor.
  if (effect.stage == EffectStage::kFloor && !effect.repeats.empty()) return false;
  for (const EffectNeed& need : kEffectNeeds) {
    if (effect.kind() == need.effect) return (inputs & need.inputs) == need.inputs;
  }
  // One that nobody has sorted yet is omitted rather than left without effect.
  return effect.stage != EffectStage::kFloor;
}

bool is_key(const std::string& key) {
  const auto bare = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !key.empty() && key.size() <= 64 && std::all_of(key.begin(), key.end(), bare);
}

bool is_taken(const std::string& key, bool runs) {
  return contains(runs ? run_rows({}) : noise_rows(), key, &Parameter::key) ||
         contains(srv1_effects_and_seconds(), key, &Effect::name);
}

template <class Wrong>
Status check_choices(const std::vector<std::string>& choices, const Wrong& wrong) {
  for (const std::string& word : choices) {
    const bool plain = std::ranges::none_of(
        word, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; });
    if (word.empty() || !plain) return wrong("has a choice that is empty or no plain text");
    if (std::count(choices.begin(), choices.end(), word) > 1) {
      return wrong("has the choice '" + word + "' twice");
    }
  }
  return {};
}

Status check_row(const Parameter& p, bool runs) {
  const auto wrong = [&](const std::string& what) {
    return Error{"parameter '" + p.key + "' " + what};
  };
  const auto number = [](double value) { return format_number(value, 17); };
  const std::string bounds = " [" + number(p.lower) + ", " + number(p.upper) + "]";
  if (!is_key(p.key)) return wrong("needs a key of 1 to 64 letters, digits and _");
  if (is_taken(p.key, runs)) return wrong("has a name that gapfarm uses itself; choose another");
  if (!std::isfinite(p.lower) || !std::isfinite(p.upper) || !(p.lower < p.upper)) {
    return wrong("has the bounds" + bounds + ", expected two finite numbers, lower below upper");
  }
  if (!(p.nominal >= p.lower && p.nominal <= p.upper)) {
    return wrong("has the nominal value " + number(p.nominal) + ", outside its bounds" + bounds);
  }
  if (p.scale == ParameterScale::kLog && !(p.lower > 0)) {
    return wrong("has a log scale and the lower bound " + number(p.lower) +
                 ", expected more than 0");
  }
  if (p.kind == ParameterKind::kChoice) return check_choices(p.choices, wrong);
  if (p.kind != ParameterKind::kInteger) return {};
  if (p.lower != std::floor(p.lower) || p.upper != std::floor(p.upper) ||
      p.nominal != std::floor(p.nominal)) {
    return wrong("is an integer with the nominal value " + number(p.nominal) + " and the bounds" +
                 bounds + ", expected whole numbers");
  }
  if (p.scale == ParameterScale::kLog) {
    return wrong("is an integer, whose values are searched evenly; omit \"log\"");
  }
  return {};
}

}  // namespace

Status check_declaration(const ExternalDeclaration& declaration) {
  const auto& rows = declaration.parameters;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    RETURN_IF_ERROR(check_row(rows[i], !declaration.channels.empty()));
    for (std::size_t k = 0; k < i; ++k) {
      if (rows[k].key == rows[i].key) {
        return Error{"parameter '" + rows[i].key + "' is declared twice"};
      }
    }
  }
  std::set<std::string> channels;
  for (const std::string& channel : declaration.channels) {
    if (!is_key(channel) || !channels.insert(channel).second) {
      return Error{"channel '" + channel +
                   "' needs a name of its own of 1 to 64 letters, digits and _"};
    }
  }
  return {};
}

std::vector<bool> ExternalDeclaration::present(const ParameterValues& values) const {
  std::vector<bool> there(parameters.size(), true);
  for (std::size_t i = 0; i < when.size(); ++i) {
    there[i] = std::ranges::all_of(when[i], [&](const ExternalCondition& c) {
      return there[c.row] && contains(c.values, values[c.row]);
    });
  }
  return there;
}

ExternalTable::ExternalTable(ExternalDeclaration declaration)
    : declaration_(std::move(declaration)) {
  std::vector<Parameter> rows = declaration_.parameters;
  if (declaration_.objective) {
    table_ = std::make_unique<ParameterTable>(std::move(rows), effects_);
    return;
  }
  const bool runs = !declaration_.channels.empty();
  for (const Parameter& row : runs ? run_rows(declaration_.channels) : noise_rows()) {
    rows.push_back(row);
  }
  for (const Effect& effect : srv1_effects_and_seconds()) {
    if (!runs && can_be_applied(effect, declaration_.inputs)) effects_.push_back(effect);
  }
  table_ = std::make_unique<ParameterTable>(std::move(rows), effects_);
}

const ParameterTable& external_table() {
  static const ParameterTable table(noise_rows(), {});
  return table;
}

const ParameterTable& external_runs_table() {
  static const ParameterTable table(run_rows({}), {});
  return table;
}

}  // namespace gapfarm
