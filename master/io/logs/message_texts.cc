#include "master/io/logs/message_texts.h"

#include <set>
#include <vector>

namespace gapfarm {
namespace {

struct Text {
  const char* type;
  const char* fields;
  std::vector<const char*> within;
};

// Field order is the wire's (ROS 2's common_interfaces, ackermann_msgs, tf2_msgs).
const std::vector<Text>& texts() {
  static const std::vector<Text> kTexts = {
      {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n", {}},
      {"std_msgs/Header",
       "builtin_interfaces/Time stamp\nstring frame_id\n",
       {"builtin_interfaces/Time"}},
      {"std_msgs/String", "string data\n", {}},
      {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n", {}},
      {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n", {}},
      {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n", {}},
      {"geometry_msgs/Pose",
       "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
       {"geometry_msgs/Point", "geometry_msgs/Quaternion"}},
      {"geometry_msgs/Pose2D", "float64 x\nfloat64 y\nfloat64 theta\n", {}},
      {"geometry_msgs/Twist",
       "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
       {"geometry_msgs/Vector3"}},
      {"geometry_msgs/TwistStamped",
       "std_msgs/Header header\ngeometry_msgs/Twist twist\n",
       {"std_msgs/Header", "geometry_msgs/Twist"}},
      {"geometry_msgs/PoseStamped",
       "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
       {"std_msgs/Header", "geometry_msgs/Pose"}},
      {"geometry_msgs/PoseWithCovariance",
       "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
       {"geometry_msgs/Pose"}},
      {"geometry_msgs/TwistWithCovariance",
       "geometry_msgs/Twist twist\nfloat64[36] covariance\n",
       {"geometry_msgs/Twist"}},
      {"geometry_msgs/PoseWithCovarianceStamped",
       "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n",
       {"std_msgs/Header", "geometry_msgs/PoseWithCovariance"}},
      {"geometry_msgs/Transform",
       "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
       {"geometry_msgs/Vector3", "geometry_msgs/Quaternion"}},
      {"geometry_msgs/TransformStamped",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
       {"std_msgs/Header", "geometry_msgs/Transform"}},
      {"tf2_msgs/TFMessage",
       "geometry_msgs/TransformStamped[] transforms\n",
       {"geometry_msgs/TransformStamped"}},
      {"nav_msgs/Odometry",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
       "geometry_msgs/TwistWithCovariance twist\n",
       {"std_msgs/Header", "geometry_msgs/PoseWithCovariance",
        "geometry_msgs/TwistWithCovariance"}},
      {"sensor_msgs/JointState",
       "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
       "float64[] effort\n",
       {"std_msgs/Header"}},
      {"sensor_msgs/Imu",
       "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
       "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
       "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
       "float64[9] linear_acceleration_covariance\n",
       {"std_msgs/Header", "geometry_msgs/Quaternion", "geometry_msgs/Vector3"}},
      {"sensor_msgs/BatteryState",
       "std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\nfloat32 current\n"
       "float32 charge\nfloat32 capacity\nfloat32 design_capacity\nfloat32 percentage\n"
       "uint8 power_supply_status\nuint8 power_supply_health\nuint8 power_supply_technology\n"
       "bool present\nfloat32[] cell_voltage\nfloat32[] cell_temperature\nstring location\n"
       "string serial_number\n",
       {"std_msgs/Header"}},
      {"ackermann_msgs/AckermannDrive",
       "float32 steering_angle\nfloat32 steering_angle_velocity\nfloat32 speed\n"
       "float32 acceleration\nfloat32 jerk\n",
       {}},
      {"ackermann_msgs/AckermannDriveStamped",
       "std_msgs/Header header\nackermann_msgs/AckermannDrive drive\n",
       {"std_msgs/Header", "ackermann_msgs/AckermannDrive"}}};
  return kTexts;
}

const Text* find(const std::string& type) {
  for (const Text& text : texts()) {
    if (type == text.type) return &text;
  }
  return nullptr;
}

void collect(const Text& text, std::set<std::string>& done, std::string& out) {
  for (const char* name : text.within) {
    if (!done.insert(name).second) continue;
    const Text* inner = find(name);
    out += std::string("================\nMSG: ") + name + "\n" + inner->fields;
    collect(*inner, done, out);
  }
}

}  // namespace

std::string message_text(const std::string& type) {
  const Text* text = find(type);
  if (text == nullptr) return {};
  std::string out = text->fields;
  std::set<std::string> done;
  collect(*text, done, out);
  return out;
}

}  // namespace gapfarm
