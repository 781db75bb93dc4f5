// How Cyclone DDS is configured: by ROS's variables, and by what CYCLONEDDS_URI says.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>

namespace ruedo::dds {

// The range of discovery, as in ROS_AUTOMATIC_DISCOVERY_RANGE.
enum class Range { off, localhost, subnet, system_default };

struct CycloneOptions {
  uint32_t domain = 0;
  Range range = Range::localhost;
  std::string static_peers;  // separated by ';'
  std::string own;           // the user's own configuration, as CYCLONEDDS_URI has it
};

// From ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_LOCALHOST_ONLY, ROS_STATIC_PEERS and
// CYCLONEDDS_URI. Warns of static peers that have no effect, and of ROS_SECURITY_ENABLE. Throws
// InputError.
CycloneOptions options_from_environment();

// For dds_create_domain().
std::string configuration(const CycloneOptions& options);

// The elements of Cyclone's configuration that a user sets for a domain.
class UserSettings {
 public:
  // uris: XML, or files that have some, separated by commas, as in CYCLONEDDS_URI.
  UserSettings(const std::string& uris, uint32_t domain);

  // Names are compared as Cyclone does, without regard to case.
  bool has(std::string_view element) const;

  // Why the first of them cannot be read; "": all can. Cyclone's own parser is less strict.
  const std::string& unreadable() const { return unreadable_; }

 private:
  std::set<std::string> names_;  // in lower case
  std::string unreadable_;
};

}  // namespace ruedo::dds
