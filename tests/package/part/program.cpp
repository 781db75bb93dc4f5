// Says which server launch() would start; compiled with the project's standard: C++17, in which the
// public headers are written, or a later one.
#include <ruedo/client.h>

#include <cstdio>

static_assert((__cplusplus == 201703L) == (STANDARD == 17),
              "Ruedo's target changed the standard of this project");

int main() {
  std::puts(ruedo::client::LaunchOptions{}.program.c_str());
  try {
    (void)ruedo::client::connect("unix:///nowhere", {"test", 0.1});
  } catch (const ruedo::client::NoServer& error) {
    std::puts(error.what());
    return 0;
  }
  return 1;
}
