#include "master/diagnose/fit/signatures.h"

#include <algorithm>
#include <iterator>
#include <numbers>

#include "common/base/ranges.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/fit/slopes.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

constexpr double kThirdOfTurn_rad = 2 * std::numbers::pi / 3;
constexpr int kDirections = 24;

std::string key_of(const EffectDiagnosis& row, const char* key) {
  return std::string(row.effect) + "." + key;
}

// A strength, first, that acts in a direction.
bool is_turned(const EffectDiagnosis& row) {
  return row.polar || std::ranges::any_of(row.searched, [](const SearchedSize& size) {
           return std::string_view(size.key) == "direction";
         });
}

// Of the strength as it is searched: along both axes where these are its coordinates, else in three
// directions, from which all follow.
std::vector<Probe> turned_probes(const EffectDiagnosis& row) {
  const std::string direction = key_of(row, "direction");
  const SearchedSize& strength = row.searched.front();
  std::vector<double> turns = {0, kThirdOfTurn_rad, -kThirdOfTurn_rad};
  if (row.polar) turns = {0, std::numbers::pi / 2 / row.polar->symmetry};
  return mapped(turns, [&](double turn) {
    return Probe{row.effect,
                 {{key_of(row, strength.key), strength.size}, {direction, turn}},
                 {},
                 strength.size};
  });
}

// Those of an effect's own, of its strength in directions, or its parameters moved by their steps.
std::vector<Probe> probes_of(const EffectDiagnosis& row, const Study& study) {
  if (row.probes != nullptr) return row.probes(study);
  if (is_turned(row)) return turned_probes(row);
  std::vector<Probe> all;
  for (const ProbedStep& step : row.steps) {
    const std::string key = key_of(row, step.key);
    const Parameter& parameter = (*study.table)[study.table->row(key)];
    const double neutral = parameter.nominal;
    const double size = step.size * (parameter.unit == "m" ? study.scale : 1);
    Probe& probe = all.emplace_back();
    probe.effect = row.effect;
    probe.plus = {{key, neutral + size}};
    if (step.both_ways) probe.minus = {{key, neutral - size}};
    probe.scale = (step.both_ways ? 2 : 1) * size;
  }
  return all;
}

bool has_effect(const Study& study, const std::string& name) {
  return contains(study.table->effects(), name, &Effect::name);
}

bool one_condition(const Study& study) {
  const auto same = [&](const Cell& c) {
    return c.kind == study.cells.front().kind && c.level == study.cells.front().level &&
           c.command.duration_s == study.cells.front().command.duration_s;
  };
  return std::all_of(study.cells.begin(), study.cells.end(), same);
}

// A column a probe.
Signature plain_signature(const EffectDiagnosis& row, const Study& study,
                          std::span<const Slope> slopes, std::span<const Probe> probes) {
  Signature s;
  s.effect = row.effect;
  s.columns = stack(mapped(slopes, [&](const auto& d) { return study.whiten(d); }));
  s.penalty = 0.5 * static_cast<double>(slopes.size());
  for (const Probe& probe : probes) {
    if (probe.plus.size() == 1) s.parameters.push_back(probe.plus.begin()->first);
  }
  return s;
}

// Of a plain signature of three directions one in each of many: a force has a part that is the same
// in all of them, and one that turns with them.
std::vector<Signature> in_directions(const EffectDiagnosis& row, const Signature& three) {
  std::vector<Signature> all;
  for (int k = 0; k < kDirections; ++k) {
    const double direction = wrap_angle(2 * std::numbers::pi * k / kDirections);
    const Eigen::Vector3d from(direction, direction - kThirdOfTurn_rad,
                               direction + kThirdOfTurn_rad);
    Signature& s = all.emplace_back(three);
    s.columns = three.columns * ((1 + 2 * from.array().cos()) / 3).matrix();
    s.parameters = {key_of(row, row.searched.front().key)};
    s.fixed = {{key_of(row, "direction"), direction}};
    s.penalty = 2;  // of the directions, too
  }
  return all;
}

}  // namespace

Eigen::Vector2d middle_of(const Study& study) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const ResidualTrial& t : study.trials) {
    middle += Eigen::Vector2d(t.X_WS.x, t.X_WS.y) / static_cast<double>(study.size());
  }
  return middle;
}

Result<std::vector<Signature>> signatures(Predictor& predictor, const Study& study,
                                          const std::vector<std::string>& excluded) {
  std::vector<Probe> probes;
  std::vector<std::size_t> first;  // probe of each row, and behind the last one
  for (const EffectDiagnosis* row : *study.subject->effects) {
    first.push_back(probes.size());
    if (!has_effect(study, row->effect)) continue;
    for (Probe& probe : probes_of(*row, study)) probes.push_back(std::move(probe));
  }
  first.push_back(probes.size());
  ASSIGN_OR_RETURN(const auto probed, probe_all(predictor, study, probes));

  std::vector<Signature> found, marks;
  std::size_t k = 0;
  for (const EffectDiagnosis* row : *study.subject->effects) {
    const std::size_t from = first[k], count = first[k + 1] - from;
    ++k;
    if (row->marks != nullptr && has_effect(study, row->effect)) {
      std::vector<Signature> all = row->marks(study);
      std::move(all.begin(), all.end(), std::back_inserter(marks));
    }
    const std::span<const Slope> slopes = std::span<const Slope>(probed).subspan(from, count);
    if (slopes.empty() || std::ranges::any_of(slopes, &Slope::empty)) continue;
    Signature plain =
        plain_signature(*row, study, slopes, std::span<const Probe>(probes).subspan(from, count));
    if (!is_turned(*row) || row->polar) {
      found.push_back(std::move(plain));
    } else {
      std::ranges::move(in_directions(*row, plain), std::back_inserter(found));
    }
  }
  std::move(marks.begin(), marks.end(), std::back_inserter(found));
  const bool only_reach = one_condition(study);
  std::erase_if(found, [&](const Signature& s) {
    return (only_reach && study.subject->effects->row(s.effect).changes_reach) ||
           contains(excluded, s.effect);
  });
  return found;
}

Result<std::vector<Signature>> patch_signatures(Predictor& predictor, const Study& study,
                                                const std::vector<Patch>& places) {
  PredictionRequest without = {study.base, {}};
  std::vector<Pose> ends_without = study.predicted_ends();
  if (const auto coarse = coarser(predictor, study, study.base)) {
    ASSIGN_OR_RETURN(auto there, predictor.attempt({*coarse}));
    if (there.front()) {
      without = *coarse;
      ends_without = std::move(*there.front());
    }
  }
  std::vector<PredictionRequest> requests;
  std::vector<std::map<std::string, double>> values;
  for (const Patch& place : places) {
    PredictionRequest request = without;
    request.trials = study.subject->touched_by(predictor.problem(), study, place);
    values.push_back(patch_values(place));
    set_values(*study.table, values.back(), &request.at);
    if (request.trials.empty()) request.trials.push_back(0);
    requests.push_back(std::move(request));
  }
  ASSIGN_OR_RETURN(const auto ends, predictor.attempt(requests));
  // Asked once, and not again and again, of a program that can simulate none.
  const auto failed = [](const auto& simulated) { return !simulated; };
  if (std::all_of(ends.begin(), ends.end(), failed)) predictor.exclude(kPatchEffect);
  std::vector<Signature> all;
  for (std::size_t k = 0; k < requests.size(); ++k) {
    if (!ends[k]) predictor.exclude(std::string("some places of ") + kPatchEffect);
    std::vector<Eigen::Vector3d> d(study.size(), Eigen::Vector3d::Zero());
    for (std::size_t j = 0; ends[k] && j < requests[k].trials.size(); ++j) {
      const std::size_t i = requests[k].trials[j];
      d[i] = difference_of(study.trials[i], ends_without[i], (*ends[k])[j]);
    }
    Signature s;
    s.effect = kPatchEffect;
    s.columns = stack({study.whiten(d)});
    s.fixed = values[k];
    s.penalty = 6;
    s.whole = true;
    all.push_back(std::move(s));
  }
  return all;
}

}  // namespace gapfarm
