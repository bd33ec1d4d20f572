// The XML of a URDF.
#pragma once

#include "master/io/robot_files/urdf/urdf.h"

namespace gapfarm {

// Everything that the file says, before anybody asked whether it hangs together.
Result<UrdfModel> read_urdf_xml(std::string_view text, const std::string& file);

}  // namespace gapfarm
