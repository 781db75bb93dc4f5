// cmd_vel has the type of the release, and the other one where somebody publishes it. A command's
// utime is 0: what is recorded of a run must not depend on when a node sent it.
#include "bridges/ros2/commands.h"

#include "bridges/ros2/messages/cdr.h"
#include "engine/outcome.h"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/velocity_command_t.hpp"

namespace ruedo::ros2 {
namespace {

using engine::encoded;

using Bytes = std::optional<std::vector<uint8_t>>;

void skip_header(CdrReader& in) {
  in.skip<uint32_t>(2);
  in.get_text();
}

Bytes velocity_of(CdrReader& in) {
  double values[6];
  for (double& value : values) value = in.get<double>();
  if (!in.good()) return std::nullopt;
  velocity_command_t command;
  command.utime = 0;
  command.vx = values[0];
  command.vy = values[1];
  command.omega = values[5];
  return encoded(command);
}

Bytes from_twist(std::span<const uint8_t> cdr, const std::vector<std::string>&) {
  CdrReader in(cdr);
  return velocity_of(in);
}

Bytes from_twist_stamped(std::span<const uint8_t> cdr, const std::vector<std::string>&) {
  CdrReader in(cdr);
  skip_header(in);
  return velocity_of(in);
}

std::vector<uint8_t> joint_command(const std::vector<std::string>& names, int8_t mode,
                                   const std::vector<double>& values) {
  joint_command_t command;
  command.utime = 0;
  command.n = static_cast<int32_t>(values.size());
  command.name = names;
  command.mode.assign(values.size(), static_cast<uint8_t>(mode));
  command.value = values;
  return encoded(command);
}

// The last point: where the trajectory ends. The joints' own limits determine the speed.
Bytes from_trajectory(std::span<const uint8_t> cdr, const std::vector<std::string>&) {
  CdrReader in(cdr);
  skip_header(in);
  const std::vector<std::string> names = in.get_texts();
  constexpr size_t kSmallestPoint = 24;  // four lengths and a time
  const size_t points = in.get_length(kSmallestPoint);
  std::vector<double> lists[4];  // positions, velocities, accelerations, effort
  for (size_t i = 0; i < points && in.good(); ++i) {
    for (auto& list : lists) list = in.get_sequence<double>();
    in.skip<uint32_t>(2);
  }
  if (!in.good() || points == 0 || names.empty()) return std::nullopt;
  constexpr std::pair<int, int8_t> kModes[] = {
      {0, joint_command_t::POSITION}, {1, joint_command_t::VELOCITY}, {3, joint_command_t::EFFORT}};
  for (const auto& [list, mode] : kModes) {
    if (lists[list].size() == names.size()) return joint_command(names, mode, lists[list]);
  }
  return std::nullopt;
}

template <int8_t mode>
Bytes from_array(std::span<const uint8_t> cdr, const std::vector<std::string>& joints) {
  CdrReader in(cdr);
  constexpr size_t kSmallestDimension = 12;
  const size_t dimensions = in.get_length(kSmallestDimension);
  for (size_t i = 0; i < dimensions && in.good(); ++i) {
    in.get_text();
    in.skip<uint32_t>(2);
  }
  in.get<uint32_t>();
  const std::vector<double> values = in.get_sequence<double>();
  if (!in.good() || values.size() != joints.size()) return std::nullopt;
  return joint_command(joints, mode, values);
}

enum class Form { any, plain, stamped };

struct Row {
  const char* channel_type;
  const char* channel;
  const char* topic;
  const char* type;
  Bytes (*convert)(std::span<const uint8_t>, const std::vector<std::string>& joints);
  Form form = Form::any;  // of the two that releases differ in
};

constexpr Row kRows[] = {
    {"velocity_command_t", "velocity", "cmd_vel", "geometry_msgs/msg/Twist", from_twist,
     Form::plain},
    {"velocity_command_t", "velocity", "cmd_vel", "geometry_msgs/msg/TwistStamped",
     from_twist_stamped, Form::stamped},
    {"joint_command_t", "joint_command", "joint_trajectory_controller/joint_trajectory",
     "trajectory_msgs/msg/JointTrajectory", from_trajectory},
    {"joint_command_t", "joint_command", "forward_position_controller/commands",
     "std_msgs/msg/Float64MultiArray", from_array<joint_command_t::POSITION>},
    {"joint_command_t", "joint_command", "forward_velocity_controller/commands",
     "std_msgs/msg/Float64MultiArray", from_array<joint_command_t::VELOCITY>},
    {"joint_command_t", "joint_command", "forward_effort_controller/commands",
     "std_msgs/msg/Float64MultiArray", from_array<joint_command_t::EFFORT>},
};

}  // namespace

std::vector<Command> commands_of(const std::vector<world_info_t>& info, bool stamped,
                                 const JointNames& joints, Names& names) {
  std::vector<Command> commands;
  for (const world_info_t& part : info) {
    for (const channel_info_t& channel : part.channels) {
      for (const Row& row : kRows) {
        if (!channel.input || channel.robot.empty() || channel.type != row.channel_type) continue;
        const std::vector<std::string> list = joints(channel.robot);
        commands.push_back({{names.topic(channel.robot, row.topic), row.type, kCommandQos},
                            row.form == (stamped ? Form::plain : Form::stamped),
                            channel.name,
                            list,
                            [convert = row.convert, list](std::span<const uint8_t> cdr) {
                              return convert(cdr, list);
                            }});
      }
    }
  }
  return commands;
}

std::vector<std::pair<std::string, std::string>> command_topics(const std::string& robot,
                                                                Names& names) {
  std::vector<std::pair<std::string, std::string>> topics;
  for (const Row& row : kRows)
    topics.emplace_back(names.topic(robot, row.topic), robot + "/" + row.channel);
  return topics;
}

}  // namespace ruedo::ros2
