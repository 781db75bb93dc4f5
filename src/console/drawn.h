// The drawings of clients in a run (markers_t), from its log: the newest message of each layer at
// any time. Only the messages' places are kept.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "log/reader.h"

namespace ruedo::console {

// The layer of an encoded markers_t; "" for other bytes.
std::string layer_of(std::span<const uint8_t> message);
// Whether a run would accept it.
bool is_drawn(std::span<const uint8_t> message);
// A markers_t that clears a layer.
std::vector<uint8_t> empty_layer(const std::string& layer);

class Drawn {
 public:
  static constexpr size_t kMostLayers = 64;  // further layers are not shown

  struct Mark {
    SimTime time_us;
    int64_t offset;  // file offset of the event: a markers_t, or the applied_t that contains it
  };
  struct Layer {
    std::string name;
    std::vector<Mark> marks;

    size_t count_until(SimTime time_us) const;
  };

  // In log order.
  void add(const std::string& layer, Mark mark);
  const std::vector<Layer>& layers() const { return layers_; }

  // The message of a layer after that many of them: empty after none, if no run would accept it, or
  // if the file has changed.
  static std::vector<uint8_t> message(const Layer& layer, size_t count, log::Reader& reader);

 private:
  std::vector<Layer> layers_;
};

}  // namespace ruedo::console
