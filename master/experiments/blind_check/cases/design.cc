#include "master/experiments/blind_check/cases/design.h"

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"
#include "master/farm/planned_trials.h"

namespace gapfarm {
namespace {

constexpr std::uint64_t kDesignStream = 0xb11d;  // generation word of the design's streams
constexpr unsigned kMostDraws = 6;  // of signs and places before an effect is out of reach
constexpr std::size_t kMostSizeTrials = 300;

struct Spread {
  const char* key;
  double factor;
  bool noise;
};
constexpr Spread kSpreads[] = {
    {"mass", 1.25, false},
    {"contact_length", 1.1, false},
    {"track_gauge", 1.08, false},
    {"friction", 1.3, false},
    {"friction_ratio", 1.15, false},
    {"full_speed", 1.12, false},
    {"maximum_velocity", 1.12, false},
    {"motor_torque", 1.2, false},
    {"drive_noise_common", 1.2, true},
    {"drive_noise_side", 1.2, true},
    {"pose_noise_position", 1.2, true},
    {"pose_noise_heading", 1.2, true},
    {"shape_factor", 1.15, false},
    {"pressure", 1.3, false},
    {"ground_friction", 1.5, false},
    {"finger_friction", 1.3, false},
    {"push_noise_slide", 1.2, true},
    {"push_noise_turn", 1.2, true},
};

// The search for one effect's strength in one case.
struct Sizing {
  std::size_t in_case;
  std::size_t effect;  // of the table
  SizeLevel level;
  Stream stream;
  EffectDraw draw;
  StrengthSearch search;
  unsigned draws = 1;
  bool out_of_reach = false;
};

// Collects cases before their names are dealt.
class Drafts {
 public:
  Drafts(const Problem& problem, const DesignSettings& settings)
      : problem_(problem), settings_(settings), arena_(arena_of(problem.log, 0.02)) {}

  void add(CaseKind kind, const SizeLevel& level, const std::vector<std::size_t>& effects) {
    const std::size_t index = cases.size();
    Stream stream({settings_.seed, Purpose::kSimulation, kDesignStream, index, 0});
    Truth truth;
    truth.kind = kind;
    truth.level = level.name;
    truth.robot = draw_robot(problem_, stream);
    truth.seed = stream.bits() >> 1;  // leaves room for an offset
    if (kind == CaseKind::kOutside) truth.excluded = problem_.table().effects()[effects[0]].name;
    cases.push_back(std::move(truth));
    for (std::size_t i = 0; i < effects.size(); ++i) {
      Stream draws({settings_.seed, Purpose::kSimulation, kDesignStream, index, i + 1});
      const EffectDraw draw = draw_effect(problem_.table(), effects[i], arena_, draws);
      sizings.push_back({index, effects[i], level, draws, draw, StrengthSearch(level.size)});
    }
  }

  const Arena& arena() const { return arena_; }

  std::vector<Truth> cases;
  std::vector<Sizing> sizings;

 private:
  const Problem& problem_;
  const DesignSettings& settings_;
  Arena arena_;
};

void draft_cases(const DesignSettings& settings, const std::vector<std::size_t>& effects,
                 Drafts& drafts) {
  for (const SizeLevel& level : settings.sizes) {
    for (const std::size_t e : effects) {
      for (unsigned i = 0; i < settings.per_effect; ++i) drafts.add(CaseKind::kSingle, level, {e});
    }
  }
  for (unsigned i = 0; i < settings.nulls; ++i) drafts.add(CaseKind::kNull, {}, {});
  Stream stream({settings.seed, Purpose::kSimulation, kDesignStream, ~std::uint64_t{0}, 0});
  if (effects.empty() || settings.sizes.empty()) return;
  for (unsigned i = 0; i < settings.pairs && effects.size() > 1; ++i) {
    const std::size_t a = stream.below(effects.size());
    const std::size_t b = (a + 1 + stream.below(effects.size() - 1)) % effects.size();
    drafts.add(CaseKind::kPair, settings.sizes[0], {effects[a], effects[b]});
  }
  for (unsigned i = 0; i < settings.excluded; ++i) {
    drafts.add(CaseKind::kOutside, settings.sizes[0], {effects[i % effects.size()]});
  }
}

// Predictions of some of the planned trials by the robot of `truth`.
v1::Task predict_task(const Problem& planned, const Truth& truth) {
  v1::Task task = prediction_task(overrides_of(planned.table(), truth), false);
  const std::size_t count = planned.log.trials.size();
  const std::size_t wanted = std::min(count, kMostSizeTrials);
  task.mutable_predict()->set_planned(true);
  for (std::size_t i = 0; i < wanted; ++i) {
    task.mutable_predict()->add_trials(static_cast<std::uint32_t>(i * count / wanted));
  }
  return task;
}

void record_size(const ParameterTable& table, const Arena& arena, const v1::TaskResult& result,
                 const v1::PredictResult& base, Sizing& sizing) {
  const bool by_spread = !table.effects()[sizing.effect].moves_means();
  sizing.search.tell(result.outcome() == v1::OK ? size_of(base, result.predict(), by_spread)
                                                : std::nullopt);
  if (!sizing.search.done() || sizing.search.found()) return;
  if (sizing.draws >= kMostDraws) {
    sizing.out_of_reach = true;
    return;
  }
  ++sizing.draws;
  sizing.draw = draw_effect(table, sizing.effect, arena, sizing.stream);
  sizing.search = StrengthSearch(sizing.level.size);
}

// All searches side by side, a round of farm work a step.
Status search_strengths(const Problem& planned, Drafts& drafts, Farm& farm) {
  const ParameterTable& table = planned.table();
  const std::string hash = farm.add_problem(to_proto(planned));
  const auto task_of = [&](const Truth& truth) { return predict_task(planned, truth); };
  ASSIGN_OR_RETURN(const auto base, farm.run(hash, mapped(drafts.cases, task_of)));
  for (const v1::TaskResult& result : base) {
    RETURN_IF_ERROR(ended_well(result, "a robot near the config's",
                               "; the config's values do not make one that drives"));
  }
  for (;;) {
    std::vector<std::size_t> open;
    std::vector<v1::Task> round;
    for (std::size_t i = 0; i < drafts.sizings.size(); ++i) {
      const Sizing& s = drafts.sizings[i];
      if (s.search.done()) continue;
      v1::Task task = predict_task(planned, drafts.cases[s.in_case]);
      const auto values = effect_values(table, s.draw, s.search.strength());
      for (std::size_t k = 0; k < values.size(); ++k) {
        *task.mutable_predict()->mutable_point()->add_overrides() =
            override_of(table.effect_row(s.effect) + k, values[k]);
      }
      task.mutable_predict()->set_means_only(table.effects()[s.effect].moves_means());
      open.push_back(i);
      round.push_back(std::move(task));
    }
    if (open.empty()) return {};
    ASSIGN_OR_RETURN(const auto results, farm.run(hash, round));
    for (std::size_t i = 0; i < open.size(); ++i) {
      Sizing& sizing = drafts.sizings[open[i]];
      record_size(table, drafts.arena(), results[i], base[sizing.in_case].predict(), sizing);
    }
  }
}

TrueEffect true_effect(const ParameterTable& table, const Sizing& sizing) {
  const Effect& entry = table.effects()[sizing.effect];
  TrueEffect effect{entry.name, {}, sizing.search.size()};
  const auto values = effect_values(table, sizing.draw, sizing.search.strength());
  for (std::size_t i = 0; i < values.size(); ++i) {
    effect.parameters[entry.parameters[i].key] = values[i];
  }
  return effect;
}

BlindDesign deal(const ParameterTable& table, const DesignSettings& settings, Drafts drafts) {
  BlindDesign design;
  std::vector<bool> possible(drafts.cases.size(), true);
  for (const Sizing& sizing : drafts.sizings) {
    if (sizing.out_of_reach) {
      possible[sizing.in_case] = false;
      design.out_of_reach.push_back(
          {table.effects()[sizing.effect].name, sizing.level.name, sizing.search.size()});
    } else {
      drafts.cases[sizing.in_case].effects.push_back(true_effect(table, sizing));
    }
  }
  Stream stream({settings.seed, Purpose::kSimulation, kDesignStream, ~std::uint64_t{0}, 1});
  for (const std::size_t i : stream.permutation(drafts.cases.size())) {
    if (!possible[i]) continue;
    design.cases.push_back(std::move(drafts.cases[i]));
    design.cases.back().id = formatted("case%03zu", design.cases.size());
  }
  return design;
}

}  // namespace

Result<std::vector<TrialLog>> simulate_cases(const Config& config, const std::vector<Truth>& cases,
                                             const SessionPlans& plan, std::uint64_t seed_offset,
                                             Farm& farm) {
  const Problem problem = without_log(config.problem);
  std::vector<v1::Task> tasks;
  std::vector<std::size_t> owner;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const std::uint64_t seed = cases[i].seed + seed_offset;
    const auto sessions = simulate_tasks(
        plan.empty() ? draw_plan(config.problem, config.simulate, seed) : plan,
        overrides_of(problem.table(), cases[i]), seed, config.simulate.path_interval_s);
    append(tasks, sessions);
    owner.insert(owner.end(), sessions.size(), i);
  }
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(problem)), tasks));
  std::vector<TrialLog> logs(cases.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    const v1::TaskResult& result = results[i];
    RETURN_IF_ERROR(ended_well(result, cases[owner[i]].id + ": the simulation",
                               "; try another --seed, or values that make a robot that drives"));
    for (const v1::Trial& trial : result.simulate().trials()) {
      logs[owner[i]].trials.push_back(from_proto(trial));
    }
  }
  return logs;
}

Result<SizeLevel> size_level(const std::string& word) {
  if (word == "clear") return SizeLevel{word, 5};
  if (word == "subtle") return SizeLevel{word, 1.6};
  const auto number = parse_double(word);
  if (number && *number > 1 && *number < 1e6) return SizeLevel{word, *number};
  return Error{"size '" + word + "': expected clear (5), subtle (1.6) or a number above 1"};
}

std::map<std::string, double> draw_robot(const Problem& problem, Stream& stream) {
  const ParameterTable& table = problem.table();
  std::map<std::string, double> robot;
  for (const Spread& spread : kSpreads) {
    const auto row = table.find(spread.key);
    if (!row) continue;
    const double factor = std::pow(spread.factor, stream.uniform(-1, 1));
    const Gene* gene = find_by(problem.genes, *row, &Gene::row);
    if (!gene && !problem.genes.empty() && !spread.noise) continue;
    const double lower = gene ? gene->lower : table[*row].lower;
    const double upper = gene ? gene->upper : table[*row].upper;
    robot[spread.key] = std::clamp(factor * problem.values[*row], lower, upper);
  }
  return robot;
}

Result<BlindDesign> draw_design(const Problem& planned, const DesignSettings& settings,
                                Farm& farm) {
  const ParameterTable& table = planned.table();
  ASSIGN_OR_RETURN(const auto effects, effects_named(table, settings.effects));
  Drafts drafts(planned, settings);
  draft_cases(settings, effects, drafts);
  RETURN_IF_ERROR(search_strengths(planned, drafts, farm));
  return deal(table, settings, std::move(drafts));
}

std::vector<v1::Override> overrides_of(const ParameterTable& table, const Truth& truth) {
  std::vector<v1::Override> overrides;
  const auto add = [&](const std::string& key, double value) {
    const auto row = table.find(key);
    if (row) overrides.push_back(override_of(*row, value));
  };
  for (const auto& [key, value] : truth.robot) add(key, value);
  for (const TrueEffect& effect : truth.effects) {
    for (const auto& [key, value] : effect.parameters) add(effect.name + "." + key, value);
  }
  return overrides;
}

}  // namespace gapfarm
