// Messages as Foxglove shows them: frames, scans, pictures, poses, the scene. Messages and fields
// that its types lack are sent as JSON of Ruedo's own types.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "bridges/foxglove/foxglove_schemas.h"
#include "log/mcap_writer.h"
#include "ruedo/camera_info_t.hpp"
#include "ruedo/image_t.hpp"
#include "ruedo/navsat_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/pose_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "ruedo/world_state_t.hpp"
#include "run/repeat/log_worlds.h"
#include "world/model/world_model.h"

namespace ruedo::foxglove {

// Where the messages go: a file, or viewers.
class FoxgloveOutput {
 public:
  virtual ~FoxgloveOutput() = default;
  // Both return an id. schema: JSON Schema; messages are JSON.
  virtual uint16_t add_schema(const std::string& name, const std::string& schema) = 0;
  virtual uint16_t add_channel(uint16_t schema, const std::string& topic) = 0;
  // key: of what holds until the next message of that key; "": of nothing.
  virtual void add_message(uint16_t channel, uint64_t time_ns, const std::string& json,
                           const std::string& key) = 0;
  // False if no client reads this topic, or TOPIC/values.
  virtual bool wants(const std::string& topic) const {
    static_cast<void>(topic);
    return true;
  }
};

class FoxgloveFile : public FoxgloveOutput {
 public:
  explicit FoxgloveFile(log::McapWriter& file) : file_(file) {}
  uint16_t add_schema(const std::string& name, const std::string& schema) override {
    return file_.add_schema(name, "jsonschema", schema);
  }
  uint16_t add_channel(uint16_t schema, const std::string& topic) override {
    return file_.add_channel(schema, topic, "json");
  }
  void add_message(uint16_t channel, uint64_t time_ns, const std::string& json,
                   const std::string&) override {
    file_.add_message(channel, time_ns, json);
  }

 private:
  log::McapWriter& file_;
};

class FoxgloveExport {
 public:
  // Topics whose last message holds until another scene begins.
  static constexpr const char *kFrames = "ruedo/frames", *kScene = "ruedo/scene";

  explicit FoxgloveExport(FoxgloveOutput& out) : out_(out) {}

  // The run from now on: frames of robots and devices, and the look of the world.
  void begin_scene(const run::LogWorlds::Scene& scene, uint64_t time_ns);
  // A message as it came. One of an unknown type, or damaged, is left out and counted.
  void add(const std::string& channel, uint64_t time_ns, std::span<const uint8_t> message);

  // A client's drawing, in a markers_t or an applied_t; false for other messages.
  bool add_drawn(uint64_t time_ns, std::span<const uint8_t> message);

  uint64_t left_out() const { return left_out_; }

 private:
  uint16_t channel(const std::string& topic, const std::string& name, const std::string& schema);
  void send(const std::string& topic, const Type& type, uint64_t time_ns, const std::string& json);
  void send_frames(const run::LogWorlds::Scene& scene, uint64_t time_ns);
  void send_scene(const world::WorldModel& world, uint64_t time_ns);
  std::string device_frame(const std::string& channel) const;
  struct Place {
    const std::string& channel;
    uint64_t time_ns;
  };
  // How much of a message Foxglove's own type says: partly is followed by our own values.
  enum class Shown { no, partly, wholly };
  Shown convert(const Place& place, std::span<const uint8_t> message);
  Shown show(const planar_lidar_t& scan, const Place& place);
  Shown show(const image_t& image, const Place& place);
  Shown show(const camera_info_t& camera, const Place& place);
  Shown show(const pose_t& pose, const Place& place);
  Shown show(const navsat_t& navsat, const Place& place);
  Shown show(const odometry_t& odometry, const Place& place);
  Shown show(const world_state_t& state, const Place& place);

  FoxgloveOutput& out_;
  std::map<std::string, uint16_t> schemas_, channels_;
  std::map<std::string, std::string> device_of_channel_;  // "p3at/camera/info": "p3at/camera"
  std::map<int, std::string> bodies_;                     // names, by index
  std::set<std::string> body_names_;
  bool scene_sent_ = false;
  uint64_t left_out_ = 0;
};

}  // namespace ruedo::foxglove
