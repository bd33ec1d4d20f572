#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/evidence/session_gains.h"

namespace gapfarm {
namespace {

const SpreadRow kSessionSpread = {
    .effect = "session_gain",
    .least_gain = 20,  // as of a second one of a kind
    .fit = fit_session_gains,
    .scores = scores_with_session_gains,
    .by_session = true,
    .rest = beside_session_gains,
};

}  // namespace

extern const EffectDiagnosis kSessionGain = {
    .effect = "session_gain",
    .phrases = {"Each session drives at a speed of its own, which differ by %1",
                {{"spread", 100, " %"}},
                "Begin every session alike: charged, and on a clean floor",
                "The sessions' speeds differ by %1"},
    .spread = &kSessionSpread,
    .found = "by sessions that drive faster or slower as a whole",
    .missing = "no session drives faster or slower as a whole than others",
};

}  // namespace gapfarm
