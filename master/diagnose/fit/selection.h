// Which effects the residuals call for: forward selection over the catalogue's signatures.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/fit/regression.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/places/patch.h"

namespace gapfarm {

// A further effect must also gain this share of what the others did: small systematic errors of
// a strong effect's model look like weaker effects.
inline constexpr double kLeastShare = 0.02;
inline constexpr double kLeastSecondOfAKind = 20;  // nats
inline constexpr double kAliasCosine = 0.9;
inline constexpr std::size_t kMostEffects = 4;

// Of a place, that it is worth to be searched for: nats before the penalty, and of the best, since
// no search makes up for less.
inline constexpr double kWorthRefining = 8;
inline constexpr double kWorthRefiningShare = 0.3;

struct EffectCandidate {
  double gain = 0;  // net of the signature's penalty, nats
  Signature signature;
};

// What a signature gains beyond what is explained, less its penalty.
double net_gain(const Regression& explained, const Signature& s);

// What the catalogue offered at one step: effect and net gain, best first.
struct SelectionStep {
  std::vector<std::string> explained;  // effects named so far
  std::vector<std::pair<std::string, double>> offered;
};

// The chosen effects at their joint estimate, where large ones are no longer linear: data as if
// their predictions were, and each one's contribution with its slopes.
struct Relinearised {
  Eigen::VectorXd data;                  // whitened
  std::vector<Eigen::MatrixXd> columns;  // one matrix an effect
};
using Relinearise = std::function<Result<Relinearised>(const std::vector<EffectCandidate>&)>;

struct Alias {
  std::string effect;
  double cosine = 0;  // of the two explained parts
};

struct ChosenEffect {
  EffectCandidate candidate;
  std::vector<Alias> aliases;  // at most three, likeliest first
};

class Selector {
 public:
  // REQUIRES: both outlive it, `study` until the next recount().
  Selector(Predictor& predictor, const Study& study, std::vector<Signature> catalogue,
           const Regression& nuisances)
      : predictor_(&predictor),
        study_(&study),
        catalogue_(std::move(catalogue)),
        base_(nuisances) {}

  // From now on candidates() looks for friction patches, too, and for a second one beside a first.
  void look_for_patches();

  // These are never offered, whatever the catalogue holds.
  void exclude(std::set<std::string> effects) { excluded_ = std::move(effects); }

  // The best signature of every effect, best first, beyond what `explained` holds.  Of what is in
  // `without` because it is among `beside`, a second one where there may be two.
  Result<std::vector<EffectCandidate>> candidates(const Regression& explained,
                                                  const std::set<std::string>& without,
                                                  const std::vector<EffectCandidate>& beside = {});

  // The best signature of one effect, which may have been chosen once already: a second seam.
  Result<EffectCandidate> again(const Regression& explained, const std::string& effect);

  // `first` are explained before anything else (a late camera, say) and gained `first_gain` nats.
  // `relinearise` fits what was chosen so far; no more than `most` are chosen.
  Result<std::vector<ChosenEffect>> select(const std::vector<Signature>& first, double first_gain,
                                           const Relinearise& relinearise,
                                           std::size_t most = kMostEffects);

  // From now on, only trials that this study of the same does not ignore count; `nuisances` without
  // them.
  void recount(const Study& study, const Regression& nuisances);

  // Only the nuisances are explained.
  const Regression& nothing_explained() const { return base_; }
  // Of the last select().
  const std::vector<SelectionStep>& steps() const { return steps_; }

  // The nuisances and these signatures.
  Regression with(const std::vector<const Signature*>& signatures) const;

 private:
  bool may_be_second(const std::string& second, const std::set<std::string>& without) const;
  std::string offered_as(const Signature& s, const std::set<std::string>& without,
                         const std::vector<EffectCandidate>& beside) const;
  std::optional<Patch> first_patch(const std::set<std::string>& without,
                                   const std::vector<EffectCandidate>& beside) const;
  Status search_patches(const Regression& explained, double most_gain,
                        const std::optional<Patch>& beside);
  void drop_linear_views(const Regression& explained,
                         std::map<std::string, EffectCandidate>* best) const;
  EffectCandidate refine_seam(const Regression& explained, EffectCandidate best) const;
  Regression without(const std::vector<Signature>& first,
                     const std::vector<EffectCandidate>& chosen, std::size_t exclude) const;
  double alias_cosine(const std::vector<Signature>& first,
                      const std::vector<EffectCandidate>& chosen, std::size_t i,
                      const EffectCandidate& other) const;
  bool is_new(const std::vector<Signature>& first, const std::vector<EffectCandidate>& chosen,
              const EffectCandidate& candidate) const;
  Status replace_each(const std::vector<Signature>& first, const std::set<std::string>& rejected,
                      std::vector<EffectCandidate>* chosen);
  Status use_estimates(const std::vector<Signature>& first, const Relinearise& relinearise,
                       std::vector<EffectCandidate>* chosen);
  void drop_weak(std::vector<EffectCandidate>* chosen) const;
  Result<std::vector<Alias>> aliases_of(const std::vector<Signature>& first,
                                        const std::vector<EffectCandidate>& chosen, std::size_t i);

  Predictor* predictor_;
  const Study* study_;
  std::vector<Signature> catalogue_;
  Regression base_;
  std::set<std::string> excluded_;
  PatchSearch patch_search_;  // empty: none
  std::vector<SelectionStep> steps_;
  double first_gain_ = 0;
  int patch_searches_ = 0, second_patch_searches_ = 0;
  int relinearised_ = 0;
  std::vector<Patch> refined_patches_;
};

}  // namespace gapfarm
