// CMA-ES: the covariance matrix adaptation evolution strategy with active rank-one and rank-mu
// updates and cumulative step-size adaptation (Hansen, arXiv:1604.00772, with its default
// constants), its draws orthogonal (Wang, Emmerich and Baeck, Evolutionary Computation 27, 2019),
// restarted with twice the population when it has converged (IPOP; Auger and Hansen, CEC 2005), or
// by turns with that and with small populations and steps, so that both are given as many
// evaluations (BIPOP; Hansen, GECCO 2009; the random numbers in [0, 1] that choose these are those
// of the golden ratio's multiples).
//
// What is drawn beyond [0, 1] is scored where mirrors put it (see placed()).  While steps are wide
// it is also learned from there: else the method sees a function that repeats beyond each mirror,
// and most draws fall there.  Narrow ones are learned from as drawn: at a minimum on a bound all
// mirrored steps point inward, and the step size would run away.  The s.d. of a gene with levels
// never falls below a fifth of a level, so that it does not freeze between two.
//
// Islands share what they learn of the covariance: to the own steps come those of the others'
// generations, each seen from its own centre and in its own unit, so that it matters little how old
// they are.  Mean and step size follow the own generation alone.
#pragma once

#include <Eigen/Core>

#include "master/evolve/methods/search_method.h"

namespace gapfarm {

class CmaEs final : public SearchMethod {
 public:
  explicit CmaEs(const MethodSetup& setup);

  static unsigned default_population(std::size_t genes);

  std::vector<Genome> propose(const StreamOf& stream_of) const override;
  void learn(std::span<const Genome> proposed, std::span<const Standing> standings) override;
  void meet(std::span<const std::vector<Individual>> others) override {
    others_.assign(others.begin(), others.end());
  }
  Genome taken(const Genome& migrant) const override;
  unsigned origin() const override { return kSampled; }
  std::vector<NamedNumber> figures() const override;
  void save(v1::MethodState& message) const override;
  Status restore(const v1::MethodState& message) override;

 private:
  struct Weights {
    Eigen::VectorXd of_rank;  // the better half's positive, with sum 1; the others' negative
    double mu_eff = 0, c_sigma = 0, d_sigma = 0, c_c = 0, c_1 = 0, c_mu = 0, chi_n = 0;
  };
  Weights weights(Eigen::Index points) const;
  std::size_t population() const;
  void begin(Eigen::VectorXd mean);
  void begin_again();
  Eigen::MatrixXd with_others(const Eigen::MatrixXd& steps) const;
  void adapt(const Eigen::MatrixXd& steps, const Eigen::MatrixXd& all);
  void keep_levels_alive();
  bool converged() const;

  MethodSetup setup_;
  std::uint64_t generation_ = 0;  // since the last restart
  std::uint64_t restarts_ = 0;    // with a larger population
  bool anywhere_ = false;         // the next generation begins at a random mean
  double sigma_ = 0;
  Eigen::VectorXd mean_, path_sigma_, path_c_;
  Eigen::MatrixXd covariance_;
  std::vector<std::vector<Individual>> others_;
  std::vector<double> bests_;  // least costs of the last generations
  // Of BIPOP: this start's, and what was spent on the two kinds before.
  std::size_t small_population_ = 0;  // 0: a growing one
  double first_sigma_ = 0;            // 0: as set
  std::uint64_t evaluations_ = 0;
  std::uint64_t large_evaluations_ = 0, small_evaluations_ = 0, small_starts_ = 0;
};

}  // namespace gapfarm
