// A network of this program's own: no message comes in from outside or goes out.
#pragma once

namespace ruedo::cli {

// Starts this program again, with its arguments, in a network namespace in which multicast goes
// over the loopback device; there it returns true. False where the system has no namespaces for
// this user. Call it before any thread is made.
bool isolate();

}  // namespace ruedo::cli
