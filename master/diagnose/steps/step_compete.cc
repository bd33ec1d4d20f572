// Base and hypotheses searched together: where slopes taken at the base lie.

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/digits.h"
#include "common/math/laws.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/infer/compete.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

using infer::Coordinate;

// What is asked of a search for causes.
struct Competition {
  infer::Forward forward;
  infer::Observations observations;
  std::vector<infer::Hypothesis> hypotheses;
  std::size_t base_coordinates = 0;
};

infer::Space base_space(const Study& study) {
  std::vector<Coordinate> coordinates;
  for (const BaseParameter& p : study.base_parameters) {
    Coordinate c;
    c.kind = Coordinate::Kind::kLogarithm;
    c.row = p.row;
    c.size = p.prior_log_sd / 2;
    coordinates.push_back(c);
  }
  return infer::Space(*study.table, std::move(coordinates));
}

// A row of the effect, or one of the base's that only matters beside it.
std::size_t searched_row(const EffectDiagnosis& effect, const SearchedSize& size,
                         const ParameterTable& table) {
  const auto own = table.find(std::string(effect.effect) + "." + size.key);
  return own ? *own : table.row(size.key);
}

std::vector<Coordinate> coordinates_of(const EffectDiagnosis& effect, const ParameterTable& table) {
  std::vector<Coordinate> coordinates;
  for (const SearchedSize& size : effect.searched) {
    Coordinate c;
    c.row = searched_row(effect, size, table);
    c.size = size.size;
    c.has_prior =
        std::none_of(effect.places.begin(), effect.places.end(),
                     [&](const WorldPlace& p) { return std::string_view(p.key) == size.key; });
    if (effect.polar) {
      c.kind = Coordinate::Kind::kPolar;
      c.direction_row = table.row(effect.polar->direction);
      c.symmetry = effect.polar->symmetry;
      c.of_ratio = effect.polar->ratio;
    } else if (size.logarithm) {
      c.kind = Coordinate::Kind::kLogarithm;
    }
    coordinates.push_back(c);
  }
  return coordinates;
}

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

Competition competition(const DiagnosisRequest& of, const Study& study) {
  Competition c;
  c.forward = [&of](const std::vector<PredictionRequest>& points) {
    return of.predictor.attempt(points);
  };
  for (const ResidualTrial& t : study.trials) c.observations.measured.push_back(t.X_WE);
  c.observations.whitener = study.whitener;
  c.observations.fold = of.subject.folds(study);
  const infer::Space base = base_space(study);
  c.base_coordinates = base.coordinates();
  for (const EffectDiagnosis* effect : *of.subject.effects) {
    if (effect->searched.empty() || of.excluded(effect->effect)) continue;
    infer::Hypothesis h;
    h.name = effect->effect;
    h.coordinates = coordinates_of(*effect, *study.table);
    h.from_neutral = effect->proposals == nullptr;
    h.starts = h.from_neutral ? corners(base.only(h.coordinates)) : effect->proposals(study);
    c.hypotheses.push_back(std::move(h));
  }
  return c;
}

// What a contest's best has to gain, held out, beside what was explained before.
bool enters(const DiagnosisRequest& of, const infer::Contender& best, double explained) {
  return best.gain >= std::max(of.subject.least_gain, kLeastShare * explained) &&
         best.gain >= infer::kSureGain * best.gain_se;
}

// Hypotheses that predict as well as the best, as far as anybody can show.
std::vector<Alias> aliases_of(const std::vector<infer::Hypothesis>& hypotheses,
                              const infer::Contest& contest) {
  const infer::Contender& best = contest.contenders.front();
  std::vector<Alias> aliases;
  for (const infer::Contender& other : contest.contenders) {
    if (other.hypothesis == best.hypothesis || aliases.size() == 3) continue;
    const infer::PairedGain ahead = infer::paired_gain(best.model.held_out, other.model.held_out);
    if (ahead.sum < infer::kSureGain * ahead.se && other.gain > best.gain / 2) {
      aliases.push_back({hypotheses[other.hypothesis].name, 1});
    }
  }
  return aliases;
}

struct Found {
  infer::Model base;  // alone
  infer::Model model;
  std::vector<ChosenEffect> chosen;
  std::vector<Screened> rows;
};

std::string estimate_text(const DiagnosisRequest& of, const infer::Contender& c,
                          const std::string& effect) {
  const Overrides at = c.model.space.values(c.model.fit.u);
  std::string text;
  for (const auto& [row, value] : at) {
    const Parameter& p = of.table()[row];
    if (p.effect != effect) continue;
    text += (text.empty() ? "" : ", ") + p.key.substr(p.key.find('.') + 1) + " " +
            of.table().format(row, rounded_to_digits(value + of.frame_of(p.key, at), 4));
  }
  return text;
}

void add_rows(const DiagnosisRequest& of, const std::vector<infer::Hypothesis>& hypotheses,
              const infer::Contest& contest, std::vector<Screened>* rows) {
  for (const infer::Contender& contender : contest.contenders) {
    Screened row;
    row.effect = hypotheses[contender.hypothesis].name;
    row.gain = std::max(0.0, contender.gain);
    row.p = contender.gain_se > 0 ? normal_above(contender.gain / contender.gain_se) : 1;
    row.estimate = estimate_text(of, contender, row.effect);
    const auto same = [&](const Screened& r) { return r.effect == row.effect; };
    if (std::none_of(rows->begin(), rows->end(), same)) rows->push_back(std::move(row));
  }
}

// A model without one of the effects that it holds, fitted anew.
Result<infer::Model> refitted_without(const Competition& c, const infer::Model& model,
                                      std::size_t first, std::size_t count) {
  Eigen::VectorXd u = model.fit.u;
  infer::Space space = model.space.without(first, count, &u);
  const infer::Fitter fitter(c.forward, c.observations, space);
  auto fit = fitter.start(u);
  if (!fit) return fit.error();
  if (Status s = fitter.improve(&*fit, infer::kLongSearch); !s) return s.error();
  return infer::model_of(c.forward, c.observations, std::move(space), std::move(*fit));
}

// What later ones made worthless leaves again.
Status drop_idle(const DiagnosisRequest& of, const Competition& c, Found* found) {
  for (std::size_t k = 0; k + 1 < found->chosen.size();) {
    std::size_t first = c.base_coordinates;
    const auto count = [&](std::size_t i) {
      const std::string& name = found->chosen[i].candidate.signature.effect;
      return of.subject.effects->row(name).searched.size();
    };
    for (std::size_t i = 0; i < k; ++i) first += count(i);
    auto without = refitted_without(c, found->model, first, count(k));
    if (!without) return without.error();
    const infer::PairedGain gain = infer::paired_gain(found->model.held_out, without->held_out);
    const bool idle = gain.sum < of.subject.least_gain || gain.sum < infer::kSureGain * gain.se;
    if (!idle) {
      found->chosen[k].candidate.gain = gain.sum;
      ++k;
      continue;
    }
    found->model = std::move(*without);
    found->chosen.erase(found->chosen.begin() + static_cast<std::ptrdiff_t>(k));
  }
  return {};
}

Result<infer::Model> base_alone(const Study& study, const Competition& c) {
  const infer::Space space = base_space(study);
  const infer::Fitter fitter(c.forward, c.observations, space);
  auto fit = fitter.start(space.from(study.base));
  if (!fit) return fit.error();
  if (Status s = fitter.improve(&*fit, infer::kLongSearch); !s) return s.error();
  return infer::model_of(c.forward, c.observations, space, std::move(*fit));
}

// For who watches.
void report_contest(const DiagnosisRequest& of, const std::vector<infer::Standing>& standings) {
  if (!of.options.on_finding) return;
  Finding finding;
  finding.about = "the competition of hypotheses";
  finding.text = "Base and hypothesis are searched together.";
  finding.columns = {"hypothesis", "log score beyond the base alone, nats"};
  for (const infer::Standing& s : standings) {
    finding.rows.emplace_back(s.name, plain_number(std::round(s.gain)));
  }
  of.options.on_finding(std::move(finding));
}

// Forward selection: the best of every contest joins the model that the next one adds to.
// `configured`: the base before anything was tuned.
Result<Found> select(const DiagnosisRequest& of, const Study& study, const Overrides& configured,
                     const Competition& c) {
  auto base = base_alone(study, c);
  if (!base) return base.error();
  Found found{*base, *base, {}, {}};
  infer::Terms terms;
  terms.bases = {configured};
  std::vector<infer::Hypothesis> left = c.hypotheses;
  double explained = 0;
  while (found.chosen.size() < kMostEffects && !left.empty()) {
    auto contest = infer::compete(
        c.forward, c.observations, found.model, left, terms,
        [&](const std::vector<infer::Standing>& standings) { report_contest(of, standings); });
    if (!contest) return contest.error();
    if (found.chosen.empty()) found.base = contest->base;
    found.model = contest->base;
    add_rows(of, left, *contest, &found.rows);
    if (contest->contenders.empty() || !enters(of, contest->contenders.front(), explained)) break;
    infer::Contender& best = contest->contenders.front();
    explained += best.gain;
    Signature mark;
    mark.effect = left[best.hypothesis].name;
    const Eigen::Index own = best.model.fit.u.size() - found.model.fit.u.size();
    mark.columns = best.model.fit.slopes.rightCols(own);
    found.chosen.push_back({{best.gain, std::move(mark)}, aliases_of(left, *contest)});
    found.model = std::move(best.model);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best.hypothesis));
    if (Status s = drop_idle(of, c, &found); !s) return s.error();
    terms = {infer::Effort::kLocal, {}, std::max(of.subject.least_gain, kLeastShare * explained)};
  }
  return found;
}

}  // namespace

Result<Screening> compete(const DiagnosisRequest& of, const Evidence& measured) {
  const auto configured = of.subject.make_study(of.problem, of.options.genes);
  if (!configured) return configured.error();
  // By the noise that readings are configured to have: what the tuned base misses by must not pass
  // for noise.
  Study searched = measured.study;
  searched.trust.clear();
  searched.use_noise(configured->noise);
  const Competition c = competition(of, searched);
  auto found = select(of, searched, configured->base, c);
  if (!found) return found.error();
  // Everything from here on is about the point that explains the log.
  Study study = measured.study;
  study.base = found->model.space.values(found->model.fit.u);
  if (Status s = of.subject.tune(of.predictor, /*keep=*/true, &study); !s) return s.error();
  auto raw = evidence_of(of, std::move(study));
  if (!raw) return raw.error();
  auto evidence = measure(of, raw->study);
  if (!evidence) return evidence.error();
  Screening screening;
  screening.found.evidence = std::make_shared<const Evidence>(std::move(*evidence));
  screening.found.tuned_alone = found->base.space.values(found->base.fit.u);
  const infer::Fitter fitter(c.forward, c.observations, found->model.space);
  screening.found.searched_error =
      found->model.space.deviations(found->model.fit.u, fitter.covariance(found->model.fit));
  screening.rows = std::move(found->rows);
  screening.catalogue =
      std::make_unique<Selector>(of.predictor, screening.found.study(), std::vector<Signature>(),
                                 screening.found.evidence->base);
  screening.explained = 0;
  for (const ChosenEffect& e : found->chosen) *screening.explained += e.candidate.gain;
  screening.found.chosen = std::move(found->chosen);
  if (screening.found.chosen.empty()) return screening;
  const Explanation& named = screening.found;
  auto estimates =
      fit_jointly(of.predictor, named.study(), candidates_of(named.chosen), named.study().base,
                  BaseParameters::kFitted, named.evidence->nuisances, 1);
  if (!estimates) return estimates.error();
  screening.found.estimates = std::move(*estimates);
  return screening;
}

}  // namespace gapfarm::steps
