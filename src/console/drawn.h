// What clients drew in a run (markers_t), as its log has it: the newest message of each layer at
// any moment. Of each message only the place is kept.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "log/reader.h"

namespace ruedo::console {

constexpr const char* kMarkersChannel = "ruedo/markers";

// The layer of an encoded markers_t; "" for what is none.
std::string layer_of(std::span<const uint8_t> message);
// Whether a run would take it.
bool is_drawn(std::span<const uint8_t> message);
// A markers_t that empties a layer.
std::vector<uint8_t> empty_layer(const std::string& layer);

class Drawn {
 public:
  static constexpr size_t kMostLayers = 64;  // further ones are not shown

  struct Mark {
    SimTime time_us;
    int64_t offset;  // of the event in the file: of it, or of the applied_t that has it
  };
  struct Layer {
    std::string name;
    std::vector<Mark> marks;

    size_t count_until(SimTime time_us) const;
  };

  // In the order of the log.
  void add(const std::string& layer, Mark mark);
  const std::vector<Layer>& layers() const { return layers_; }

  // The message of a layer after so many of them: empty after none, and where no run would take it
  // or the file is not what it was.
  static std::vector<uint8_t> message(const Layer& layer, size_t count, log::Reader& reader);

 private:
  std::vector<Layer> layers_;
};

}  // namespace ruedo::console
