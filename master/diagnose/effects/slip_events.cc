#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

// Looked for in the tails of what is left (slip.h).
extern const EffectDiagnosis kSlipEvents = {
    .effect = "slip_events",
    .phrases = {"In %1 of the trials a side slips and loses up to %2 of its speed",
                {{"probability", 100, " %"}, {"loss", 100, " %"}}},
    .short_phrases = ShortPhrases{"probability", 100, " %", "In % of the drives a side slips",
                                  nullptr, "Clean the treads and the floor"},
};

}  // namespace gapfarm
