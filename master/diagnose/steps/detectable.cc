// From which size on the log names an effect.

#include <algorithm>
#include <cmath>

#include "common/math/algebra.h"
#include "master/diagnose/steps/competition.h"
#include "master/infer/certificate.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

// Standard deviation of what a model leaves, over what the whitener says.
double noise_of(const infer::Model& model) { return model.fit.scale / infer::kBestScaleOfGaussian; }

// Of what is learnt from, in standard deviations of the noise.
Eigen::MatrixXd in_noise(const Study& study, const Eigen::MatrixXd& slopes, double noise) {
  Eigen::MatrixXd own = slopes / noise;
  study.drop_ignored(own);
  return own;
}

// Columns in standard deviations of their coordinates' priors.
Eigen::MatrixXd in_priors(Eigen::MatrixXd slopes, const Eigen::VectorXd& precision) {
  for (Eigen::Index k = 0; k < slopes.cols(); ++k) {
    slopes.col(k) *= precision[k] > 0 ? 1 / std::sqrt(precision[k]) : kAsGoodAsFree;
  }
  return slopes;
}

// Of an effect's strengths how far they are from nothing, by the first of several moves that shows
// one.  What lies on a bound was cut off there: no size within it would be named.
void add_sizes(const ParameterTable& table, const std::string& effect,
               const std::map<std::string, double>& values, Sizes* sizes) {
  for (const Effect& known : table.effects()) {
    for (std::size_t i = 0; known.name == effect && i < known.strengths; ++i) {
      const std::string& key = known.parameters[i].key;
      const auto found = values.find(effect + "." + key);
      if (found == values.end()) continue;
      const Parameter& row = table[table.row(found->first)];
      const double size = std::abs(found->second - row.nominal);
      const bool cut = found->second <= row.lower || found->second >= row.upper;
      const bool there = contains(*sizes, key, &Sizes::value_type::first);
      if (size > 0 && !cut && !there) sizes->emplace_back(key, size);
    }
  }
}

// Coefficients that reach so many squares of information: the direction that shows least where it
// is one strength with a direction, each alone otherwise.
std::vector<Eigen::VectorXd> reaching(const Eigen::MatrixXd& information, double squares,
                                      bool polar) {
  std::vector<Eigen::VectorXd> all;
  if (polar) {
    const SymmetricAxes axes = axes_of_symmetric(information.topLeftCorner<2, 2>());
    if (axes.values[0] > 0)
      all.emplace_back(axes.vectors.col(0) * std::sqrt(squares / axes.values[0]));
    return all;
  }
  for (Eigen::Index k = 0; k < information.cols(); ++k) {
    if (!(information(k, k) > 0)) continue;
    all.push_back(Eigen::VectorXd::Zero(information.cols()));
    all.back()[k] = std::sqrt(squares / information(k, k));
  }
  return all;
}

// From nothing, in the coordinates that the effect is searched in.
void add_reached(const DiagnosisRequest& of, const Competition& competition,
                 const std::string& effect, const std::vector<infer::Coordinate>& coordinates,
                 const Eigen::MatrixXd& information, double squares, DetectableSizes* all) {
  const infer::Space own = competition.base().only(coordinates);
  const Eigen::VectorXd nothing = own.from({});
  const bool polar = coordinates.front().kind == infer::Coordinate::Kind::kPolar;
  for (const Eigen::VectorXd& c : reaching(information, squares, polar)) {
    std::map<std::string, double> values;
    const Eigen::VectorXd there = (nothing + c).cwiseMax(own.lower()).cwiseMin(own.upper());
    for (const auto& [row, value] : own.values(there)) values[of.table()[row].key] = value;
    add_sizes(of.table(), effect, values, &(*all)[effect]);
  }
}

}  // namespace

DetectableSizes detectable_by_marks(const DiagnosisRequest& of, const Study& study,
                                    const infer::Model& model, const Regression& explained,
                                    const std::vector<EffectCandidate>& offered,
                                    double explained_nats) {
  DetectableSizes all;
  const double noise = noise_of(model);
  for (const EffectCandidate& candidate : offered) {
    const Signature& mark = candidate.signature;
    const Eigen::Index n = mark.columns.cols();
    const Eigen::MatrixXd information = explained.information(mark.columns) / (noise * noise);
    const double luck = std::max(0.0, mark.penalty - 0.5 * static_cast<double>(n));
    const double squares =
        infer::detectable_squares(least_gain_of(mark.effect, study, explained_nats) + luck, n);
    const bool polar = of.subject.effects->row(mark.effect).polar.has_value() && n >= 2;
    for (Eigen::VectorXd& c : reaching(information, squares, polar)) {
      if (c.size() < n) c.conservativeResizeLike(Eigen::VectorXd::Zero(n));
      std::map<std::string, double> values = values_at(study, explained, mark, c);
      // A mark that is all that the effect does grows in proportion.
      for (auto& [key, value] : values) {
        const double nominal = of.table()[of.table().row(key)].nominal;
        if (mark.whole) value = nominal + c[0] * (value - nominal);
      }
      add_sizes(of.table(), mark.effect, values, &all[mark.effect]);
    }
  }
  return all;
}

Result<DetectableSizes> detectable_by_slopes(const DiagnosisRequest& of, const Study& study,
                                             const Competition& competition,
                                             const infer::Model& model,
                                             const std::set<std::string>& without,
                                             double explained_nats) {
  DetectableSizes all;
  const Eigen::Index before = model.fit.u.size();
  const double noise = noise_of(model);
  for (const infer::Hypothesis& h : competition.of_rows(without)) {
    // What has a place has no slope at nothing.
    if (!h.from_neutral) continue;
    const infer::Space own = competition.base().only(h.coordinates);
    const Eigen::VectorXd nothing = own.from({});
    infer::Fit fit = model.fit;
    fit.u.conservativeResize(before + nothing.size());
    fit.u.tail(nothing.size()) = nothing;
    const infer::Fitter fitter(competition.forward(), competition.observations(),
                               model.space.with(h.coordinates));
    if (Status s = fitter.differentiate(&fit, before); !s) return s.error();
    const Eigen::MatrixXd slopes = in_noise(study, fit.slopes, noise);
    const Eigen::MatrixXd information = infer::information(
        slopes.rightCols(nothing.size()), in_priors(slopes.leftCols(before), model.space.prior()));
    const double squares = infer::detectable_squares(
        least_gain_of(h.name, study, explained_nats) + h.luck, nothing.size());
    add_reached(of, competition, h.name, h.coordinates, information, squares, &all);
  }
  return all;
}

void add_detectable_of_chosen(const DiagnosisRequest& of, const Study& study,
                              const Competition& competition, const infer::Model& model,
                              const std::vector<EffectCandidate>& chosen, DetectableSizes* all) {
  const double noise = noise_of(model);
  const double explained_nats = sum_of_gains(chosen);
  Eigen::Index at = competition.base().dimensions();
  for (const EffectCandidate& c : chosen) {
    const std::string& effect = c.effect();
    const std::vector<infer::Coordinate> coordinates = competition.coordinates_of(effect);
    const Eigen::Index own = competition.base().only(coordinates).dimensions();
    const Eigen::MatrixXd all_slopes = in_noise(study, model.fit.slopes, noise);
    const Eigen::MatrixXd slopes = all_slopes.middleCols(at, own);
    Eigen::MatrixXd others = in_priors(all_slopes, model.space.prior());
    others.middleCols(at, own).setZero();
    at += own;
    if (!of.subject.effects->row(effect).places.empty()) continue;
    const double squares =
        infer::detectable_squares(least_gain_of(effect, study, explained_nats - c.gain), own);
    add_reached(of, competition, effect, coordinates, infer::information(slopes, others), squares,
                all);
  }
}

}  // namespace gapfarm::steps
