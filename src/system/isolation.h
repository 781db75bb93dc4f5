// A network of this program's own: no message comes in from outside or goes out.
#pragma once

namespace ruedo {

// Moves this program into a network namespace in which multicast goes over the loopback device.
// False where the system has no namespaces for this user. Call it before any thread is made.
bool isolate();

}  // namespace ruedo
