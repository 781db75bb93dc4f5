// A log as a ROS 2 bag: a folder with an MCAP file of CDR messages and the metadata.yaml by which
// rosbag2 finds it.
//
// Messages that no topic holds in full are in attachments, which ROS's readers ignore: a log of
// those messages (kRest), and the files of the world. BagLog restores the log from all of
// it.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridges/ros2/messages/conversions.h"
#include "bridges/ros2/messages/markers.h"
#include "log/mcap_writer.h"
#include "log/writer.h"
#include "ruedo/log_header_t.hpp"
#include "run/repeat/log_worlds.h"
#include "system/leftovers.h"

namespace ruedo::ros2 {

class Rosbag {
 public:
  // Makes the folder (no slash at its end). Throws InputError when it is there already, and
  // EnvironmentError when it cannot be made.
  Rosbag(const std::string& folder, ros2::ConversionOptions options);
  ~Rosbag();  // a bag that was not finished is removed

  // The run that the next messages are of.
  void begin_scene(const run::LogWorlds::Scene& scene, uint64_t time_ns);
  // A message as it came; one that ROS has no type for, or that is damaged, is left out and
  // counted.
  void add(const std::string& channel, uint64_t time_ns, std::span<const uint8_t> message);
  // header: of the log, whose file is `log`; files of it that are gone or changed are left out.
  void finish(const std::optional<log_header_t>& header, const std::string& log);

  // Of the attachment, and of a topic's metadata: the bus's channel whose messages it says in full.
  static constexpr const char* kRest = "run.lcm.zst";
  static constexpr const char* kPlainRest = "run.lcm";  // in the bags of earlier versions
  static constexpr const char* kChannel = "ruedo_channel";
  // Of a bag's attachments: each is a file again while the bag is shown.
  static constexpr uint64_t kMostAttachedBytes = uint64_t{16} << 30;
  static constexpr size_t kMostAttachments = 10'001;  // the files of a log's header, and kRest

  uint64_t messages() const { return out_->messages(); }
  // Bytes of the bag, with those of the rest that is attached at its end: packed for this.
  uint64_t find_size();
  uint64_t left_out() const { return left_out_; }

 private:
  struct Recorded {
    ros2::Topic topic;
    uint16_t channel;
    std::string says_all_of;  // a channel of the bus
    uint64_t messages = 0;
  };

  // says_all_of: the channel whose message this one says in full, or "". Returns whether a reader
  // of the bag learns that.
  bool write(const ros2::Topic& topic, uint64_t time_ns, std::span<const uint8_t> cdr,
             const std::string& says_all_of = "");
  // A client's drawing; false for other messages.
  bool add_drawn(uint64_t time_ns, std::span<const uint8_t> message);
  void attach_files(log_header_t header, const std::string& log);
  void require_room(uint64_t attached_bytes) const;
  std::string packed_rest_file() const { return rest_file_ + ".zst"; }
  void pack_rest();  // into packed_rest_file()
  std::string metadata() const;

  std::string folder_, file_, rest_file_;
  std::optional<Leftover> leftover_;  // the folder, until it is a bag
  ros2::ConversionOptions options_;
  std::optional<ros2::Names> names_;
  std::unique_ptr<log::McapWriter> out_;
  std::unique_ptr<log::Writer> rest_;
  std::unique_ptr<ros2::Conversions> conversions_;
  ros2::MarkerArrays markers_;
  std::map<std::string, uint16_t> schemas_;
  std::map<std::string, Recorded> topics_;  // by name and type
  uint64_t begin_ns_ = 0, end_ns_ = 0, left_out_ = 0;
  bool finished_ = false;
};

}  // namespace ruedo::ros2
