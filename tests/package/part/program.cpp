// Says which server launch() would start; compiled as C++17, which the public headers are written
// in.
#include <ruedo/client.h>

#include <cstdio>

static_assert(__cplusplus == 201703L, "Ruedo's target changed the standard of this project");

int main() {
  std::puts(ruedo::client::LaunchOptions{}.program.c_str());
  try {
    ruedo::client::connect("unix:///nowhere", {"test", 0.1});
  } catch (const ruedo::client::NoServer& error) {
    std::puts(error.what());
    return 0;
  }
  return 1;
}
