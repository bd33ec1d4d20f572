#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/report/ground_text.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

constexpr double kAlmostSure = 0.99;   // no log makes surer than this
constexpr double kRareWindows = 0.03;  // so many that are off by themselves are worth a look

void add_alias(const std::string& name, NamedEffect* effect) {
  if (name == effect->name || effect->aliases.size() >= kMostAliases) return;
  if (!contains(effect->aliases, name)) effect->aliases.push_back(name);
}

class GroundReport {
 public:
  GroundReport(const GroundRobot& robot, const GroundSearch& search,
               const GroundDiagnoseOptions& options)
      : robot_(robot),
        search_(search),
        options_(options),
        fitter_(robot, search.windows, search.reference, options.memo),
        unseen_rows_(rows_not_shown(fitter_, search, options.seed)),
        stated_(stated_values(fitter_, search, unseen_rows_, options.seed)) {}

  GroundDiagnosis write() {
    faults();
    readings();
    figures_.faults += report_sensor(search_.sensor, &d_);
    values();
    const std::size_t values_named = d_.effects.size();
    if (search_.loop) report_wheel_loop(*search_.loop, search_.reference.has_value(), &d_);
    figures_.faults += static_cast<int>(d_.effects.size() - values_named);
    figures();
    judge();
    result_.values = reported_values();
    if (const std::string sure = further_values(search_, result_.values); !sure.empty()) {
      d_.cautions.push_back(sure);
    }
    clocks();
    screening();
    trials();
    name_headline();
    d_.action = what_to_do(search_, figures_, d_);
    return std::move(result_);
  }

 private:
  // Of components of the residuals, in thousandths.
  double rms_of(const WindowFit& fit, Eigen::Index first, Eigen::Index count) const {
    double sum = 0;
    const auto raw = fitter_.raw_residuals(fit);
    const WindowSet& windows = search_.windows;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      if (windows.sense_of(i) == Sense::kPose) sum += raw[i].segment(first, count).squaredNorm();
    }
    return 1e3 * std::sqrt(sum / (windows.stretches() * windows.lengths));
  }

  NamedEffect effect_of(const GroundStep& step, std::size_t place) {
    const GroundHypothesis& h = search_.catalogue[step.chosen];
    NamedEffect effect;
    effect.name = h.name;
    for (const std::size_t other : step.not_distinguished) {
      add_alias(search_.catalogue[other].name, &effect);
    }
    for (const std::string& alias : h.aliases) add_alias(alias, &effect);
    // What is named beside it is no alternative to it.
    std::erase_if(effect.aliases, [&](const std::string& alias) {
      return contains(search_.steps, alias, [&](const GroundStep& named) {
        return search_.catalogue[named.chosen].name;
      });
    });
    if (!effect.aliases.empty()) {
      effect.alias_reason = "They move this robot alike on these runs.";
    }
    for (const KinematicRow& row : h.freed) {
      if (const Eigen::Index j = row_index(search_.fit.rows, row.name); j >= 0) {
        effect.parameters.push_back(
            estimate_of(row, stated_.values[j], stated_.intervals(j, 0), stated_.intervals(j, 1)));
      }
    }
    const double floor = mean(search_.best.nats);
    const WindowFit &before = search_.chain[place], &after = search_.chain[place + 1];
    effect.gap_before = (floor - mean(before.nats)) / search_.windows.counts;
    effect.gap_after = (floor - mean(after.nats)) / search_.windows.counts;
    effect.position_mm_before = rms_mm(before);
    effect.position_mm_after = rms_mm(after);
    effect.heading_mrad_before = rms_mrad(before);
    effect.heading_mrad_after = rms_mrad(after);
    const HeldOutGain closed =
        share_of_gap(search_.windows, after, before, search_.best, search_.chain[0], options_.seed);
    effect.closed = closed.mean;
    effect.closed_lo = closed.lo;
    effect.closed_hi = closed.hi;
    // What was gained over what would just have been worth a name.
    effect.confidence =
        std::min(kAlmostSure, 1 - 0.5 * std::exp((kLeastGroundGain - step.gain) / 2));
    const bool unknown = search_.reference && search_.reference->leaves_open(h.freed);
    effect.text = text_of_values(robot_, h, effect, search_.reference && !unknown);
    if (h.describe) h.describe(fitter_, search_.fit, options_.seed, &effect);
    if (unknown) effect.text += " The reference does not show it, so it may have been so before.";
    return effect;
  }

  void faults() {
    for (const FoundFault& fault : search_.faults) {
      const GroundHypothesis& h = search_.catalogue[fault.hypothesis];
      const double gap = fault.gain / search_.windows.stretches();
      NamedEffect effect = sure_effect(
          h.name, h.aliases,
          fmt::format(
              "The log is wrong in {}: put right, what {} expects is {:.1f} times as near to "
              "what was measured.",
              h.thing, source_of(robot_), std::exp(gap / 3)),
          h.remedy);
      effect.gap_before = gap / search_.windows.counts;
      d_.effects.push_back(std::move(effect));
    }
  }

  // What is beyond doubt, a warning of the log's too.
  NamedEffect sure_effect(const std::string& name, const std::vector<std::string>& aliases,
                          std::string text, const std::string& remedy) {
    NamedEffect effect;
    effect.name = name;
    for (const std::string& alias : aliases) add_alias(alias, &effect);
    effect.confidence = kAlmostSure;
    effect.text = std::move(text);
    d_.sanity.push_back({name, effect.text, remedy, Severity::kNote, true, effect.aliases});
    return effect;
  }

  // What the poses show by themselves.
  void readings() {
    append(d_.sanity, search_.jumps.findings);
    const auto add = [&](const char* name, const std::vector<std::string>& aliases,
                         Estimate estimate, std::string text, const char* remedy) {
      NamedEffect effect = sure_effect(name, aliases, std::move(text), remedy);
      effect.parameters = {std::move(estimate)};
      // What was read is no answer to what changed.
      if (search_.reference) return;
      d_.effects.push_back(std::move(effect));
      ++figures_.faults;
    };
    if (const StaleFrames& s = search_.stale; s.lo >= kLeastStaleShare) {
      add("stale_frames", {"pose_latency"}, {"share", s.share, s.lo, s.hi, "-"},
          fmt::format(
              "{} of {} poses on the way, {:.1f} % [{:.1f}, {:.1f}], repeat the one before; "
              "they were held out.",
              s.repeats, s.frames, 100 * s.share, 100 * s.lo, 100 * s.hi),
          "Log a pose once, with the time at which it was measured.");
    }
    const PoseGrid& g = search_.grid;
    const double rounding_m = g.step_m / std::sqrt(6.0);  // of the difference of two positions
    const double least_m = search_.free_fit.scales.front().head<2>().minCoeff();
    const double reach_m = wheel_reach_m(robot_);
    const bool coarse = reach_m > 0 && g.step_m >= kCoarseRounding * reach_m;
    if (g.step_m > 0 && (coarse || rounding_m >= kLeastRounding * least_m)) {
      add("pose_quantisation", {}, {"step", g.step_m, g.lo_m, g.hi_m, "m"},
          fmt::format("Positions are rounded to a grid of {:.4g} mm ({:.0f} nats).", 1e3 * g.step_m,
                      g.nats),
          "Log more digits.");
    }
  }

  void values() {
    for (std::size_t k = 0; k < search_.steps.size(); ++k) {
      d_.effects.push_back(effect_of(search_.steps[k], k));
      figures_.named.push_back(search_.steps[k].held_out);
    }
  }

  void figures() {
    const double floor = mean(search_.best.nats);
    const WindowFit &file = search_.chain.front(), &named = search_.chain.back();
    const double counts = search_.windows.counts;
    d_.gap = {(floor - mean(file.nats)) / counts, (floor - mean(named.nats)) / counts, 0};
    share_with_faults();
    d_.position_mm = {rms_mm(file), rms_mm(named), rms_mm(search_.best)};
    d_.heading_mrad = {rms_mrad(file), rms_mrad(named), rms_mrad(search_.best)};
    append(d_.cautions, cautions_of(robot_, search_));
  }

  // The gap is the log's as it was: what putting it right closes is a part, what values close is a
  // share of the rest.
  void share_with_faults() {
    const double rest = std::max(0.0, d_.gap.tuned);
    const std::span<NamedEffect> of_faults(d_.effects.data(), search_.faults.size());
    const double faults = sum_of(of_faults, &NamedEffect::gap_before);
    if (of_faults.empty() || !(faults + rest > 0)) return;
    for (NamedEffect& effect : d_.effects) {
      for (double* share : {&effect.closed, &effect.closed_lo, &effect.closed_hi}) {
        *share *= rest / (faults + rest);
      }
    }
    for (NamedEffect& fault : of_faults) {
      fault.closed = fault.closed_lo = fault.closed_hi = fault.gap_before / (faults + rest);
    }
    d_.gap.tuned += faults;
  }

  void judge() {
    figures_.faults += static_cast<int>(search_.faults.size());
    figures_.closable = search_.closable;
    figures_.best_of_all = search_.best_of_all;
    figures_.far_runs = far_runs(fitter_, search_);
    has_far_runs_ = !figures_.far_runs.empty();
    if (!has_far_runs_) figures_.far_runs = far_windows(fitter_, search_, kFarShare);
    figures_.unexplained = search_.unexplained;
    figures_.stood = hardly_moved(search_.log);
    if (nothing_is_left(figures_)) figures_.far_runs = unconfirmed_part(search_);
    d_.verdict = ground_verdict(figures_);
    if (figures_.far_runs.empty()) {
      const std::string rare = far_windows(fitter_, search_, kRareWindows);
      if (!rare.empty()) d_.cautions.push_back(rare);
    }
    d_.findings.push_back(verdict_reason(figures_));
    if (!search_.stand_ins.empty()) d_.findings.push_back(nearest_of_catalogue(search_));
    unseen_ = values_not_shown(search_, unseen_rows_);
    if (!unseen_.empty()) d_.cautions.push_back(unseen_);
    const std::string moved = values_that_would_move(search_);
    if (nothing_is_left(figures_)) {
      if (search_.reference && d_.gap.final_ > kToleratedGap) {
        d_.findings.insert(d_.findings.begin(),
                           "What gap there is closes where values move as they do from log to log" +
                               (moved.empty() ? "." : ": " + moved + "."));
      }
      return;
    }
    d_.where = where_left(fitter_, search_);
    if (d_.where.empty() && !figures_.far_runs.empty()) {
      d_.where.push_back(
          {"all", "x", "outliers", "", d_.position_mm.final_, 1, 1, figures_.far_runs});
    }
    if (!moved.empty()) {
      d_.findings.push_back("Were all values free, these would move most: " + moved + ".");
    }
  }

  void clocks() {
    if (!search_.clocks.empty()) d_.cautions.push_back(search_.clocks);
    // A run that is off by itself looks as if its clock were.
    const std::string runs = has_far_runs_ ? "" : clocks_apart(fitter_, search_);
    if (runs.empty()) return;
    d_.cautions.push_back(
        "The runs' clocks are apart: from command to pose it takes " + runs +
        ". Each log's commands and poses need one clock; how late they are on the "
        "whole is no surer than that.");
  }

  void screening() {
    if (search_.offers.empty()) return;
    for (const Offer& offer : search_.offers.front()) {
      const GroundHypothesis& h = search_.catalogue[offer.hypothesis];
      Screened s;
      s.effect = h.name;
      s.gain = offer.gain;
      s.p = std::exp(-std::max(0.0, offer.gain));
      const bool fitted = offer.values.size() > 0;
      for (std::size_t k = 0; fitted && k < h.freed.size(); ++k) {
        s.estimate += fmt::format("{}{} {:+.4g} {}", k > 0 ? ", " : "", h.freed[k].key,
                                  offer.values[k] - h.freed[k].nominal, h.freed[k].unit);
      }
      s.note = h.thing;
      d_.screening.push_back(std::move(s));
    }
    for (const auto& offers : search_.offers) {
      SelectionRecord record;
      for (std::size_t k = 0; k < d_.steps.size(); ++k) {
        record.explained.push_back(search_.catalogue[search_.steps[k].chosen].name);
      }
      for (std::size_t k = 0; k < std::min<std::size_t>(offers.size(), 5); ++k) {
        record.offered.emplace_back(search_.catalogue[offers[k].hypothesis].name, offers[k].gain);
      }
      d_.steps.push_back(std::move(record));
    }
  }

  void trials() {
    const auto cov_of = [&](const WindowFit& fit, std::size_t i) {
      const Eigen::Vector3d s = fit.scales[search_.windows.horizon[i]];
      return Eigen::Matrix3d(s.cwiseProduct(s).asDiagonal());
    };
    d_.shown = {{"left_speed", "speed of the left side, m/s", "left side"},
                {"right_speed", "speed of the right side, m/s", "right side"},
                {"ahead", "speed ahead, m/s", "speed ahead"},
                {"turn", "rate of turning, rad/s", "rate of turning"}};
    const std::vector<WindowSpeeds> speeds = window_speeds(fitter_, search_.chain.back());
    const auto tuned = fitter_.raw_residuals(search_.chain.front());
    const auto last = fitter_.raw_residuals(search_.chain.back());
    for (std::size_t i = 0; i < search_.windows.trials.size(); ++i) {
      if (search_.windows.sense_of(i) != Sense::kPose) continue;
      const Trial& from = search_.windows.trials[i];
      DiagnosedTrial t;
      t.session = from.session;
      t.trial = static_cast<std::int64_t>(i);
      t.command = search_.windows.length_text(search_.windows.horizon[i]);
      t.session_time_s = *from.t_s;
      t.duration_s = *from.duration_s;
      t.held_out = true;
      t.X_WS = from.X_WS;
      t.measured = between(from.X_WS, from.X_WE);
      t.tuned_residual = tuned[i];
      t.final_residual = last[i];
      t.tuned = between(from.X_WS, expected_end(from, t.tuned_residual));
      t.final_ = between(from.X_WS, expected_end(from, t.final_residual));
      t.tuned_cov = cov_of(search_.chain.front(), i);
      t.final_cov = cov_of(search_.chain.back(), i);
      t.tuned_score = search_.chain.front().nats[i];
      t.final_score = search_.chain.back().nats[i];
      const WindowSpeeds& v = speeds[i];
      t.covariates = {v.left_m_s, v.right_m_s, v.ahead_m_s, v.turn_rad_s};
      d_.trials.push_back(std::move(t));
    }
  }

  void name_headline() {
    const bool changes = search_.reference.has_value();
    if (d_.effects.empty()) {
      const bool nothing = d_.verdict == Verdict::kNone;
      d_.headline =
          changes   ? (nothing ? "Nothing changed by more than a robot does from log to log."
                               : "Something changed that nothing of the catalogue explains alone.")
          : nothing ? (search_.clocks.empty() ? nothing_wrong(robot_) : search_.clocks)
          : something_is_left(figures_)
              ? "Something is wrong that nothing of the catalogue explains alone."
              : "Nothing is significantly wrong, but these runs do not exclude it.";
      if (!d_.findings.empty()) d_.headline += " " + d_.findings.front();
      if (!unseen_.empty()) d_.headline += " " + unseen_;
      return;
    }
    d_.headline = d_.effects.front().text;
    if (changes && d_.effects.size() == 1 && !d_.headline.empty()) {
      d_.headline.back() = ';';
      d_.headline += d_.verdict != Verdict::kEffect ? " it does not explain all."
                     : search_.loop                 ? " nothing else behind the wheels."
                                                    : " nothing else.";
    }
    if (d_.effects.size() > 1) {
      d_.headline +=
          " Beside it: " + joined(std::span(d_.effects).subspan(1), ", ", &NamedEffect::name) + ".";
    }
  }

  std::vector<ReportedValue> reported_values() const {
    std::vector<ReportedValue> values;
    for (std::size_t j = 0; j < search_.fit.rows.size(); ++j) {
      const KinematicRow& row = search_.fit.rows[j].row;
      values.push_back({row.name,
                        value_in_file(robot_, row.name),
                        stated_.values[j],
                        {stated_.intervals(j, 0), stated_.intervals(j, 1)},
                        stated_.in_file[j]});
      for (const SensorValue& v : search_.sensor) {
        if (v.row.name != row.name) continue;
        values.back() = {v.row.name, v.had, v.value, v.interval, v.shown};
      }
    }
    return values;
  }

  double rms_mm(const WindowFit& fit) const { return rms_of(fit, 0, 2); }
  double rms_mrad(const WindowFit& fit) const { return rms_of(fit, 2, 1); }

  const GroundRobot& robot_;
  const GroundSearch& search_;
  const GroundDiagnoseOptions& options_;
  WindowFitter fitter_;
  std::vector<std::string> unseen_rows_;
  StatedValues stated_;
  std::string unseen_;  // which values no window shows; empty: none
  bool has_far_runs_ = false;
  GroundDiagnosis result_;
  Diagnosis& d_ = result_.diagnosis;
  GroundFigures& figures_ = result_.figures;
};

}  // namespace

GroundDiagnosis report_ground(const GroundRobot& robot, const GroundSearch& search,
                              const GroundDiagnoseOptions& options) {
  return GroundReport(robot, search, options).write();
}

}  // namespace gapfarm
