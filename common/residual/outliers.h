// A share of drives that end elsewhere ([residual.strays] of model.toml): what single drives or
// readings do now and then, of which nobody knows the cause.
//
// Such a drive has an amount of something, uniform between two limits; every other drive has the
// amount `rest` of it.  What an amount does to an end is followed to its end, not to first order: a
// side that loses half its speed leads along an arc.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/pose/pose.h"
#include "common/residual/field.h"

namespace gapfarm {

enum class OutlierKind {
  kSide,    // one side, either as often, is faster by this share of its speed
  kLate,    // the end was read this long before the drive ended, s
  kTurned,  // of drives after an unrecorded move: the start's heading is this far on, rad
  kShifted  // the end lies this far along a direction of the world or, as often, against it, m
};
// "side", "late", "turned", "shifted", in that order.
const std::vector<std::string>& outlier_kind_names();

struct OutlierDrives {
  OutlierKind kind = OutlierKind::kSide;
  double share = 0;            // in (0, 1)
  double least = 0, most = 0;  // of the amount
  double rest = 0;             // of both sides; kTurned and kShifted have none
  double direction_rad = 0;    // kShifted
  double speed_m_s = 0;        // kSide: of a side at full duty
  double gauge_m = 0;          // kSide: between the sides, as turns show

  bool operator==(const OutlierDrives&) const = default;
};

// Every number of it, by the key that model.toml, diagnosis.json and messages have for it.
std::array<std::pair<const char*, double*>, 7> outlier_values(OutlierDrives& outliers);

// Where a drive that would end at `X_WE` may end.
struct OutlierMode {
  double weight = 1;
  Pose X_WE;
  // One standard deviation of it to either side, in its own axes: m, m, rad.
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();
};
// The first is that of a drive that is no outlier; weights sum to 1.
std::vector<OutlierMode> outlier_modes(const OutlierDrives& outliers, const LoggedMotion& facts,
                                       const Pose& X_WE);
// Where a drive with this amount ends; of kSide the left side's or the right one's, of kShifted
// along the direction or against it.
Pose outlier_end(const OutlierDrives& outliers, const LoggedMotion& facts, const Pose& X_WE,
                 double amount, bool first);
// Where every drive ends that is no outlier.
Pose rest_end(const OutlierDrives& outliers, const LoggedMotion& facts, const Pose& X_WE);
// Whether a drive may be an outlier at all.
bool may_be_outlier(const OutlierDrives& outliers, const LoggedMotion& facts);

// All that [residual] says.
struct Residual {
  ResidualField field;
  std::optional<OutlierDrives> outliers;  // about the ends that the field has corrected

  bool empty() const { return field.empty() && !outliers; }
};

// Errors name the key, what was found and what it has to be.
Status check_outliers(const OutlierDrives& outliers);

}  // namespace gapfarm
