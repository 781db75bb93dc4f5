// The ROS 2 interfaces that Ruedo uses: their definitions, and what follows from them: the text in
// bags, the name of a type in DDS, and its hash (REP-2011, RIHS01), by which tools check that two
// nodes use the same type.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace ruedo::ros2 {

// Releases whose interfaces differ where Ruedo uses them.
enum class Distro { humble, iron, jazzy, kilted, lyrical };

// The release of that name; throws InputError listing the known ones.
Distro parse_distro(const std::string& name);
const char* name_of(Distro distro);

struct Field {
  std::string type;  // "float64", "string", "geometry_msgs/msg/Point"
  std::string name;
  enum class Kind { one, array, bounded, sequence } kind = Kind::one;
  size_t capacity = 0;       // of an array or a bounded sequence
  size_t text_capacity = 0;  // of a bounded string; 0: unbounded
};

// The fields of an interface, "pkg/msg/Name", or of a service's "pkg/srv/Name_Request" and
// "pkg/srv/Name_Response". The name must be known.
const std::vector<Field>& fields_of(std::string_view type, Distro distro);

// The definition followed by those that it uses, as in a bag ("ros2msg").
std::string full_text(std::string_view type, Distro distro);

// "RIHS01_" and 64 digits; for a message or service.
std::string type_hash(std::string_view type, Distro distro);

// "sensor_msgs/msg/LaserScan": "sensor_msgs::msg::dds_::LaserScan_".
std::string dds_type(std::string_view type);

}  // namespace ruedo::ros2
