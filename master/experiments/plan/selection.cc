#include "master/experiments/plan/selection.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "master/infer/certificate.h"

namespace gapfarm::plan {
namespace {

// log det(I + X'X) as rows are added to X.
class LogDeterminant {
 public:
  explicit LogDeterminant(Eigen::Index unknowns)
      : inverse_(Eigen::MatrixXd::Identity(unknowns, unknowns)) {}

  // What `rows` would add: log det(I + R M^-1 R').
  double gain(const Eigen::Ref<const Rows>& rows) const {
    const Eigen::LLT<Eigen::MatrixXd> lower(inner(rows));
    return 2 * lower.matrixLLT().diagonal().array().log().sum();
  }

  void add(const Eigen::Ref<const Rows>& rows) {
    const Eigen::MatrixXd right = rows * inverse_;
    inverse_ -= right.transpose() * inner(rows).llt().solve(right);
  }

 private:
  Eigen::MatrixXd inner(const Eigen::Ref<const Rows>& rows) const {
    return Eigen::MatrixXd::Identity(rows.rows(), rows.rows()) + rows * inverse_ * rows.transpose();
  }

  Eigen::MatrixXd inverse_;  // of I + X'X
};

}  // namespace

std::vector<std::size_t> select(const std::vector<Rows>& candidates, Eigen::Index nuisances,
                                std::size_t wanted) {
  std::vector<std::size_t> chosen;
  if (candidates.empty()) return chosen;
  LogDeterminant all(candidates.front().cols()), allowed(nuisances);
  std::vector<bool> taken(candidates.size());
  while (chosen.size() < std::min(wanted, candidates.size())) {
    std::size_t best = candidates.size();
    double most = 0;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      if (taken[c]) continue;
      const double gain =
          all.gain(candidates[c]) - allowed.gain(candidates[c].rightCols(nuisances));
      if (best < candidates.size() && gain <= most) continue;
      best = c;
      most = gain;
    }
    taken[best] = true;
    chosen.push_back(best);
    all.add(candidates[best]);
    allowed.add(candidates[best].rightCols(nuisances));
  }
  return chosen;
}

double information(const Eigen::VectorXd& shift, const Eigen::MatrixXd& nuisances) {
  return std::max(0.0, infer::information(shift, nuisances)(0, 0));
}

double likeness(const Eigen::VectorXd& a, const Eigen::VectorXd& b,
                const Eigen::MatrixXd& nuisances) {
  const double lengths = information(a, nuisances) * information(b, nuisances);
  return lengths > 0
             ? std::clamp(a.dot(infer::beyond(b, nuisances).col(0)) / std::sqrt(lengths), -1.0, 1.0)
             : 0;
}

}  // namespace gapfarm::plan
