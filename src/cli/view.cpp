// The one place where commands meet the console.
#include "cli/view.h"

#include <fmt/format.h>

#include "ruedo/errors.h"

#ifdef RUEDO_CONSOLE

#include "console/console.h"
#include "console/live_source.h"
#include "console/tee_bus.h"
#include "ruedo/world_info_t.hpp"
#include "server/server.h"

namespace ruedo::cli {

struct ViewedBus::Impl {
  console::Address address;
  console::TeeBus tee;
};

ViewedBus::ViewedBus(Bus& bus, bool viewed, const std::string& address) : inner_(bus) {
  if (viewed) impl_.reset(new Impl{console::parse_address(address), console::TeeBus(bus)});
}

ViewedBus::~ViewedBus() = default;

Bus& ViewedBus::bus() { return impl_ ? impl_->tee : inner_; }

std::shared_ptr<void> ViewedBus::open(server::Server& server, const std::string& title) {
  if (!impl_) return nullptr;
  std::string info;
  for (const server::Channel& channel : server.channels().list()) {
    if (channel.name == "ruedo/info") info = channel.bus_name;
  }
  auto source = std::make_unique<console::LiveSource>(impl_->tee, [&server] { return server.world(); }, info);
  auto serving = std::make_shared<console::Console>(impl_->address, std::move(source), "live", title);
  for (const std::string& url : serving->urls()) fmt::print("View it at {}\n", url);
  std::fflush(stdout);
  return serving;
}

}  // namespace ruedo::cli

#else

namespace ruedo::cli {

struct ViewedBus::Impl {};

ViewedBus::ViewedBus(Bus& bus, bool viewed, const std::string&) : inner_(bus) {
  if (viewed) {
    throw EnvironmentError("--view: this ruedo was built without the web console. Install nodejs, npm and libwebsockets-dev, then "
                           "configure with -DRUEDO_CONSOLE=ON and build again");
  }
}

ViewedBus::~ViewedBus() = default;

Bus& ViewedBus::bus() { return inner_; }

std::shared_ptr<void> ViewedBus::open(server::Server&, const std::string&) { return nullptr; }

}  // namespace ruedo::cli

#endif
