#include "console/drawn.h"

#include <algorithm>

#include "base/big_endian.h"
#include "engine/markers.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/decode.h"
#include "ruedo/markers_t.hpp"
#include "ruedo/schema.h"

namespace ruedo::console {

// After fingerprint and utime come the length of the name (including the final zero) and the name.
std::string layer_of(std::span<const uint8_t> message) {
  constexpr size_t kAt = 16, kName = kAt + 4;
  if (message.size() < kName || fingerprint_of(message) != markers_t::getHash()) return "";
  const auto size = read_big_endian<uint32_t>(&message[kAt]);
  if (size < 1 || size > message.size() - kName) return "";
  const auto name = message.subspan(kName, size - 1);
  return {name.begin(), name.end()};
}

bool is_drawn(std::span<const uint8_t> message) {
  markers_t markers;
  return decode_checked(message.data(), message.size(), markers) == DecodeFault::none &&
         engine::check_markers(markers).empty();
}

std::vector<uint8_t> empty_layer(const std::string& layer) {
  markers_t markers{};
  markers.layer = layer;
  std::vector<uint8_t> bytes(static_cast<size_t>(markers.getEncodedSize()));
  markers.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

size_t Drawn::Layer::count_until(SimTime time_us) const {
  return static_cast<size_t>(
      std::upper_bound(marks.begin(), marks.end(), time_us,
                       [](SimTime time, const Mark& mark) { return time < mark.time_us; }) -
      marks.begin());
}

void Drawn::add(const std::string& name, Mark mark) {
  const auto found = std::find_if(layers_.begin(), layers_.end(),
                                  [&](const Layer& layer) { return layer.name == name; });
  if (found != layers_.end()) {
    found->marks.push_back(mark);
  } else if (layers_.size() < kMostLayers) {
    layers_.push_back({name, {mark}});
  }
}

std::vector<uint8_t> Drawn::message(const Layer& layer, size_t count, log::Reader& reader) {
  log::Event event;
  if (count == 0) return empty_layer(layer.name);
  reader.seek(layer.marks[count - 1].offset);
  if (!reader.next(event)) return empty_layer(layer.name);
  applied_t applied;
  if (decode_checked(event.data.data(), event.data.size(), applied) == DecodeFault::none)
    event.data = std::move(applied.data);
  return is_drawn(event.data) ? std::move(event.data) : empty_layer(layer.name);
}

}  // namespace ruedo::console
