#include "common/problem/residual_problem.h"

namespace gapfarm {
namespace {

// Row by row; a last row that breaks off is left out, which check_residual() then misses.
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
  for (const ResidualTerm& term : problem.residual) {
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

Status read_residual(const v1::Problem& message, Problem* problem) {
  if (message.residual_size() == 0) return {};
  if (!scenario_form(problem->scenario).residual) {
    return Error{"problem: scenario '" + problem->scenario +
                 "' takes no residual; leave [residual] out of its model"};
  }
  for (const v1::ResidualTerm& from : message.residual()) {
    ResidualTerm term;
    if (from.frame() >= residual_frame_words().size()) {
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
    problem->residual.push_back(std::move(term));
  }
  std::vector<std::string> commands;
  for (const CommandSpec& c : problem->commands) commands.push_back(c.name);
  if (Status s = check_residual(problem->residual, commands); !s) {
    return Error{"problem: " + s.error().message};
  }
  return {};
}

}  // namespace gapfarm
