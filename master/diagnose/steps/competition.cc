#include "master/diagnose/steps/competition.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "master/diagnose/conclusions/findings.h"
#include "master/infer/certificate.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

using infer::Coordinate;

infer::Space base_space(const Study& study, BaseParameters base, Eigen::Index columns) {
  std::vector<Coordinate> coordinates = infer::columns(columns);
  if (base == BaseParameters::kHeld) {
    return infer::Space(*study.table, std::move(coordinates), study.base);
  }
  for (const BaseParameter& p : study.base_parameters) {
    Coordinate& c = coordinates.emplace_back();
    c.kind = Coordinate::Kind::kLogarithm;
    c.row = p.row;
    c.size = p.prior_log_sd / 2;
  }
  return infer::Space(*study.table, std::move(coordinates));
}

// A row of the effect, or one of the base's that only matters beside it.
std::size_t searched_row(const EffectDiagnosis& effect, const SearchedSize& size,
                         const ParameterTable& table) {
  const auto own = table.find(std::string(effect.effect) + "." + size.key);
  return own ? *own : table.row(size.key);
}

std::vector<SearchedSize> searched_of(const EffectDiagnosis& effect) {
  if (!effect.searched.empty()) return effect.searched;
  return mapped(effect.steps, [](const ProbedStep& step) {
    return SearchedSize{step.key, step.size};
  });
}

// A mark at a place takes drives for others that begin or end within its shift of a line, and is
// the less like them the larger it is: times what it takes of the data.
constexpr double kFartherStarts[] = {2, 3};

// Two sizes to either side of nothing: every corner of the box, or four directions.
std::vector<infer::Start> corners(const infer::Space& own) {
  constexpr double kFar = 2;  // sizes
  std::vector<infer::Start> starts;
  const Eigen::VectorXd neutral = own.from({});
  const auto dimensions = static_cast<unsigned>(own.dimensions());
  for (unsigned corner = 0; corner < 1u << dimensions; ++corner) {
    Eigen::VectorXd u = neutral;
    for (unsigned k = 0; k < dimensions; ++k) u[k] += (corner >> k & 1u) != 0 ? kFar : -kFar;
    starts.push_back({own.values(u.cwiseMax(own.lower()).cwiseMin(own.upper())), {}});
  }
  return starts;
}

Eigen::MatrixXd columns_of(const Evidence& evidence, const std::vector<Signature>& first) {
  std::vector<Eigen::VectorXd> columns;
  for (const Signature& s : first) {
    for (Eigen::Index k = 0; k < s.columns.cols(); ++k) {
      const double norm = s.columns.col(k).norm();
      if (norm > 0) columns.push_back(s.columns.col(k) * (kAsGoodAsFree / norm));
    }
  }
  Eigen::MatrixXd all(evidence.nuisances.rows(),
                      evidence.nuisances.cols() + static_cast<Eigen::Index>(columns.size()));
  all.leftCols(evidence.nuisances.cols()) = evidence.nuisances;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    all.col(evidence.nuisances.cols() + static_cast<Eigen::Index>(k)) = columns[k];
  }
  return all;
}

}  // namespace

Competition::Competition(const DiagnosisRequest& of, const Study& study, const Evidence& evidence,
                         const std::vector<Signature>& first, BaseParameters base)
    : of_(of),
      study_(study),
      forward_(infer::remembering([&of](const std::vector<PredictionRequest>& points) {
        return of.predictor.attempt(points);
      })),
      base_(*study.table, {}) {
  // Where the base has to be searched anyway, nothing is known of it to first order; elsewhere the
  // noise is known from what no smooth function explains.
  const bool moves = of.subject.base_moves;
  const Eigen::MatrixXd columns = moves ? no_nuisances(study) : columns_of(evidence, first);
  observations_ = observations_of(study, columns, infer::Loss::kStudent);
  observations_.fold = of.subject.folds(study);
  observations_.least_scale =
      moves ? kLeastNoiseScale : infer::kBestScaleOfGaussian * std::sqrt(kLeastLeftoverScale);
  observations_.most_scale =
      moves ? INFINITY : infer::kBestScaleOfGaussian * std::sqrt(kMostLeftoverScale);
  base_ = base_space(study, base, columns.cols());
}

std::vector<Coordinate> Competition::coordinates_of(const std::string& name) const {
  const ParameterTable& table = *study_.table;
  const EffectDiagnosis& effect = of_.subject.effects->row(name);
  std::vector<Coordinate> coordinates;
  for (const SearchedSize& size : searched_of(effect)) {
    Coordinate& c = coordinates.emplace_back();
    c.row = searched_row(effect, size, table);
    const Parameter& p = table[c.row];
    c.size = size.size * (p.unit == "m" ? study_.scale : 1);
    const bool is_place = std::ranges::any_of(
        effect.places, [&](const auto& place) { return std::string_view(place.key) == size.key; });
    if (!effect.searched.empty() && !is_place) c.prior_sd = kPriorSizes;
    if (effect.polar) {
      c.kind = Coordinate::Kind::kPolar;
      c.direction_row = table.row(effect.polar->direction);
      c.symmetry = effect.polar->symmetry;
      c.of_ratio = effect.polar->ratio;
    } else if (size.logarithm) {
      c.kind = Coordinate::Kind::kLogarithm;
    } else if (p.key.ends_with(".direction")) {
      c.kind = Coordinate::Kind::kAngle;
      c.prior_sd = INFINITY;
    }
  }
  return coordinates;
}

std::vector<infer::Hypothesis> Competition::of_rows(const std::set<std::string>& without) const {
  std::vector<infer::Hypothesis> hypotheses;
  for (const EffectDiagnosis* effect : *of_.subject.effects) {
    if (effect->searched.empty() || without.count(effect->effect) || of_.excluded(effect->effect))
      continue;
    infer::Hypothesis& h = hypotheses.emplace_back();
    h.name = effect->effect;
    h.coordinates = coordinates_of(h.name);
    h.from_neutral = effect->proposals == nullptr;
    h.starts = h.from_neutral ? corners(base_.only(h.coordinates)) : effect->proposals(study_);
  }
  return hypotheses;
}

// Observations that a disc there can change.
std::vector<std::uint32_t> Competition::touched_by(const std::string& effect,
                                                   const Overrides& at) const {
  Signature disc;
  disc.effect = effect;
  for (const auto& [row, value] : at) disc.fixed[of_.table()[row].key] = value;
  return study_.subject->touched_by(of_.problem, study_, patch_of(disc));
}

infer::Hypothesis Competition::of_mark(const EffectCandidate& mark, const Regression& explained,
                                       const std::vector<EffectCandidate>& found_before) const {
  infer::Hypothesis h;
  h.name = mark.effect();
  h.coordinates = coordinates_of(h.name);
  h.from_neutral = false;
  const auto dimensions = static_cast<double>(base_.only(h.coordinates).dimensions());
  h.luck = std::max(0.0, mark.signature.penalty - dimensions / 2);
  const auto start_at = [&](double times) {
    const auto values = start_values(study_, explained, mark.signature, times);
    set_values(of_.table(), values, &h.starts.emplace_back().at);
  };
  start_at(1);
  if (of_.subject.effects->row(kind_of(h.name)).marks != nullptr) {
    for (const double times : kFartherStarts) start_at(times);
  }
  for (const EffectCandidate& before : found_before) {
    if (before.effect() == h.name)
      set_values(of_.table(), before.signature.fixed, &h.starts.emplace_back().at);
  }
  if (!mark.signature.whole) return h;
  // What has a place does nothing elsewhere.
  h.promised = mark.gain;
  h.touched = [this, effect = h.name](const Overrides& at) { return touched_by(effect, at); };
  for (infer::Start& start : h.starts) start.reach = h.touched(start.at);
  std::erase_if(h.starts, [](const infer::Start& start) { return start.reach.empty(); });
  return h;
}

std::map<std::string, double> Competition::values_of(const std::string& effect,
                                                     const infer::Model& model) const {
  std::map<std::string, double> values;
  for (const auto& [row, value] : model.space.values(model.fit.u)) {
    const Parameter& p = of_.table()[row];
    if (p.effect == effect) values[p.key] = value;
  }
  return values;
}

Eigen::VectorXd Competition::unexplained(const infer::Model& model) const {
  const Eigen::MatrixXd& columns = observations_.columns;
  Eigen::VectorXd rows = model.fit.z + columns * model.fit.u.head(columns.cols());
  study_.drop_ignored(rows);
  return rows;
}

}  // namespace gapfarm::steps
