// Which topics others publish, whether or not anything here reads them.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include <dds/dds.h>

namespace ruedo::dds {

class Publications {
 public:
  // Throws EnvironmentError.
  explicit Publications(dds_entity_t participant);
  ~Publications() { dds_delete(reader_); }
  Publications(const Publications&) = delete;
  Publications& operator=(const Publications&) = delete;

  // Whether a writer of another participant has these DDS names now. From one thread at a time.
  bool has(const std::string& topic, const std::string& type);

 private:
  using Guid = std::array<uint8_t, 16>;
  using Names = std::pair<std::string, std::string>;  // of a topic and its type
  void look();
  void forget(const Guid& writer);

  Guid own_{};  // the participant's
  dds_entity_t reader_;
  std::map<Guid, Names> writers_;
  std::map<Names, size_t> counts_;  // of writers
};

}  // namespace ruedo::dds
