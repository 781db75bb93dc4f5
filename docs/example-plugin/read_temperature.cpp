// Prints the thermometer's messages: as a stream of its own type, in lockstep, and as
// bytes.
#include <cstdio>

#include <ruedo/client.h>

#include "example/thermometer_t.hpp"

int main() {
  auto sim = ruedo::client::connect();
  const auto temp = sim.robot("rover").stream<example::thermometer_t>("temp");
  if (sim.lockstep()) {
    for (const auto& message : sim.step(40).all(temp))
      std::printf("%g s: %.6f\n", 1e-6 * static_cast<double>(message.utime), message.temperature);
  } else {
    std::printf("%.6f, %zu bytes\n", temp.latest().temperature,
                sim.robot("rover").raw_stream("temp").latest().bytes.size());
  }
}
