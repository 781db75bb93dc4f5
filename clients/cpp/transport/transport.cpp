// Chooses the transport of an address.
#include "transport/transport.h"

#include "transport/address.h"
#include "transport/multicast_transport.h"
#include "transport/stream_transport.h"

namespace ruedo::client {

std::unique_ptr<Transport> open_transport(const std::string& url) {
  check_reachable(url);
  const bus::LcmUrl address = read_address(url);
  if (address.scheme == "udpm") return std::make_unique<MulticastTransport>(address);
  return std::make_unique<StreamTransport>(address);
}

}  // namespace ruedo::client
