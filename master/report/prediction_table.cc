#include "master/report/prediction_table.h"

#include <spdlog/fmt/fmt.h>

#include <cassert>
#include <cmath>

#include "common/base/ranges.h"
#include "common/problem/problem.h"
#include "common/score/fitness.h"
#include "common/trials/text/csv.h"

namespace gapfarm {
Eigen::Matrix3d local_covariance(const v1::Predicted& p) {
  assert(p.cov_size() == 6);
  Eigen::Matrix3d cov;
  cov << p.cov(0), p.cov(1), p.cov(2),  //
      p.cov(1), p.cov(3), p.cov(4),     //
      p.cov(2), p.cov(4), p.cov(5);
  return cov;
}

std::vector<PredictedTrial> world_predictions(const v1::PredictResult& result) {
  return mapped(result.predictions(), [](const v1::Predicted& p) {
    return PredictedTrial{from_proto(p.end()),
                          rotate_covariance(local_covariance(p), p.end().theta()), p.log_score()};
  });
}

std::string format_predictions(const TrialLog& log, std::span<const PredictedTrial> predictions) {
  assert(log.trials.size() == predictions.size());
  std::string text =
      "session,trial,x,y,theta,cov_xx,cov_xy,cov_xt,cov_yy,cov_yt,cov_tt,log_score\n";
  for (std::size_t i = 0; i < predictions.size(); ++i) {
    const PredictedTrial& p = predictions[i];
    const Eigen::Matrix3d& c = p.covariance;
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", csv_field(log.trials[i].session),
                        log.trials[i].trial, p.X_WE.x, p.X_WE.y, p.X_WE.theta, c(0, 0), c(0, 1),
                        c(0, 2), c(1, 1), c(1, 2), c(2, 2), p.log_score);
  }
  return text;
}

std::string summarise_predictions(const TrialLog& log,
                                  std::span<const PredictedTrial> predictions) {
  double score = 0, position = 0, heading = 0;
  const auto n = static_cast<double>(predictions.size());
  for (std::size_t i = 0; i < predictions.size(); ++i) {
    const Eigen::Vector3d r = local_difference(predictions[i].X_WE, log.trials[i].X_WE);
    score += predictions[i].log_score / n;
    position += r.head<2>().squaredNorm() / n;
    heading += r[2] * r[2] / n;
  }
  return fmt::format("{} trials: {:.4f} nats a trial, {:.2f} mm and {:.2f} mrad root mean square",
                     predictions.size(), score, 1e3 * std::sqrt(position),
                     1e3 * std::sqrt(heading));
}

}  // namespace gapfarm
