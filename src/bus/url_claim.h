// A server's claim to an LCM address: one at a time in each network, with its description.
//
// The claim is a local socket with an abstract name: it belongs to the network namespace, is the
// same for all users of the host, and vanishes with the process, however that ends.
#pragma once

#include <mutex>
#include <string>
#include <thread>

#include "bus/lcm_url.h"
#include "system/file_handle.h"

namespace ruedo::bus {

class UrlClaim {
 public:
  UrlClaim() = default;
  // Claims an address; memq addresses are free for all. `owner`: one line that describes this
  // server. Throws EnvironmentError with the line of another one, if it has the claim.
  UrlClaim(const LcmUrl& url, std::string owner);
  ~UrlClaim();
  UrlClaim(const UrlClaim&) = delete;
  UrlClaim& operator=(const UrlClaim&) = delete;

  // Changes the line.
  void describe(std::string owner);

 private:
  void answer();

  FileHandle socket_, stop_;
  std::mutex mutex_;
  std::string owner_;
  std::thread thread_;
};

// The line of the server that has claimed the address; "" when none has.
std::string claimed_by(const LcmUrl& url);

}  // namespace ruedo::bus
