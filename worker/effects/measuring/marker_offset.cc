#include "worker/effects/behaviour.h"
#include "worker/effects/table.h"

namespace gapfarm::effects {
namespace marker_offset_hooks {

enum Value : std::size_t { kX, kY };

Pose observe(EffectValues p, const Pose& X_WR) { return X_WR * Pose{p[kX], p[kY], 0}; }

Pose recover(EffectValues p, const Pose& X_WM) { return X_WM * Pose{-p[kX], -p[kY], 0}; }

}  // namespace marker_offset_hooks

const EffectBehaviour marker_offset{.name = "marker_offset",
                                    .observe = marker_offset_hooks::observe,
                                    .recover = marker_offset_hooks::recover};

}  // namespace gapfarm::effects
