#include "master/diagnose/steps/diagnosis_request.h"

#include <algorithm>
#include <span>

namespace gapfarm::steps {

bool DiagnosisRequest::excluded(const std::string& effect) const {
  const std::span<const Effect> known = table().effects();
  return std::find(options.excluded.begin(), options.excluded.end(), effect) !=
             options.excluded.end() ||
         std::none_of(known.begin(), known.end(),
                      [&](const Effect& e) { return e.name == effect; });
}

bool DiagnosisRequest::looks_for(const std::string& effect, Looks look) const {
  return (subject.looks & look) != 0 && !excluded(effect);
}

bool DiagnosisRequest::has_paths() const {
  return !problem.external || (problem.external->table.declaration().inputs & kExternalPath) != 0;
}

double DiagnosisRequest::frame_of(const std::string& key, const Overrides& at) const {
  const Parameter& p = table()[table().row(key)];
  const WorldPlace* place = place_of(*subject.effects, p);
  if (place == nullptr) return 0;
  if (place->axis >= 0) return frame_m[place->axis];
  const auto axis = at.find(table().row(p.effect + ".axis"));
  return axis != at.end() && axis->second != 0 ? frame_m.y() : frame_m.x();
}

}  // namespace gapfarm::steps
