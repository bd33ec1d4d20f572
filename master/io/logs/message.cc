#include <algorithm>
#include <cstdint>
#include <cstring>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/topics.h"

namespace gapfarm {
namespace {

struct Text {
  const char* type;
  const char* fields;
};

// Field order is the wire's (ROS 2's common_interfaces, ackermann_msgs, tf2_msgs).
constexpr Text kTexts[] = {
    {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"std_msgs/String", "string data\n"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    {"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    {"geometry_msgs/Pose2D", "float64 x\nfloat64 y\nfloat64 theta\n"},
    {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    {"geometry_msgs/TwistStamped", "std_msgs/Header header\ngeometry_msgs/Twist twist\n"},
    {"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
    {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    {"geometry_msgs/PoseWithCovarianceStamped",
     "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"},
    {"geometry_msgs/Transform",
     "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    {"geometry_msgs/TransformStamped",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
    {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"nav_msgs/Odometry",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
     "geometry_msgs/TwistWithCovariance twist\n"},
    {"sensor_msgs/JointState",
     "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
     "float64[] effort\n"},
    {"sensor_msgs/Imu",
     "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
     "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
     "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
     "float64[9] linear_acceleration_covariance\n"},
    {"sensor_msgs/BatteryState",
     "std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\nfloat32 current\n"
     "float32 charge\nfloat32 capacity\nfloat32 design_capacity\nfloat32 percentage\n"
     "uint8 power_supply_status\nuint8 power_supply_health\nuint8 power_supply_technology\n"
     "bool present\nfloat32[] cell_voltage\nfloat32[] cell_temperature\nstring location\n"
     "string serial_number\n"},
    {"ackermann_msgs/AckermannDrive",
     "float32 steering_angle\nfloat32 steering_angle_velocity\nfloat32 speed\n"
     "float32 acceleration\nfloat32 jerk\n"},
    {"ackermann_msgs/AckermannDriveStamped",
     "std_msgs/Header header\nackermann_msgs/AckermannDrive drive\n"}};

static_assert(std::endian::native == std::endian::little, "messages are copied as they are");

constexpr int kDeepest = 16;
// Whether it is of x, y and the turn in a covariance of six.
bool is_planar(std::uint32_t count, std::uint32_t i) {
  const auto level = [](std::uint32_t k) { return k < 2 || k == 5; };
  return count == 36 && i % 6 >= i / 6 && level(i / 6) && level(i % 6);
}

// Elements of one array that become columns; clouds and images do not.
constexpr std::size_t kMostElements = 64;
constexpr std::size_t kMostInMessage = 1'000'000;

}  // namespace

class MessageDecoder {
 public:
  MessageDecoder(const MessageSchema& schema, std::string_view bytes, MessageWire wire)
      : schema_(schema), bytes_(bytes), cdr_(wire == MessageWire::kCdr) {}

  Result<MessageContent> run() {
    if (cdr_) {
      // A header of four bytes; alignment counts from behind it.
      if (bytes_.size() < 4) return ended();
      if (bytes_[1] != 1 && bytes_[1] != 3) {
        return Error{"found a CDR message that is not little-endian"};
      }
      bytes_.remove_prefix(4);
    }
    if (!message(schema_.type_, "")) return error_;
    return std::move(content_);
  }

  using Read = bool (MessageDecoder::*)(const std::string& path);
  // Null of types that hold others.
  static Read reader_of(std::string_view primitive) {
    using D = MessageDecoder;
    constexpr Read kU8 = &D::number<std::uint8_t>, kI8 = &D::number<std::int8_t>;
    static const std::map<std::string_view, Read> kReaders = {{"bool", kU8},
                                                              {"byte", kU8},
                                                              {"char", kU8},
                                                              {"uint8", kU8},
                                                              {"int8", kI8},
                                                              {"int16", &D::number<std::int16_t>},
                                                              {"uint16", &D::number<std::uint16_t>},
                                                              {"int32", &D::number<std::int32_t>},
                                                              {"uint32", &D::number<std::uint32_t>},
                                                              {"int64", &D::number<std::int64_t>},
                                                              {"uint64", &D::number<std::uint64_t>},
                                                              {"float32", &D::number<float>},
                                                              {"float64", &D::number<double>},
                                                              // ROS 1's time is a primitive.
                                                              {"string", &D::word},
                                                              {"time", &D::stamp},
                                                              {"duration", &D::stamp}};
    const Read* found = find_in(kReaders, primitive);
    return found ? *found : nullptr;
  }

 private:
  Error ended() const {
    return Error{"the message of type " + schema_.type_ + " ends at byte " +
                 std::to_string(bytes_.size()) + ", within it"};
  }
  bool fail() {
    error_ = ended();
    return false;
  }

  bool take(void* to, std::size_t size) {
    if (cdr_ && size > 1) at_ = (at_ + size - 1) / size * size;
    if (at_ > bytes_.size() || bytes_.size() - at_ < size) return fail();
    std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
    return true;
  }

  bool message(const std::string& type, const std::string& path) {
    for (const MessageSchema::Field& field : schema_.types_.find(type)->second) {
      const std::string inside = path.empty() ? field.name : path + "." + field.name;
      if (!field.array) {
        if (!element(field, inside)) return false;
        continue;
      }
      std::uint32_t count = static_cast<std::uint32_t>(field.fixed);
      if (field.fixed == 0 && !take(&count, 4)) return false;
      // Each element takes a byte at least.
      if (count > bytes_.size()) return fail();
      const bool covariance = field.name.find("covariance") != field.name.npos;
      for (std::uint32_t i = 0; i < count; ++i) {
        const bool quiet = count > kMostElements || (covariance && !is_planar(count, i));
        if (quiet) ++quiet_;
        const bool fine = element(field, inside + "[" + std::to_string(i) + "]");
        if (quiet) --quiet_;
        if (!fine) return false;
      }
    }
    return true;
  }

  bool element(const MessageSchema::Field& field, const std::string& path) {
    // Elements without bytes cost nothing to claim.
    if (++elements_ > kMostInMessage) return fail();
    if (field.read != nullptr) return (this->*field.read)(path);
    const bool time = cdr_ && (field.type == "builtin_interfaces/Time" ||
                               field.type == "builtin_interfaces/Duration");
    return time ? stamp(path) : message(field.type, path);
  }

  void put(const std::string& path, double value) {
    if (quiet_ == 0) content_.numbers.emplace_back(path, value);
  }

  bool stamp(const std::string& path) {
    std::uint32_t s = 0, ns = 0;
    if (!take(&s, 4) || !take(&ns, 4)) return false;
    put(path, static_cast<double>(s) + 1e-9 * static_cast<double>(ns));
    return true;
  }

  bool word(const std::string& path) {
    std::uint32_t length = 0;
    if (!take(&length, 4)) return false;
    if (bytes_.size() - at_ < length) return fail();
    std::string text(bytes_.substr(at_, length));
    at_ += length;
    if (cdr_ && !text.empty() && text.back() == '\0') text.pop_back();
    if (quiet_ == 0) content_.texts[path] = std::move(text);
    return true;
  }

  template <class T>
  bool number(const std::string& path) {
    T raw{};
    if (!take(&raw, sizeof raw)) return false;
    put(path, static_cast<double>(raw));
    return true;
  }

  const MessageSchema& schema_;
  std::string_view bytes_;
  bool cdr_;
  std::size_t at_ = 0;
  std::size_t elements_ = 0;
  int quiet_ = 0;  // within arrays that become no columns
  MessageContent content_;
  Error error_;
};

std::string short_type(std::string_view type) {
  std::string out(type);
  const std::size_t at = out.find("/msg/");
  if (at != out.npos) out.erase(at, 4);
  return out;
}

bool serves_ground_robots(std::string_view type) {
  static constexpr std::string_view kServed[] = {
      "Twist",        "TwistStamped", "AckermannDrive",   "AckermannDriveStamped",
      "Odometry",     "JointState",   "PoseStamped",      "PoseWithCovarianceStamped",
      "Pose2D",       "TFMessage",    "TransformStamped", "Imu",
      "BatteryState", "String"};
  return contains(kServed, type.substr(type.rfind('/') + 1));
}

Status MessageSchema::check(const std::string& type, int depth) const {
  const auto found = types_.find(type);
  if (found == types_.end()) {
    return Error{"type " + quoted_word(type_) + " needs " + quoted_word(type) +
                 ", which its definition does not hold"};
  }
  if (depth > kDeepest) return Error{"type " + quoted_word(type_) + " holds itself"};
  for (const Field& field : found->second) {
    if (field.read != nullptr) continue;
    RETURN_IF_ERROR(check(field.type, depth + 1));
  }
  return {};
}

Result<MessageSchema> MessageSchema::parse(const std::string& type, std::string_view definition) {
  MessageSchema schema;
  schema.type_ = short_type(type);
  std::string current = schema.type_;
  schema.types_[current];
  // Types within are named with their package, or without it when it is the holder's own.
  std::vector<std::string> defined;
  for (std::string_view line : lines_of(definition)) {
    if (const std::size_t hash = line.find('#'); hash != line.npos) line = line.substr(0, hash);
    line = trimmed(line);
    if (line.empty() || line[0] == '=') continue;
    if (line.substr(0, 4) == "MSG:") {
      current = short_type(trimmed(line.substr(4)));
      schema.types_[current];
      continue;
    }
    const std::size_t blank = line.find_first_of(" \t");
    if (blank == line.npos) return Error{"found the definition line " + quoted_word(line)};
    std::string_view word = line.substr(0, blank);
    std::string_view name = trimmed(line.substr(blank));
    name = name.substr(0, name.find_first_of(" \t="));
    // Constants take no room; ROS 2's defaults stand behind a blank.
    const std::size_t equals = line.find('=');
    if (equals != line.npos && trimmed(line.substr(blank, equals - blank)) == name) continue;
    Field field;
    field.name = name;
    if (const std::size_t bracket = word.find('['); bracket != word.npos) {
      field.array = true;
      const std::string_view inside = word.substr(bracket + 1, word.size() - bracket - 2);
      if (inside.substr(0, 2) != "<=") {
        field.fixed = static_cast<std::size_t>(
            std::clamp<std::int64_t>(parse_integer(inside).value_or(0), 0, 1 << 20));
      }
      word = word.substr(0, bracket);
    }
    word = word.substr(0, word.find("<="));  // string<=10
    field.read = MessageDecoder::reader_of(word);
    if (field.read == nullptr) field.type = short_type(word);
    schema.types_[current].push_back(std::move(field));
  }
  for (auto& [holder, fields] : schema.types_) {
    for (Field& field : fields) {
      if (field.read != nullptr || schema.types_.count(field.type) != 0) continue;
      const std::string package = holder.substr(0, holder.find('/') + 1);
      field.type = field.type == "Header" ? "std_msgs/Header" : package + field.type;
    }
  }
  RETURN_IF_ERROR(schema.check(schema.type_, 0));
  return schema;
}

Result<MessageSchema> MessageSchema::known(const std::string& type) {
  const Text* own = find_by(kTexts, short_type(type), &Text::type);
  if (own == nullptr) return Error{"no definition of " + quoted_word(type) + " is known"};
  // With all that it might hold.
  std::string text = own->fields;
  for (const Text& other : kTexts) {
    if (&other != own) text += std::string("MSG: ") + other.type + "\n" + other.fields;
  }
  return parse(type, text);
}

Result<MessageContent> MessageSchema::decode(std::string_view bytes, MessageWire wire) const {
  return MessageDecoder(*this, bytes, wire).run();
}

}  // namespace gapfarm
