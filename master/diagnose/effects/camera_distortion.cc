#include <algorithm>
#include <cmath>

#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {
namespace {

// Columns of lens_probes(): the strength, then strength times how far its centre is off.
void start_lens(const EffectStart& at, std::map<std::string, double>* values) {
  const Eigen::VectorXd& c = at.coefficients;
  const Eigen::Vector2d middle = middle_of(at.study);
  const double k1 = std::abs(c[0]) > 1e-6 ? c[0] : 1e-6;
  (*values)["camera_distortion.k1"] = k1;
  (*values)["camera_distortion.x"] = middle.x() + std::clamp(c[1] / k1, -1.0, 1.0);
  (*values)["camera_distortion.y"] = middle.y() + std::clamp(c[2] / k1, -1.0, 1.0);
}

}  // namespace

extern const EffectDiagnosis kCameraDistortion = {
    .effect = "camera_distortion",
    .searched = {{"k1", 0.05}, {"x", 0.1}, {"y", 0.1}},
    .probes = [](const Study& study) { return lens_probes(middle_of(study)); },
    .bends_view = true,
    .start = start_lens,
    .model_error = 0.03,
    .places = {{"x", 0}, {"y", 1}},
    .phrases = {"The lens distorts radially with k1 = %1 about x = %2, y = %3 of the world",
                {{"k1", 1, " 1/m^2"}, {"x", 1, " m"}, {"y", 1, " m"}},
                "Calibrate the lens",
                "The camera's lens bends positions"},
};

}  // namespace gapfarm
