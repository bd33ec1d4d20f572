// Which effects the residuals call for: forward selection over the catalogue's signatures.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/regression.h"
#include "master/diagnose/signatures.h"

namespace gapfarm {

// Net log-likelihood (nats over all trials) that an effect must gain to be named.  The best of the
// catalogue gained 4.4 at most in 90 of 100 null logs, 6.7 in 99 (400 logs; docs/diagnosis.md).
inline constexpr double kLeastGain = 7.5;
// A further effect must also gain this share of what the others did: small systematic errors of
// a strong effect's model look like weaker effects.
inline constexpr double kLeastShare = 0.02;
inline constexpr double kAliasCosine = 0.9;
inline constexpr std::size_t kMostEffects = 4;

struct Candidate {
  double gain = 0;  // net of the signature's penalty, nats
  Signature signature;
};

struct Alias {
  std::string effect;
  double cosine = 0;  // of the two explained parts
};

struct ChosenEffect {
  Candidate candidate;
  std::vector<Alias> aliases;  // at most three, likeliest first
};

class Selector {
 public:
  Selector(Predictor& predictor, const Study& study, std::vector<Signature> catalogue,
           const Regression& nuisances)
      : predictor_(predictor), study_(study), catalogue_(std::move(catalogue)), base_(nuisances) {}

  // Adds the coarse grid of friction patches.  Error: the farm's.
  Status add_patches();

  // The best signature of every effect, best first, beyond what `explained` holds.
  Result<std::vector<Candidate>> candidates(const Regression& explained,
                                            const std::set<std::string>& without);

  // `first` are explained before anything else (a late camera, say).
  Result<std::vector<ChosenEffect>> select(const std::vector<Signature>& first);

  // The nuisances and these signatures.
  Regression with(const std::vector<const Signature*>& signatures) const;

 private:
  Result<Candidate> refine_patch(const Regression& explained, Candidate best);
  Candidate refine_seam(const Regression& explained, Candidate best) const;
  Regression without(const std::vector<Signature>& first, const std::vector<Candidate>& chosen,
                     std::size_t leave_out) const;
  double alias_cosine(const std::vector<Signature>& first, const std::vector<Candidate>& chosen,
                      std::size_t i, const Candidate& other) const;
  bool is_new(const std::vector<Signature>& first, const std::vector<Candidate>& chosen,
              const Candidate& candidate) const;
  Status replace_each(const std::vector<Signature>& first, std::vector<Candidate>* chosen);
  Result<std::vector<Alias>> aliases_of(const std::vector<Signature>& first,
                                        const std::vector<Candidate>& chosen, std::size_t i);

  Predictor& predictor_;
  const Study& study_;
  std::vector<Signature> catalogue_;
  Regression base_;
};

}  // namespace gapfarm
