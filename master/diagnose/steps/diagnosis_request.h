// What a diagnosis is asked, and whom it may ask: fixed while it runs.
#pragma once

#include <Eigen/Core>
#include <string>

#include "master/diagnose/diagnose.h"
#include "master/diagnose/subject.h"
#include "master/infer/predictor.h"

namespace gapfarm::steps {

struct DiagnosisRequest {
  Farm& farm;
  Predictor& predictor;
  const Problem& problem;  // its log in its own frame
  const DiagnosisSubject& subject;
  const DiagnoseOptions& options;
  Eigen::Vector2d frame_m;  // of the log in the world

  const ParameterTable& table() const { return problem.table(); }
  double outlier_share() const { return problem.fitness.outlier_share; }
  // As asked, or because the scenario's table has no such effect.
  bool excluded(const std::string& effect) const;
  bool looks_for(const std::string& effect, Looks look) const;
  // Whether there are poses on the way to be had: some programs answer where a drive ends alone.
  bool has_paths() const;
  // Of a table key that is a place along a world axis: how far the log's frame lies along it.
  double frame_of(const std::string& key, const Overrides& at) const;
};

}  // namespace gapfarm::steps
