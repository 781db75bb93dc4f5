// Eight threads subscribe, publish and leave while a ninth receives; hammer.py explains the test.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "transport/bus.h"

using namespace ruedo::client;

namespace {

constexpr int kThreads = 8, kChannels = 4;

void publish(Bus& bus, const std::string& channel, const std::string& text) {
  bus.publish(channel, reinterpret_cast<const uint8_t*>(text.data()), text.size());
}

void hammer(Bus& bus, int number, int count, std::chrono::steady_clock::time_point end,
            std::atomic<int64_t>& heard) {
  const std::string name = "hammer/" + std::to_string(number) + "/";
  const Bus::Handler hear = [&](const uint8_t*, size_t) {
    const int64_t now = ++heard;
    if (now % 7 == 0)
      bus.subscribe("hammer/within" + std::to_string(number), [](const uint8_t*, size_t) {})
          .close();
    if (now % 50 == 1) throw 42;  // an exception of a callback is harmless
  };
  for (int done = 0; done < count || std::chrono::steady_clock::now() < end; ++done) {
    const Subscription own = bus.subscribe(name + std::to_string(done % kChannels), hear);
    const Subscription shared =
        bus.subscribe("hammer/shared" + std::to_string(done % kChannels), hear);
    for (int k = 0; k < kChannels; ++k) {
      publish(bus, "hammer/shared" + std::to_string(k), "shared");
      publish(bus, name + std::to_string(k), std::string(300, 'o'));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  Bus bus(open_transport(argv[1]));
  std::atomic<int64_t> heard{0};
  // The threads' subscriptions may all be closed before an echo comes; this one stays open.
  const Subscription standing = bus.subscribe("hammer/shared0", [&](const uint8_t*, size_t) {
    if (++heard % 50 == 1) throw 42;
  });
  bus.start();
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::milliseconds(static_cast<int64_t>(1e3 * std::atof(argv[3])));
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i)
    threads.emplace_back([&, i] { hammer(bus, i, std::atoi(argv[2]), end, heard); });
  for (std::thread& thread : threads) thread.join();
  std::atomic<bool> through{false};
  const Subscription last =
      bus.subscribe("hammer/last", [&](const uint8_t*, size_t) { through = true; });
  while (!through) {
    publish(bus, "hammer/last", "last");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  bus.close();
  std::printf("heard %s\n", heard > 0 ? "True" : "False");
}
