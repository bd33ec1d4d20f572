// Which hypotheses the log calls for: forward selection by held-out score, each contest's best
// fitted together with all that was chosen before.

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/base/ranges.h"
#include "common/math/laws.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/steps/competition.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/diagnose/steps/watch.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

struct Found {
  infer::Model base;  // alone
  infer::Model model;
  std::vector<EffectCandidate> chosen;
  std::vector<Screened> rows;
  std::vector<SelectionRecord> steps;
  std::vector<NearMiss> refused;
  DetectableSizes detectable;
};

// Hypotheses that predict as well as the best, as far as anybody can show, and what acts alike.
void set_aliases(const DiagnosisRequest& of, const std::vector<infer::Hypothesis>& hypotheses,
                 const infer::Contest& contest, EffectCandidate* chosen) {
  const std::string& effect = chosen->effect();
  const infer::Contender& best = contest.contenders.front();
  std::vector<std::string> aliases;
  for (const infer::Contender& other : contest.contenders) {
    const std::string& name = hypotheses[other.hypothesis].name;
    if (name == effect) continue;
    const infer::PairedGain ahead =
        infer::gain_over(best.model, other.model, contest.base.fit.u.size());
    if (ahead.sum < kSureGain * ahead.se && other.gain > best.gain / 2) {
      aliases.push_back(name);
    }
  }
  const std::size_t alike = aliases.size();
  for (const char* constant : of.subject.effects->row(effect).aliases) {
    if (!contains(aliases, constant)) {
      aliases.emplace_back(constant);
    }
  }
  if (aliases.size() > kMostAliases) aliases.resize(kMostAliases);
  chosen->alike = std::min(alike, aliases.size());
  chosen->aliases = std::move(aliases);
}

std::string estimate_text(const DiagnosisRequest& of, const infer::Contender& c,
                          const std::string& effect) {
  const Overrides at = c.model.space.values(c.model.fit.u);
  std::string text;
  for (const auto& [row, value] : at) {
    if (of.table()[row].effect != effect) continue;
    text += (text.empty() ? "" : ", ") + value_text(of, row, value, at);
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
    if (!contains(*rows, row.effect, &Screened::effect)) rows->push_back(std::move(row));
  }
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
class Selection {
 public:
  // `marks`: null where every hypothesis is searched from afar.  `configured`: the base before
  // anything was tuned.
  Selection(const DiagnosisRequest& of, const Study& study, const Competition& competition,
            const Proposals* marks, const Explanation& before, const Overrides& configured)
      : of_(of), study_(study), competition_(competition), marks_(marks), before_(before) {
    for (const Signature& s : before.first) not_these_.insert(s.effect);
    if (marks != nullptr) terms_.effort = infer::Effort::kLocal;
    if (of.subject.base_moves) terms_.bases = {configured};
  }

  Result<Found> run() {
    ASSIGN_OR_RETURN(auto base, fitted(competition_.base(), competition_.base().from(study_.base)));
    found_.emplace(Found{base, base, {}, {}, {}, {}, {}});
    while (found_->chosen.size() < kMostNames) {
      ASSIGN_OR_RETURN(const auto more, add_best());
      if (!more) break;
    }
    if (Status s = measure_reach(); !s) return s.error();
    std::ranges::stable_sort(found_->chosen, std::ranges::greater{}, &EffectCandidate::gain);
    return std::move(*found_);
  }

 private:
  Result<infer::Model> fitted(infer::Space space, const Eigen::VectorXd& from) const {
    const infer::Fitter fitter(competition_.forward(), competition_.observations(), space);
    ASSIGN_OR_RETURN(auto fit, fitter.start(from));
    if (!std::isfinite(fit.score)) return of_.predictor.failed("the model to begin at");
    if (Status s = fitter.improve(&fit, kLongSearch); !s) return s.error();
    return infer::model_of(competition_.forward(), competition_.observations(), std::move(space),
                           std::move(fit));
  }

  // What the last contest was offered would have been named from some size on, as what was chosen.
  Status measure_reach() {
    std::set<std::string> without;
    for (const EffectCandidate& c : found_->chosen) without.insert(c.effect());
    if (marks_ == nullptr) {
      ASSIGN_OR_RETURN(
          found_->detectable,
          detectable_by_slopes(of_, study_, competition_, found_->model, without, explained()));
    }
    add_detectable_of_chosen(of_, study_, competition_, found_->model, found_->chosen,
                             &found_->detectable);
    return {};
  }

  double explained() const { return sum_of_gains(found_->chosen); }

  std::size_t size_of(std::size_t chosen) const {
    return competition_.coordinates_of(found_->chosen[chosen].effect()).size();
  }

  // What slopes promise beyond the present model.
  Result<std::vector<infer::Hypothesis>> proposed() {
    const std::vector<EffectCandidate>& chosen = found_->chosen;
    std::set<std::string> without = not_these_;
    for (const EffectCandidate& c : chosen) without.insert(c.effect());
    if (marks_ == nullptr) return competition_.of_rows(without);
    Regression explained = marks_->nothing_explained();
    explained.restart(competition_.unexplained(found_->model));
    for (const Signature& s : before_.first) explained.add(s.columns);
    for (const EffectCandidate& c : chosen) explained.add(c.signature.columns);
    ASSIGN_OR_RETURN(auto marks, marks_->candidates(explained, without, chosen));
    found_->detectable =
        detectable_by_marks(of_, study_, found_->model, explained, marks, this->explained());
    std::vector<infer::Hypothesis> hypotheses;
    double best = 0;
    for (const EffectCandidate& mark : marks) {
      if (mark.gain < kWorthSearchingShare * best) break;
      // A search may do better than slopes say, but not by more than they are trusted for.
      const double most = kMostTrust * mark.gain;
      if (most < least_gain_of(mark.effect(), study_, this->explained())) continue;
      if (not_these_.count(mark.effect())) continue;
      best = std::max(best, mark.gain);
      hypotheses.push_back(competition_.of_mark(mark, explained, before_.chosen));
    }
    std::stable_sort(hypotheses.begin(), hypotheses.end(), [&](const auto& a, const auto& b) {
      return of_.subject.effects->place_in_catalogue(a.name) <
             of_.subject.effects->place_in_catalogue(b.name);
    });
    return hypotheses;
  }

  // What hardly gains more than a part of it alone would name too much.
  void drop_wholes(const std::vector<infer::Hypothesis>& hypotheses,
                   std::vector<infer::Contender>* contenders) const {
    std::map<std::string, double> gains;
    for (const infer::Contender& c : *contenders) gains[hypotheses[c.hypothesis].name] = c.gain;
    std::erase_if(*contenders, [&](const infer::Contender& c) {
      const char* part = of_.subject.effects->row(hypotheses[c.hypothesis].name).part;
      return part != nullptr && gains.count(part) > 0 &&
             c.gain - gains[part] < of_.subject.least_gain;
    });
  }

  bool enters(const infer::Contender& best, const std::string& name) const {
    return best.gain >= least_gain_of(name, study_, explained()) &&
           best.gain >= kLeastSure * best.gain_se;
  }

  // Slopes of the chosen effects at the present model.
  void use_slopes() {
    Eigen::Index at = competition_.base().dimensions();
    for (std::size_t k = 0; k < found_->chosen.size(); ++k) {
      Signature& mark = found_->chosen[k].signature;
      const Eigen::Index own =
          competition_.base().only(competition_.coordinates_of(mark.effect)).dimensions();
      mark.columns = found_->model.fit.slopes.middleCols(at, own);
      study_.drop_ignored(mark.columns);
      mark.fixed = competition_.values_of(mark.effect, found_->model);
      mark.whole = true;
      at += own;
    }
  }

  Status drop_idle() {
    std::size_t first = competition_.base().coordinates();
    for (std::size_t k = 0; k + 1 < found_->chosen.size();) {
      Eigen::VectorXd u = found_->model.fit.u;
      infer::Space space = found_->model.space.without(first, size_of(k), &u);
      ASSIGN_OR_RETURN(auto without, fitted(std::move(space), u));
      const infer::PairedGain gain =
          infer::gain_over(found_->model, without, competition_.base().dimensions());
      if (gain.sum >= of_.subject.least_gain && gain.sum >= kLeastSure * gain.se) {
        found_->chosen[k].gain = gain.sum;
        first += size_of(k++);
        continue;
      }
      not_these_.insert(found_->chosen[k].effect());
      found_->model = std::move(without);
      found_->chosen.erase(found_->chosen.begin() + static_cast<std::ptrdiff_t>(k));
    }
    return {};
  }

  // One contest; false: nothing more enters.
  Result<bool> add_best() {
    ASSIGN_OR_RETURN(const auto hypotheses, proposed());
    if (hypotheses.empty()) return false;
    auto contest = infer::compete(
        competition_.forward(), competition_.observations(), found_->model, hypotheses, terms_,
        [&](const std::vector<infer::Standing>& standings) { report_contest(of_, standings); });
    if (!contest) return contest.error();
    if (found_->chosen.empty()) found_->base = contest->base;
    found_->model = contest->base;
    add_rows(of_, hypotheses, *contest, &found_->rows);
    SelectionRecord& step = found_->steps.emplace_back();
    step.explained = mapped(found_->chosen, &EffectCandidate::effect);
    for (const infer::Contender& c : contest->contenders) {
      step.offered.emplace_back(hypotheses[c.hypothesis].name, c.gain);
    }
    if (contest->contenders.empty()) return false;
    drop_wholes(hypotheses, &contest->contenders);
    infer::Contender& best = contest->contenders.front();
    const std::string name = hypotheses[best.hypothesis].name;
    if (!enters(best, name)) return false;
    if (auto why = at_its_bound(of_, name, best.model.space.values(best.model.fit.u))) {
      found_->refused.push_back({{name}, best.gain, 0, "", std::move(*why)});
      not_these_.insert(name);
      return true;
    }
    EffectCandidate chosen;
    chosen.gain = best.gain;
    chosen.signature.effect = name;
    set_aliases(of_, hypotheses, *contest, &chosen);
    found_->chosen.push_back(std::move(chosen));
    found_->model = std::move(best.model);
    if (Status s = drop_idle(); !s) return s.error();
    use_slopes();
    terms_ = {
        infer::Effort::kLocal, {}, std::max(of_.subject.least_gain, kLeastShare * explained())};
    return true;
  }

  const DiagnosisRequest& of_;
  const Study& study_;
  const Competition& competition_;
  const Proposals* marks_;
  const Explanation& before_;
  std::set<std::string> not_these_;  // explained before anything else, or dropped
  infer::Terms terms_;
  std::optional<Found> found_;
};

// What is chosen, fitted together from there, base and nuisances beside it to first order.
Result<JointFit> estimate(const DiagnosisRequest& of, const Explanation& named,
                          const Overrides& start) {
  const BaseParameters base = named.frees_base ? BaseParameters::kFitted : BaseParameters::kHeld;
  const Study& study = named.study();
  const Eigen::MatrixXd& nuisances = named.evidence->nuisances;
  const auto fit_from = [&](const Overrides& at) {
    return fit_jointly(of.predictor, study, named.chosen, at, base, nuisances, kLongSearch);
  };
  auto fit = fit_from(start);
  if (!fit) return fit;
  ASSIGN_OR_RETURN(const auto moved, move_seams(of.predictor, study, nuisances, &*fit));
  return moved ? fit_from(fit->at) : std::move(fit);
}

// The chosen effects beside the base as it was tuned: data as if their predictions were linear.
// What retuning that base would do depends on what was chosen, and is measured beside it: on a
// slope friction shows, on a flat floor hardly.
Status relinearise(const DiagnosisRequest& of, const infer::Model& model, Screening* screening) {
  Explanation& named = screening->found;
  const Overrides start = model.space.values(model.fit.u);
  ASSIGN_OR_RETURN(auto evidence, evidence_at(of, *named.evidence, start));
  if (evidence) {
    auto there = std::make_shared<const Evidence>(std::move(*evidence));
    screening->catalogue->move_beside(there->study, there->base);
    named.evidence = std::move(there);
  }
  ASSIGN_OR_RETURN(auto fit, estimate(of, named, start));
  ASSIGN_OR_RETURN(const auto there, relinearised_at(of, named.study(), fit, named.chosen));
  named.estimates = std::move(fit);
  emit_fit(of, *named.estimates);
  if (there.columns.empty()) return {};
  screening->catalogue->restart(there.data);
  for (std::size_t k = 0; k < named.chosen.size(); ++k) {
    named.chosen[k].signature.columns = there.columns[k];
  }
  return {};
}

// Everything from here on is about the point that explains the log.
Status move_to(const DiagnosisRequest& of, const Found& found, const Study& from,
               Screening* screening) {
  Explanation& named = screening->found;
  Study study = from;
  named.tuned_alone = found.base.space.values(found.base.fit.u);
  study.base = found.model.space.values(found.model.fit.u);
  if (Status s = of.subject.tune(of.predictor, /*keep=*/true, &study); !s) return s;
  ASSIGN_OR_RETURN(auto raw, evidence_of(of, std::move(study)));
  ASSIGN_OR_RETURN(auto evidence, measure(of, raw.study));
  named.evidence = std::make_shared<const Evidence>(std::move(evidence));
  screening->catalogue = std::make_unique<Proposals>(
      of.predictor, named.study(), std::vector<Signature>(), named.evidence->base);
  screening->explained = sum_of_gains(named.chosen);
  if (named.chosen.empty()) return {};
  ASSIGN_OR_RETURN(named.estimates,
                   fit_jointly(of.predictor, named.study(), named.chosen, named.study().base,
                               BaseParameters::kFitted, named.evidence->nuisances, kLongSearch));
  emit_fit(of, *named.estimates);
  return {};
}

// Evidence beside which the base's parameters are searched: to first order these would undo what
// they do in simulations, and lead anywhere.
Result<Evidence> evidence_for_search(const DiagnosisRequest& of, Study study) {
  const auto searched = [&](std::size_t row) {
    return contains(study.base_parameters, row, &BaseParameter::row);
  };
  std::erase_if(study.drive.retuned, [&](const RetunedParameter& p) { return searched(p.row); });
  if (study.drive.speed && searched(*study.drive.speed)) study.drive.alike = false;
  return evidence_of(of, std::move(study));
}

}  // namespace

Result<Screening> compete(const DiagnosisRequest& of, Explanation found) {
  const Evidence& evidence = *found.evidence;
  ASSIGN_OR_RETURN(const auto configured, of.subject.make_study(of.problem, of.options.genes));
  Study study = evidence.study;
  if (of.subject.base_moves) {
    // By the noise that readings are configured to have: what the tuned base misses by must not
    // pass for noise.
    study.trust.clear();
    study.use_noise(configured.noise);
  }
  const bool moves = of.subject.base_moves || (found.frees_base && found.tuned_alone.empty());
  if (moves && !base_on_bounds(study, study.base).empty()) {
    // From its bounds a base hardly comes back.
    for (auto& [row, value] : study.base) value = of.problem.values[row];
  }
  std::optional<Evidence> beside;
  if (moves && !of.subject.base_moves) {
    ASSIGN_OR_RETURN(beside, evidence_for_search(of, study));
  }
  const Competition competition(of, study, beside ? *beside : evidence, found.first,
                                moves ? BaseParameters::kFitted : BaseParameters::kHeld);
  Screening screening;
  if (of.subject.signatures != nullptr) {
    ASSIGN_OR_RETURN(auto marks, marks_of(of, found));
    screening.catalogue = std::move(marks);
    if (Status s = screen_alone(of, found, &screening); !s) return s.error();
  }
  Selection selection(of, study, competition, screening.catalogue.get(), found, configured.base);
  ASSIGN_OR_RETURN(auto selected, selection.run());
  if (screening.catalogue == nullptr) screening.rows = std::move(selected.rows);
  screening.steps = std::move(selected.steps);
  screening.refused = std::move(selected.refused);
  screening.detectable = std::move(selected.detectable);
  found.chosen = std::move(selected.chosen);
  found.estimates.reset();
  const std::shared_ptr<const Evidence> before = found.evidence;
  screening.found = std::move(found);
  if (moves) {
    RETURN_IF_ERROR(move_to(of, selected, before->study, &screening));
  } else if (!screening.found.chosen.empty()) {
    if (Status s = relinearise(of, selected.model, &screening); !s) return s.error();
  }
  return screening;
}

}  // namespace gapfarm::steps
