#include "master/diagnose/push/push_subject.h"

#include "common/parameters/table.h"
#include "master/infer/settings.h"

namespace gapfarm {

DiagnosisSubject push_subject() {
  DiagnosisSubject s;
  s.scenario = "push";
  s.effects = &push_effect_diagnoses();
  s.least_gain = kLeastGainOfPushes;
  s.farthest = 4;
  s.noise_tail = 7;
  s.base_moves = true;
  s.drive_common = {row_of(Push::kPushNoiseSlide)};
  s.drive_side = {row_of(Push::kPushNoiseTurn), kTurnUnit_rad_m};
  s.pose_position = {row_of(Push::kPoseNoisePosition)};
  s.pose_heading = {row_of(Push::kPoseNoiseHeading)};
  s.covariance = push_covariance;
  s.make_study = make_push_study;
  s.tune = tune_push_base;
  s.nuisances = push_nuisances;
  s.blocks = push_blocks;
  s.folds = push_folds;
  s.where = push_where;
  s.cautions = push_cautions;
  s.lacks = push_lacks;
  s.view = push_view;
  s.shown = {{"arm_mm", "centroid left of the finger's line, mm", "contact offset"},
             {"direction", "push direction in the world, degrees", "push direction"},
             {"side", "push direction in the piece, degrees", "side of the piece"},
             {"pushed_mm", "distance pushed, mm", "distance"},
             {"speed", "finger's speed, mm/s", "finger speed"},
             {"along_edge", "touch on its edge, half edges from its middle", "place of the touch"},
             {"middle_x", "start of the centroid along x, m", "start x"},
             {"middle_y", "start of the centroid along y, m", "start y"}};
  s.labels.ends =
      "One picture a piece, seen from where each push began: x along the finger's way, y to its "
      "left. Every push is a condition of its own: the ellipses, which should hold nine in ten, "
      "are those of all its pushes together, and an error takes each push's own prediction away.";
  s.labels.residuals = "Measured minus predicted, along and across the push.";
  s.labels.x = "along the push";
  s.labels.y = "across the push";
  return s;
}

}  // namespace gapfarm
