// A study as the competition of hypotheses sees it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "master/diagnose/steps/step_parts.h"
#include "master/infer/compete.h"

namespace gapfarm::steps {

class Competition {
 public:
  // `base`: held where it was tuned, beside the nuisances to first order, or searched with the
  // hypotheses.  REQUIRES: all outlive it.
  Competition(const DiagnosisRequest& of, const Study& study, const Evidence& evidence,
              const std::vector<Signature>& first, BaseParameters base);
  Competition& operator=(Competition&&) = delete;

  const infer::Forward& forward() const { return forward_; }
  const infer::Observations& observations() const { return observations_; }
  const infer::Space& base() const { return base_; }
  std::vector<infer::Coordinate> coordinates_of(const std::string& effect) const;

  // Every effect of the catalogue that is searched whatever slopes say, but for these.
  std::vector<infer::Hypothesis> of_rows(const std::set<std::string>& without) const;
  // From where a first-order fit has its parameters, and where a search before had them.
  infer::Hypothesis of_mark(const EffectCandidate& mark, const Regression& explained,
                            const std::vector<EffectCandidate>& found_before) const;
  std::map<std::string, double> values_of(const std::string& effect,
                                          const infer::Model& model) const;
  // Whitened rows, as if nothing were explained but by the model's parameters; 0 of ignored trials.
  Eigen::VectorXd unexplained(const infer::Model& model) const;

 private:
  std::vector<std::uint32_t> touched_by(const std::string& effect, const Overrides& at) const;

  const DiagnosisRequest& of_;
  const Study& study_;
  infer::Forward forward_;
  infer::Observations observations_;
  infer::Space base_;
};

// Of what was offered beside what is explained, by its marks: of what has a place, there.
DetectableSizes detectable_by_marks(const DiagnosisRequest& of, const Study& study,
                                    const infer::Model& model, const Regression& explained,
                                    const std::vector<EffectCandidate>& offered,
                                    double explained_nats);
// Of what is searched, by slopes at a model; nothing of what has a place.
Result<DetectableSizes> detectable_by_slopes(const DiagnosisRequest& of, const Study& study,
                                             const Competition& competition,
                                             const infer::Model& model,
                                             const std::set<std::string>& without,
                                             double explained_nats);
// Of what was chosen, by the model's slopes; nothing of what has a place.
void add_detectable_of_chosen(const DiagnosisRequest& of, const Study& study,
                              const Competition& competition, const infer::Model& model,
                              const std::vector<EffectCandidate>& chosen, DetectableSizes* all);

}  // namespace gapfarm::steps
