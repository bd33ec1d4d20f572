// A piece of the log that is pushed: from parameter values and a logged start to where it ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/problem/problem.h"
#include "common/score/fitness.h"
#include "gapfarm/v1/task.pb.h"
#include "worker/effects/behaviour.h"
#include "worker/scenarios/motion_memo.h"
#include "worker/sim/push/push.h"

namespace gapfarm {

struct PushNoise {
  double slide = 0;       // s.d. of the end position over the distance slid
  double turn_rad_m = 0;  // s.d. of the end heading over the distance slid
  PoseNoise pose;         // of a reading
};

PushNoise push_noise(const ParameterValues& values);

// All that a push of a log depends on.
struct PushKey {
  std::uint32_t trial = 0;  // of the log, whose finger's way it is
  PushSettings settings;
  Pose X_WS;
  Floor table;

  bool operator==(const PushKey&) const = default;
  // Of what differs among the derivatives of a log's predictions.
  std::size_t hash() const;
};

// Poses with R are the true ones of the frame that the log follows.
class PushedPiece {
 public:
  // `index`: of the piece in the problem, for a pressure or a shape factor of its own.
  PushedPiece(const Piece& piece, std::size_t index, const ParameterValues& values);

  const Piece& piece() const { return piece_; }
  // The true start of a piece logged there, what is logged of a true pose, and of a true start.
  Pose start_of(const Pose& X_WM) const;
  Pose observe(const Pose& X_WR) const;
  Pose logged_start(const Pose& X_WR) const { return effects_.unplace(X_WR); }

  struct Push {
    v1::Outcome outcome = v1::OK;
    Pose X_WE;
    double slid_m = 0;  // from the centroid's start to its end
    Motion motion;
  };
  // `path` receives true poses of the log's frame in the world.
  Push push(const Pose& X_WR, std::span<const TipSample> tip,
            std::vector<PathSample>* path = nullptr, double interval_s = 0);
  // That of the log's `trial`, unless `memo` (may be null) has it.
  Push push(const Pose& X_WR, std::uint32_t trial, std::span<const TipSample> tip,
            MotionMemo<PushKey>* memo);

  unsigned runs() const { return runs_; }

 private:
  Floor table_at(const Pose& X_WS) const;
  Motion simulate(const Pose& X_WS, std::span<const TipSample> tip, const Floor& table,
                  std::vector<MotionSample>* samples = nullptr, double interval_s = 0);
  Push pushed(const Pose& X_WS, const Motion& motion);

  const Piece& piece_;
  ActiveEffects effects_;
  double camera_scale_;  // logged lengths over true ones
  Pose X_RC_;            // centroid in the log's frame
  std::unique_ptr<PushSimulator> simulator_;
  unsigned runs_ = 0;
};

}  // namespace gapfarm
