#include "master/ground/reference.h"

#include <algorithm>

namespace gapfarm {
namespace {

// How far off a file may be of which nothing is asked, in what a robot changes by by itself.
constexpr double kFarOff = 20;

GroundReference reference_of(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed) {
  GroundReference reference;
  for (const FitRow& row : fit.rows) reference.names.push_back(row.row.name);
  reference.values = fit.values;
  reference.draws = fitter.draws(fit, seed).colwise() - fit.values;
  reference.covariance =
      reference.draws * reference.draws.transpose() / static_cast<double>(reference.draws.cols());
  return reference;
}

}  // namespace

Result<GroundQuestion> ask_what_changed(const GroundRobot& robot, const RunLog& reference,
                                        const WindowSettings& settings, std::uint64_t seed,
                                        FitMemo* memo) {
  GroundQuestion question;
  question.rows = change_rows(robot);
  question.catalogue = change_hypotheses(robot, question.rows);
  const auto windows = window_set(robot, reference, settings);
  if (!windows) return Error{"the reference: " + windows.error().message};
  std::vector<FitRow> rows;
  Eigen::VectorXd values(static_cast<Eigen::Index>(question.rows.size()));
  for (const KinematicRow& row : question.rows) {
    values[static_cast<Eigen::Index>(rows.size())] = row.nominal;
    rows.push_back({row, false});
    rows.back().row.tolerance *= kFarOff;
  }
  const WindowFitter fitter(robot, *windows, nullptr, memo);
  values = scan_delay(fitter, rows, values);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k].row.nominal = values[static_cast<Eigen::Index>(k)];
  }
  const WindowFit fit = fitter.fit(rows, {}, values);
  if (const auto fault = find_ground_fault(robot, reference, question, settings);
      fault && fault->objective > fit.objective) {
    const GroundHypothesis& h = question.catalogue[fault->hypothesis];
    return Error{"the reference's log is wrong in " + h.thing + ". " + h.remedy};
  }
  question.reference = reference_of(fitter, fit, seed);
  for (std::size_t k = 0; k < question.rows.size(); ++k) {
    question.rows[k].nominal = fit.values[static_cast<Eigen::Index>(k)];
  }
  question.catalogue = change_hypotheses(robot, question.rows);
  return question;
}

}  // namespace gapfarm
