// metadata.yaml as rosbag2 writes it: version 9 from Jazzy on, version 5 for Humble.
#include "bridges/ros2/bag/rosbag.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "bridges/ros2/services/restore.h"
#include "engine/markers.h"
#include "log/header.h"
#include "log/zstd_file.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/world_info_t.hpp"
#include "system/output_file.h"
#include "world/document/resources.h"

namespace ruedo::ros2 {
namespace {

namespace fs = std::filesystem;

std::string qos_profile(const ros2::Qos& qos, ros2::Distro distro, const std::string& indent) {
  const bool numbers = distro == ros2::Distro::humble || distro == ros2::Distro::iron;
  const auto infinite = [&](const char* name) {
    return fmt::format("{}  {}:\n{}    sec: 9223372036\n{}    nsec: 854775807\n", indent, name,
                       indent, indent);
  };
  const char* reliability =
      numbers ? (qos.reliable ? "1" : "2") : (qos.reliable ? "reliable" : "best_effort");
  const char* durability = numbers ? (qos.transient_local ? "1" : "2")
                                   : (qos.transient_local ? "transient_local" : "volatile");
  return fmt::format("{}- history: {}\n{}  depth: {}\n{}  reliability: {}\n{}  durability: {}\n",
                     indent, numbers ? "1" : "keep_last", indent, qos.depth, indent, reliability,
                     indent, durability) +
         infinite("deadline") + infinite("lifespan") +
         fmt::format("{}  liveliness: {}\n", indent, numbers ? "1" : "automatic") +
         infinite("liveliness_lease_duration") + indent +
         "  avoid_ros_namespace_conventions: false";
}

// A text within double quotes.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n')
      out += "\\n";
    else
      out += c;
  }
  return out + "\"";
}

}  // namespace

Rosbag::Rosbag(const std::string& folder, ros2::ConversionOptions options)
    : folder_(folder), options_(std::move(options)) {
  std::error_code error;
  if (fs::exists(folder_, error))
    throw InputError({},
                     "--ros2: " + folder_ + " is there already; a bag gets a folder of its own");
  fs::create_directories(folder_, error);
  if (error) throw EnvironmentError(folder_ + " cannot be made: " + error.message());
  leftover_.emplace(folder_);
  file_ = fs::path(folder_).filename().string() + "_0.mcap";
  out_ = std::make_unique<log::McapWriter>((fs::path(folder_) / file_).string(), "ros2");
  rest_file_ = (fs::path(folder_) / (std::string(".") + kPlainRest)).string();
  rest_ = std::make_unique<log::Writer>(rest_file_);
}

Rosbag::~Rosbag() {
  if (finished_) return;
  out_.reset();  // which removes its file
  rest_.reset();
  std::error_code error;
  fs::remove(rest_file_, error);
  fs::remove(packed_rest_file(), error);
  fs::remove(folder_, error);
}

void Rosbag::begin_scene(const run::LogWorlds::Scene& scene, uint64_t time_ns) {
  std::vector<world_info_t> info;
  std::vector<std::string> robots;
  for (const std::vector<uint8_t>& bytes : scene.info) {
    world_info_t part;
    if (decode_checked(bytes.data(), bytes.size(), part) != DecodeFault::none) continue;
    for (const robot_info_t& robot : part.robots) robots.push_back(robot.name);
    info.push_back(std::move(part));
  }
  if (!names_) {
    options_.root = robots.size() == 1 ? robots.front() : "";
    names_.emplace(options_.root, options_.topics, options_.tf);
  }
  options_.robots = [&scene] {
    return scene.world ? ros2::robot_frames(*scene.world)
                       : std::map<std::string, ros2::RobotFrames>();
  };
  const bool first = !conversions_;
  conversions_ = std::make_unique<ros2::Conversions>(info, options_, *names_);
  options_.robots = {};  // the scene's
  for (const ros2::Conversions::Standing& each : conversions_->standing())
    write(each.topic, time_ns, each.cdr);
  if (first) names_->check_remaps();
}

void Rosbag::add(const std::string& channel, uint64_t time_ns, std::span<const uint8_t> message) {
  bool said = false;
  const auto emit = [&](size_t index, std::span<const uint8_t> cdr) {
    const ros2::Topic& topic = conversions_->topics()[index];
    const bool says_all = !said && std::ranges::equal(ros2::restored(topic.type, cdr), message);
    said |= write(topic, time_ns, cdr, says_all ? channel : "");
  };
  const bool known =
      conversions_ && conversions_->convert(channel, message, [](size_t) { return true; }, emit);
  if (!add_drawn(time_ns, message) && !known) ++left_out_;
  if (said) return;
  rest_->write(static_cast<int64_t>(time_ns / 1000), channel, message.data(), message.size());
  require_room(static_cast<uint64_t>(rest_->size()));
}

bool Rosbag::add_drawn(uint64_t time_ns, std::span<const uint8_t> message) {
  const auto markers = engine::markers_in(message);
  if (!markers || !names_) return false;
  const std::string frame =
      markers->frame.empty() ? "world" : names_->frame(markers->frame, "base_link");
  write({names_->topic("", "markers"), ros2::MarkerArrays::kType, ros2::kMarkersQos}, time_ns,
        markers_.message(*markers, static_cast<int64_t>(time_ns / 1000), frame));
  return true;
}

bool Rosbag::write(const ros2::Topic& topic, uint64_t time_ns, std::span<const uint8_t> cdr,
                   const std::string& says_all_of) {
  const auto [schema, first] = schemas_.try_emplace(topic.type);
  if (first)
    schema->second =
        out_->add_schema(topic.type, "ros2msg", ros2::full_text(topic.type, options_.distro));
  const auto [at, fresh] =
      topics_.try_emplace(topic.name + " " + topic.type, Recorded{topic, 0, says_all_of});
  if (fresh) {
    log::McapWriter::Metadata metadata{
        {"offered_qos_profiles", qos_profile(topic.qos, options_.distro, "") + "\n"},
        {"topic_type_hash", ros2::type_hash(topic.type, options_.distro)}};
    if (!says_all_of.empty()) metadata[kChannel] = says_all_of;
    at->second.channel = out_->add_channel(schema->second, topic.name, "cdr", metadata);
  }
  begin_ns_ = out_->messages() == 0 ? time_ns : std::min(begin_ns_, time_ns);
  end_ns_ = std::max(end_ns_, time_ns);
  out_->add_message(at->second.channel, time_ns,
                    {reinterpret_cast<const char*>(cdr.data()), cdr.size()});
  ++at->second.messages;
  return !says_all_of.empty() && at->second.says_all_of == says_all_of;
}

// Who shows the bag would refuse it otherwise.
void Rosbag::require_room(uint64_t attached_bytes) const {
  if (attached_bytes > kMostAttachedBytes)
    throw InputError({folder_}, fmt::format("would hold more than {} bytes of messages that no "
                                            "topic says in full, and of the world's files",
                                            kMostAttachedBytes));
}

// A log may be untrusted: only files of its world with the expected content are read.
void Rosbag::attach_files(log_header_t header, const std::string& log) {
  if (!log::fault_of_names(header).empty()) return;
  std::vector<std::string> names;
  for (const log_file_t& file : header.files) names.push_back(file.path);
  log::find_files_again(header, log);
  const world::ResourceFinder finder(header.world_file, false);
  log::Digests digests;
  std::set<std::string> attached;
  auto bytes = static_cast<uint64_t>(rest_->size());
  for (size_t i = 0; i < names.size(); ++i) {
    const log_file_t& file = header.files[i];
    if (!finder.reaches(file.path) || digests.of(file.path) != file.sha256 ||
        !attached.insert(names[i]).second)
      continue;
    require_room(bytes += fs::file_size(file.path));
    out_->add_attachment(names[i], "application/octet-stream", file.path);
  }
}

std::string Rosbag::metadata() const {
  const bool old = options_.distro == ros2::Distro::humble || options_.distro == ros2::Distro::iron;
  std::string topics;
  for (const auto& [name, recorded] : topics_) {
    const ros2::Topic& topic = recorded.topic;
    topics += fmt::format(
        "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: "
        "cdr\n",
        topic.name, topic.type);
    topics += old ? "        offered_qos_profiles: " +
                        quoted(qos_profile(topic.qos, options_.distro, "")) + "\n"
                  : "        offered_qos_profiles:\n" +
                        qos_profile(topic.qos, options_.distro, "          ") + "\n";
    if (!old)
      topics += fmt::format("        type_description_hash: {}\n",
                            ros2::type_hash(topic.type, options_.distro));
    topics += fmt::format("      message_count: {}\n", recorded.messages);
  }
  const uint64_t duration = end_ns_ - begin_ns_, count = out_->messages();
  std::string text = fmt::format(
      "rosbag2_bagfile_information:\n  version: {}\n  storage_identifier: mcap\n  duration:\n    "
      "nanoseconds: {}\n"
      "  starting_time:\n    nanoseconds_since_epoch: {}\n  message_count: {}\n  "
      "topics_with_message_count:{}\n{}"
      "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {}\n"
      "  files:\n    - path: {}\n      starting_time:\n        nanoseconds_since_epoch: {}\n      "
      "duration:\n        nanoseconds: {}\n"
      "      message_count: {}\n",
      old ? 5 : 9, duration, begin_ns_, count, topics.empty() ? " []" : "", topics, quoted(file_),
      quoted(file_), begin_ns_, duration, count);
  if (!old)
    text += fmt::format("  custom_data: ~\n  ros_distro: {}\n", ros2::name_of(options_.distro));
  return text;
}

void Rosbag::pack_rest() {
  rest_->flush();
  if (!rest_->error().empty()) throw EnvironmentError(rest_file_ + ": " + rest_->error());
  log::pack_file(rest_file_, packed_rest_file());
}

uint64_t Rosbag::find_size() {
  pack_rest();
  return out_->size() + fs::file_size(packed_rest_file());
}

void Rosbag::finish(const std::optional<log_header_t>& header, const std::string& log) {
  pack_rest();
  std::error_code error;
  fs::remove(rest_file_, error);
  out_->add_attachment(kRest, "application/zstd", packed_rest_file());
  fs::remove(packed_rest_file(), error);
  if (header) attach_files(*header, log);
  out_->finish();
  write_file((fs::path(folder_) / "metadata.yaml").string(), metadata());
  finished_ = true;
  leftover_.reset();
}

}  // namespace ruedo::ros2
