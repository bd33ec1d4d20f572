#include "common/score/bounded_step.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/score/algebra.h"

namespace gapfarm {

Eigen::VectorXd step_within(const Eigen::MatrixXd& H, const Eigen::VectorXd& g,
                            const Eigen::VectorXd& at, const Eigen::VectorXd& lower,
                            const Eigen::VectorXd& upper) {
  std::vector<Eigen::Index> moving, bound;
  for (Eigen::Index k = 0; k < at.size(); ++k) moving.push_back(k);
  Eigen::VectorXd to = at;
  // Each round puts one value more on a bound, or is the last.
  while (!moving.empty()) {
    Eigen::VectorXd left = g(moving);
    for (const Eigen::Index k : bound) left += H(moving, k) * (to[k] - at[k]);
    const Eigen::VectorXd move = solve_symmetric(H(moving, moving), left);
    std::vector<Eigen::Index> inside;
    for (std::size_t a = 0; a < moving.size(); ++a) {
      const Eigen::Index k = moving[a];
      const double wanted = at[k] - move[static_cast<Eigen::Index>(a)];
      to[k] = std::clamp(wanted, lower[k], upper[k]);
      (to[k] == wanted ? inside : bound).push_back(k);
    }
    if (inside.size() == moving.size()) break;
    moving = std::move(inside);
  }
  return to;
}

}  // namespace gapfarm
