#include "common/base/try.h"
#include "common/problem/message_parts.h"
#include "common/problem/run_files.h"

namespace gapfarm {
namespace {

// Row by row; a last row that breaks off is omitted, which check_residual() then misses.
Eigen::MatrixXd rows_of(const google::protobuf::RepeatedField<double>& numbers, int columns) {
  Eigen::MatrixXd rows(columns > 0 ? numbers.size() / columns : 0, columns);
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    for (Eigen::Index j = 0; j < rows.cols(); ++j) {
      rows(k, j) = numbers[static_cast<int>(k) * columns + static_cast<int>(j)];
    }
  }
  return rows;
}

void write_rows(const Eigen::MatrixXd& rows, google::protobuf::RepeatedField<double>* numbers) {
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    for (Eigen::Index j = 0; j < rows.cols(); ++j) numbers->Add(rows(k, j));
  }
}

}  // namespace

void write_residual(const Problem& problem, v1::Problem* message) {
  if (const auto& outliers = problem.residual.outliers) {
    v1::OutlierDrives* to = message->mutable_outliers();
    to->set_kind(static_cast<std::uint32_t>(outliers->kind));
    to->set_share(outliers->share);
    to->set_least(outliers->least);
    to->set_most(outliers->most);
    to->set_rest(outliers->rest);
    to->set_direction(outliers->direction_rad);
    to->set_speed(outliers->speed_m_s);
    to->set_gauge(outliers->gauge_m);
  }
  for (const ResidualTerm& term : problem.residual.field) {
    v1::ResidualTerm* to = message->add_residual();
    to->set_frame(static_cast<std::uint32_t>(term.frame));
    to->set_by_drive(term.by_drive);
    for (const std::size_t c : term.covariates) to->add_covariates(static_cast<std::uint32_t>(c));
    for (const double length : term.lengths) to->add_lengths(length);
    write_rows(term.centres, to->mutable_centres());
    for (const ResidualWeights& w : term.weights) {
      v1::ResidualTerm::Weights* weights = to->add_weights();
      weights->set_command(w.command);
      write_rows(w.shifts, weights->mutable_shifts());
    }
  }
}

namespace {

Status read_outliers(const v1::Problem& message, Problem* problem) {
  if (!message.has_outliers()) return {};
  const v1::OutlierDrives& from = message.outliers();
  if (from.kind() >= outlier_kind_names().size()) {
    return Error{"problem: residual.strays of kind number " + std::to_string(from.kind()) +
                 "; master and worker must be the same build"};
  }
  const OutlierDrives outliers{static_cast<OutlierKind>(from.kind()),
                               from.share(),
                               from.least(),
                               from.most(),
                               from.rest(),
                               from.direction(),
                               from.speed(),
                               from.gauge()};
  if (Status s = check_outliers(outliers); !s) return Error{"problem: " + s.error().message};
  problem->residual.outliers = outliers;
  return {};
}

}  // namespace

Status read_residual(const v1::Problem& message, Problem* problem) {
  if (message.residual_size() == 0 && !message.has_outliers()) return {};
  if (!scenario_form(problem->scenario).residual) {
    return Error{"problem: scenario '" + problem->scenario +
                 "' takes no residual; leave [residual] out of its model"};
  }
  for (const v1::ResidualTerm& from : message.residual()) {
    ResidualTerm term;
    if (from.frame() >= residual_frame_names().size()) {
      return Error{"problem: a residual of frame number " + std::to_string(from.frame()) +
                   "; master and worker must be the same build"};
    }
    term.frame = static_cast<ResidualFrame>(from.frame());
    term.by_drive = from.by_drive();
    term.covariates.assign(from.covariates().begin(), from.covariates().end());
    term.lengths.assign(from.lengths().begin(), from.lengths().end());
    term.centres = rows_of(from.centres(), from.covariates_size());
    for (const v1::ResidualTerm::Weights& w : from.weights()) {
      term.weights.push_back({w.command(), rows_of(w.shifts(), 3)});
    }
    problem->residual.field.push_back(std::move(term));
  }
  RETURN_IF_ERROR(read_outliers(message, problem));
  const Status sound = check_residual(problem->residual.field, command_names(problem->commands));
  return sound ? Status() : Error{"problem: " + sound.error().message};
}

}  // namespace gapfarm
