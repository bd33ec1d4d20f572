#include "master/experiments/plan/design.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/ranges.h"
#include "common/pose/pose.h"
#include "master/diagnose/subject.h"
#include "master/farm/planned_trials.h"
#include "master/report/figures/figures.h"

namespace gapfarm::plan {
namespace {

using Sessions = std::vector<std::vector<v1::PlannedTrial>>;
using Chain = std::vector<v1::PlannedTrial>;  // begins with a move

constexpr double kInformation = 25;  // that a plan's share of the pool holds of each shift
constexpr std::size_t kPowerPoints = 8;

std::vector<Chain> chains_of(const Sessions& sessions) {
  std::vector<Chain> chains;
  for (const auto& session : sessions) {
    for (const v1::PlannedTrial& trial : session) {
      if (trial.moved() || chains.empty()) chains.emplace_back();
      chains.back().push_back(trial);
    }
  }
  return chains;
}

// Dealt to the sessions in turn, so that whoever stops early has had the first ones.
Sessions dealt(const std::vector<Chain>& chains, unsigned sessions, double pause_s) {
  Sessions plan(sessions);
  std::vector<double> t_s(sessions, 0);
  for (std::size_t c = 0; c < chains.size(); ++c) {
    const std::size_t s = c % sessions;
    for (v1::PlannedTrial planned : chains[c]) {
      Trial trial = from_proto(planned.trial());
      trial.session = "s" + std::to_string(s + 1);
      trial.trial = static_cast<std::int64_t>(plan[s].size());
      if (trial.t_s) trial.t_s = t_s[s];
      t_s[s] += trial.duration_s.value_or(0) + pause_s;
      *planned.mutable_trial() = to_proto(trial);
      plan[s].push_back(std::move(planned));
    }
  }
  return plan;
}

// The first trials of every session, as many as a share of the whole.
std::vector<std::size_t> first_trials(const TrialLog& log, std::size_t part, std::size_t parts) {
  std::map<std::string, std::size_t> lengths, taken;
  for (const Trial& trial : log.trials) ++lengths[trial.session];
  std::vector<std::size_t> first;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    const std::string& session = log.trials[i].session;
    if (taken[session]++ < lengths[session] * part / parts) first.push_back(i);
  }
  return first;
}

class Designer {
 public:
  Designer(Farm& farm, const Config& config, const PlanSettings& settings)
      : farm_(farm),
        config_(config),
        settings_(settings),
        subject_(diagnosis_subject(config.problem)) {}

  Status choose_effects(DesignedPlan* plan) {
    const std::span<const Effect> catalogue = config_.problem.table().effects();
    const auto all = mapped(catalogue, &Effect::name);
    ASSIGN_OR_RETURN(const auto asked,
                     effects_named(config_.problem.table(),
                                   settings_.effects.empty() ? all : settings_.effects));
    for (const std::size_t effect : asked) {
      if (catalogue[effect].moves_means()) {
        effects_.push_back(effect);
      } else {
        plan->not_planned_for.push_back(catalogue[effect].name);
      }
    }
    if (effects_.empty()) {
      return Error{
          "none of these effects moves where a trial ends, so no plan shows them better than "
          "another; name others with --effects"};
    }
    std::ranges::sort(effects_);
    effects_.erase(std::unique(effects_.begin(), effects_.end()), effects_.end());
    return {};
  }

  Sessions draw(unsigned times, std::uint64_t seed) const {
    SimulateSettings simulate = config_.simulate;
    const unsigned a_session = (settings_.trials + simulate.sessions - 1) / simulate.sessions;
    simulate.trials_per_session = (a_session + chain() - 1) / chain() * chain();
    simulate.sessions *= times;
    return draw_plan(config_.problem, simulate, seed);
  }

  // Where the model stops, without any noise.
  Result<TrialLog> driven(const Sessions& plan) {
    Problem problem = without_log(config_.problem);
    for (const NoiseRow& noise : {subject_->drive_common, subject_->drive_side,
                                  subject_->pose_position, subject_->pose_heading}) {
      problem.values[noise.row] = problem.table()[noise.row].lower;
    }
    ASSIGN_OR_RETURN(const auto results, farm_.run(farm_.add_problem(to_proto(problem)),
                                                   simulate_tasks(plan, {}, settings_.seed, 0)));
    TrialLog log;
    for (std::size_t s = 0; s < results.size(); ++s) {
      const v1::TaskResult& result = results[s];
      const Status ended = ended_well(result, "the simulation",
                                      "; these parameters do not make a robot that drives");
      if (!ended) return Error{ended.error().message, ErrorCode::kSimulation};
      for (std::size_t i = 0; i < plan[s].size(); ++i) {
        Trial trial = from_proto(result.simulate().trials(static_cast<int>(i)));
        // What the least noise leaves between two readings of one place is no move.
        if (!plan[s][i].moved() && i > 0) trial.X_WS = log.trials.back().X_WE;
        log.trials.push_back(std::move(trial));
      }
    }
    return log;
  }

  Result<Signals> signals_of(const TrialLog& log) {
    return signals(farm_, config_.problem, log, effects_, settings_.seed);
  }

  Result<std::vector<Chain>> choose(double* best_share) {
    const Sessions pool = draw(settings_.pool, settings_.seed);
    ASSIGN_OR_RETURN(const auto log, driven(pool));
    ASSIGN_OR_RETURN(auto shown_signals, signals_of(log));
    const auto trials = static_cast<double>(log.trials.size());
    std::vector<const Shift*> shifts;
    std::vector<double> scales;
    for (const Shift& shift : shown_signals.shifts) {
      const double all = information(shift.rows, shown_signals.nuisances);
      if (all <= 0) continue;
      shifts.push_back(&shift);
      scales.push_back(std::sqrt(kInformation * trials / (settings_.trials * all)));
    }
    const Eigen::Index nuisances = shown_signals.nuisances.cols();
    std::vector<Chain> chains;  // that stay on the floor
    std::vector<Rows> candidates;
    Eigen::Index first = 0;
    for (Chain& chain : chains_of(pool)) {
      const auto rows = static_cast<Eigen::Index>(3 * chain.size());
      if (!stays(log, static_cast<std::size_t>(first / 3), chain.size())) {
        first += rows;
        continue;
      }
      Rows candidate(rows, static_cast<Eigen::Index>(shifts.size()) + nuisances);
      for (std::size_t k = 0; k < shifts.size(); ++k) {
        candidate.col(static_cast<Eigen::Index>(k)) =
            scales[k] * shifts[k]->rows.segment(first, rows);
      }
      candidate.rightCols(nuisances) = shown_signals.nuisances.middleRows(first, rows);
      candidates.push_back(std::move(candidate));
      chains.push_back(std::move(chain));
      first += rows;
    }
    std::vector<Chain> chosen;
    const std::size_t wanted = (settings_.trials + chain() - 1) / chain();
    if (chains.size() < wanted) {
      return Error{
          "only " + std::to_string(chains.size()) + " of " +
          std::to_string(wanted * settings_.pool) + " chains of " + std::to_string(chain()) +
          " drives stay on a floor of " + std::to_string(config_.simulate.arena_m) + " m, and " +
          std::to_string(wanted) +
          " are wanted; give more --place, a shorter --chain or --durations, or a greater --pool"};
    }
    const std::vector<std::size_t> selected = select(candidates, nuisances, wanted);
    for (const std::size_t c : selected) chosen.push_back(chains[c]);
    *best_share = best_over_plan(candidates, nuisances, selected);
    return chosen;
  }

  // Whether all of these trials end within the arena.
  bool stays(const TrialLog& log, std::size_t first, std::size_t count) const {
    const auto within = [&](double at) { return at >= 0 && at <= config_.simulate.arena_m; };
    return std::all_of(log.trials.begin() + static_cast<std::ptrdiff_t>(first),
                       log.trials.begin() + static_cast<std::ptrdiff_t>(first + count),
                       [&](const Trial& t) { return within(t.X_WE.x) && within(t.X_WE.y); });
  }

  unsigned chain() const { return std::max(1U, config_.simulate.chain); }

  std::vector<PowerPoint> power(const Signals& planned, const TrialLog& planned_log,
                                const Signals& random, const TrialLog& random_log,
                                const std::vector<Visibility>& at) const {
    std::vector<PowerPoint> points;
    for (std::size_t part = 1; part <= kPowerPoints; ++part) {
      const auto of_plan = first_trials(planned_log, part, kPowerPoints);
      const auto of_random = first_trials(random_log, part, kPowerPoints);
      if (of_plan.empty() || of_random.empty()) continue;
      points.push_back({of_plan.size(), mean_power(config_.problem, planned.of(of_plan), at),
                        mean_power(config_.problem, random.of(of_random), at)});
    }
    return points;
  }

  const std::vector<std::size_t>& effects() const { return effects_; }

 private:
  Farm& farm_;
  const Config& config_;
  const PlanSettings& settings_;
  std::shared_ptr<const DiagnosisSubject> subject_;
  std::vector<std::size_t> effects_;
};

// Of the same effects in the same order.
void keep_common(std::vector<Visibility>* a, std::vector<Visibility>* b) {
  const auto lacks = [](const std::vector<Visibility>& all) {
    return [&all](const Visibility& v) { return !contains(all, v.effect, &Visibility::effect); };
  };
  std::erase_if(*a, lacks(*b));
  std::erase_if(*b, lacks(*a));
}

SvgPoint place_of(const Pose& X) { return {X.x, X.y}; }

// An arrow a trial, in its command's colour.
LineChart floor_chart(const Problem& problem, const TrialLog& log) {
  LineChart chart;
  chart.title = std::to_string(log.trials.size()) + " trials";
  chart.x_title = "x, m";
  chart.y_title = "y, m";
  chart.equal_axes = true;
  chart.series = mapped(problem.commands, [](const CommandSpec& command) {
    return ChartSeries{.name = command.name, .arrows = true};
  });
  ChartSeries put_down{.name = "the robot is put down"};
  const Trial* before = nullptr;
  for (const Trial& trial : log.trials) {
    ChartSeries* series = find_by(chart.series, trial.command, &ChartSeries::name);
    if (series == nullptr) series = &chart.series.back();
    series->line.insert(series->line.end(), {place_of(trial.X_WS), place_of(trial.X_WE)});
    const bool follows = before != nullptr && before->session == trial.session &&
                         before->X_WE.x == trial.X_WS.x && before->X_WE.y == trial.X_WS.y;
    if (!follows) put_down.marks.push_back(trial.X_WS);
    before = &trial;
  }
  chart.series.push_back(std::move(put_down));
  return chart;
}

LineChart power_chart(const std::vector<PowerPoint>& power) {
  LineChart chart;
  chart.title = "Share of effects that are named";
  chart.x_title = "trials driven";
  chart.y_least = 0;
  chart.y_most = 1;
  ChartSeries planned{"this plan", {{0, 0}}}, random{"random", {{0, 0}}};
  for (const PowerPoint& p : power) {
    planned.line.push_back({static_cast<double>(p.trials), p.planned});
    random.line.push_back({static_cast<double>(p.trials), p.random});
  }
  chart.series = {std::move(planned), std::move(random)};
  return chart;
}

}  // namespace

std::optional<double> trials_as_good(const std::vector<PowerPoint>& power) {
  PowerPoint before;
  for (const PowerPoint& p : power) {
    const double wanted = power.back().random;
    if (p.planned >= wanted) {
      const double rise = p.planned - before.planned;
      const double share = rise > 0 ? (wanted - before.planned) / rise : 1;
      return std::lerp(static_cast<double>(before.trials), static_cast<double>(p.trials), share);
    }
    before = p;
  }
  return std::nullopt;
}

Result<DesignedPlan> design_plan(Farm& farm, const Config& config, const PlanSettings& settings,
                                 const StageHooks& hooks) {
  hooks.began(0);
  if (diagnosis_subject(config.problem) == nullptr) {
    return Error{"scenario " + config.problem.scenario +
                 " cannot be diagnosed, so there is nothing to plan for"};
  }
  DesignedPlan plan;
  Designer designer(farm, config, settings);
  RETURN_IF_ERROR(designer.choose_effects(&plan));
  ASSIGN_OR_RETURN(const auto chains, designer.choose(&plan.best_share));
  hooks.began(1);
  const SimulateSettings& simulate = config.simulate;
  ASSIGN_OR_RETURN(auto log, designer.driven(dealt(chains, simulate.sessions, simulate.pause_s)));
  ASSIGN_OR_RETURN(const auto planned, designer.signals_of(log));
  ASSIGN_OR_RETURN(auto random, designer.driven(designer.draw(1, settings.seed + 1)));
  ASSIGN_OR_RETURN(const auto at_random, designer.signals_of(random));
  plan.seen = visibility(config.problem, planned);
  plan.seen_at_random = visibility(config.problem, at_random);
  keep_common(&plan.seen, &plan.seen_at_random);
  for (const std::size_t effect : designer.effects()) {
    const std::string& name = config.problem.table().effects()[effect].name;
    if (!contains(plan.seen, name, &Visibility::effect)) plan.without_shift.push_back(name);
  }
  plan.power = designer.power(planned, log, at_random, random, plan.seen_at_random);
  plan.log = std::move(log);
  plan.random = std::move(random);
  return plan;
}

std::string plan_picture(const Problem& problem, const DesignedPlan& plan) {
  std::vector<LineChart> charts = {floor_chart(problem, plan.log)};
  if (!plan.power.empty()) charts.push_back(power_chart(plan.power));
  return line_charts(charts, 2);
}

}  // namespace gapfarm::plan
