// RTPS 2.5, 8.5.3 (SPDP), 8.5.4 (SEDP), 9.4.2.11 (parameter lists), 9.6 (what they contain).
#include "bridges/dds/discovery_data.h"

#include <algorithm>
#include <functional>
#include <string_view>

namespace ruedo::dds {
namespace {

using Bytes = std::span<uint8_t>;

constexpr uint8_t kBigEndianList = 2, kLittleEndianList = 3;  // encodings of a payload
// Unicast and multicast ones of an endpoint, and those that a participant's endpoints have.
constexpr uint16_t kLocators[] = {0x2f, 0x30, 0x31, 0x32, 0x33, 0x48};
// RTPS 1's addresses and ports; type information, for which Cyclone 0.10 would ask for the types,
// and crash on those of Fast DDS 3 (ROS 2 Kilted) while several participants answer; Cyclone's
// parameter by which a participant may announce others.
constexpr uint16_t kRefused[] = {0x0b, 0x0c, 0x0d, 0x0e, 0x11, 0x45, 0x46, 0x75, 0x8007};

bool is_among(uint32_t id, std::span<const uint16_t> ids) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

void erase(Bytes parameter) { std::fill_n(parameter.begin(), 2, uint8_t{kPad}); }

uint32_t number_at(Bytes bytes, size_t at, size_t size, bool little) {
  uint32_t value = 0;
  for (size_t i = 0; i < size; ++i)
    value |= uint32_t{bytes[at + i]} << 8 * (little ? i : size - 1 - i);
  return value;
}

// Calls what(parameter with its head, id, value). Where the list ends; none: it does not.
template <class Do>
std::optional<size_t> for_each_parameter(Bytes list, bool little, Do what) {
  for (size_t at = 0; at + 4 <= list.size();) {
    const uint32_t id = number_at(list, at, 2, little), size = number_at(list, at + 2, 2, little);
    if (id == kSentinel) return at + 4;
    if (at + 4 + size > list.size()) return std::nullopt;
    what(list.subspan(at, 4 + size), id, list.subspan(at + 4, size));
    at += 4 + size;
  }
  return std::nullopt;
}

class Reader {
 public:
  Reader(const Prefix& who, Parameter guid) : who_(who), guid_(guid) {}

  std::optional<DiscoveryData> read(const Submessage& part) {
    constexpr size_t kOffset = 6;  // of what follows it
    const size_t begin = kOffset + 2 + part.number(kOffset, 2);
    if (begin > part.bytes.size() || part.bytes.size() > kMostTold) return std::nullopt;
    Bytes rest = part.bytes.subspan(begin);
    const uint8_t flags = part.bytes[1];
    const bool is_whole = (!(flags & kHasInlineQos) || inline_qos(part, rest)) &&
                          (!(flags & (kHasPayload | kHasKey)) || payload(rest));
    return is_whole && of_own_ && !of_others_ ? std::optional(found_) : std::nullopt;
  }

 private:
  void take_guid(Bytes value) {
    if (value.size() < kPrefix + found_.entity.size()) return;
    (std::equal(who_.begin(), who_.end(), value.begin()) ? of_own_ : of_others_) = true;
    std::copy_n(value.begin() + kPrefix, found_.entity.size(), found_.entity.begin());
  }

  // Moves `rest` behind it.
  bool inline_qos(const Submessage& part, Bytes& rest) {
    const auto end =
        for_each_parameter(rest, part.is_little_endian(), [&](Bytes, uint32_t id, Bytes value) {
          if (id == kKeyHash) take_guid(value);
          if (id == kStatus && value.size() >= 4) found_.leaves = (value[3] & 3) != 0;
        });
    rest = rest.subspan(end.value_or(0));
    return end.has_value();
  }

  bool payload(Bytes bytes) {
    if (bytes.size() < 4 || bytes[0] != 0) return false;
    const bool little = bytes[1] == kLittleEndianList;
    if (!little && bytes[1] != kBigEndianList) return false;
    const auto take = [&](Bytes parameter, uint32_t id, Bytes value) {
      if (id == guid_) take_guid(value);
      if (id == kTopicName) {
        const std::string_view name(reinterpret_cast<const char*>(value.data()), value.size());
        found_.topic = std::hash<std::string_view>{}(name);
      }
      if (is_among(id, kLocators) && value.size() >= sizeof(Locator)) {
        ToldLocator& told = found_.locators.emplace_back();
        told.parameter = parameter;
        std::copy_n(value.begin(), told.locator.size(), told.locator.begin());
      }
      if (is_among(id, kRefused)) erase(parameter);
    };
    return for_each_parameter(bytes.subspan(4), little, take).has_value();
  }

  Prefix who_;
  Parameter guid_;
  bool of_own_ = false, of_others_ = false;
  DiscoveryData found_;
};

}  // namespace

void ToldLocator::erase() const { dds::erase(parameter); }

std::optional<DiscoveryData> discovery_data(const Submessage& part, const Prefix& who,
                                            Parameter guid) {
  return Reader(who, guid).read(part);
}

}  // namespace ruedo::dds
