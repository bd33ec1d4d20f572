// What each effect of the catalogue would explain to first order, and where a search of it begins.
#pragma once

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

struct EffectCandidate {
  double gain = 0;  // net of the signature's penalty, nats
  Signature signature;
  std::vector<std::string> aliases = {};  // of a chosen one: at most three, likeliest first
  std::size_t alike = 0;                  // so many of these explain this log about as well

  const std::string& effect() const { return signature.effect; }
};

// What a signature gains beyond what is explained, less its penalty.
double net_gain(const Regression& explained, const Signature& s);

class Proposals {
 public:
  // REQUIRES: both outlive it.
  Proposals(Predictor& predictor, const Study& study, std::vector<Signature> catalogue,
            const Regression& nuisances)
      : predictor_(&predictor),
        study_(&study),
        catalogue_(std::move(catalogue)),
        base_(nuisances) {}

  // From now on beside these.  REQUIRES: the study outlives it.
  void move_beside(const Study& study, const Regression& nuisances) {
    study_ = &study;
    base_ = nuisances;
    if (patch_search_) look_for_patches();
  }

  // From now on candidates() looks for friction patches, too, and for a second one beside a first.
  void look_for_patches();

  // These are never offered, whatever the catalogue holds.
  void exclude(std::set<std::string> effects) { excluded_ = std::move(effects); }

  // The best signature of every effect, best first, beyond what `explained` holds.  Of what is in
  // `without` because it is among `beside`, a second one where there may be two.
  Result<std::vector<EffectCandidate>> candidates(
      const Regression& explained, const std::set<std::string>& without,
      const std::vector<EffectCandidate>& beside = {}) const;

  // The best signature of one effect, which may have been chosen once already: a second seam.
  Result<EffectCandidate> again(const Regression& explained, const std::string& effect) const;

  // Data that are as if the predictions of what was chosen were linear in its columns.
  void restart(const Eigen::VectorXd& data) { base_.restart(data); }
  const Regression& nothing_explained() const { return base_; }
  // The nuisances, what comes first and what was chosen, but for one of these.
  Regression with(const std::vector<Signature>& first, const std::vector<EffectCandidate>& chosen,
                  std::optional<std::size_t> but = std::nullopt) const;

 private:
  bool may_be_second(const std::string& second, const std::set<std::string>& without) const;
  std::string offered_as(const Signature& s, const std::set<std::string>& without,
                         const std::vector<EffectCandidate>& beside) const;
  std::optional<Patch> first_patch(const std::set<std::string>& without,
                                   const std::vector<EffectCandidate>& beside) const;
  // That may gain a part of the most that anything else does.
  Result<std::vector<Signature>> patches(const Regression& explained, double most_gain,
                                         const std::optional<Patch>& beside) const;
  void drop_linear_views(const Regression& explained,
                         std::map<std::string, EffectCandidate>* best) const;
  // Between the lines that were tried.
  EffectCandidate refine_seam(const Regression& explained,
                              const std::vector<EffectCandidate>& lines,
                              EffectCandidate best) const;

  Predictor* predictor_;
  const Study* study_;
  std::vector<Signature> catalogue_;
  Regression base_;
  std::set<std::string> excluded_;
  PatchSearch patch_search_;  // empty: none
};

// The gain below which an effect is not named, where so much is explained.
double least_gain_of(const std::string& effect, const Study& study, double explained);

}  // namespace gapfarm
