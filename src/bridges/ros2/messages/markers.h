// Clients' drawings as visualization_msgs/MarkerArray: a layer is a namespace.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bridges/ros2/messages/cdr.h"
#include "bridges/ros2/messages/names.h"
#include "bridges/ros2/transport.h"
#include "ruedo/markers_t.hpp"

namespace ruedo::ros2 {

class MarkerArrays {
 public:
  static constexpr const char* kType = "visualization_msgs/msg/MarkerArray";

  // CDR by which a viewer shows these markers in place of the layer's earlier ones. frame: in which
  // they stand. They are those of a run: see engine::check_markers().
  std::vector<uint8_t> message(const markers_t& markers, int64_t utime, const std::string& frame);

 private:
  std::map<std::string, size_t> shown_;  // how many, by layer that has any
};

// An arrow, which is gone a moment later; for a message of markers. Positions in the frame, m.
struct Arrow {
  const double *from, *to;
  std::string text;
};
void put_arrow(CdrWriter& out, int64_t utime, const std::string& frame, const std::string& layer,
               int32_t id, const Arrow& arrow);

// The drawings of clients in a run, on a topic of its own. A later reader gets the newest of each
// layer: a writer keeps one message for later readers, of one layer.
class DrawnTopic {
 public:
  static constexpr size_t kMostLayers = 64;  // the newest of them; others are deleted

  DrawnTopic(std::unique_ptr<Writer> writer, const Names& names);

  // A client's drawing, from a record of the run; other records are ignored.
  void take(std::span<const uint8_t> record, int64_t utime);
  // Finds readers that have come since the last time.
  void look(int64_t utime);
  const Writer& writer() const { return *writer_; }

 private:
  void send(const markers_t& markers, int64_t utime);

  std::unique_ptr<Writer> writer_;
  const Names& names_;
  MarkerArrays arrays_;
  std::vector<markers_t> layers_;  // that have something, the newest last
  size_t readers_ = 0;
};

}  // namespace ruedo::ros2
