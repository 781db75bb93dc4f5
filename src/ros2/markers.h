// What clients draw as visualization_msgs/MarkerArray: a layer is a namespace.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ruedo/markers_t.hpp"

namespace ruedo::ros2 {

class MarkerArrays {
 public:
  static constexpr const char* kType = "visualization_msgs/msg/MarkerArray";

  // CDR by which a viewer shows these markers in place of the layer's earlier ones. frame: in which
  // they stand. They are those of a run: see engine::check_markers().
  std::vector<uint8_t> message(const markers_t& markers, int64_t utime, const std::string& frame);

 private:
  std::map<std::string, size_t> shown_;  // how many, by layer
};

}  // namespace ruedo::ros2
