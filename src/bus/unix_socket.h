// Addresses of Unix-domain sockets.
#pragma once

#include <string>

#include <sys/types.h>

#include "system/file_handle.h"

namespace ruedo::bus {

// Connects to the socket of a server that runs as the same user. Throws EnvironmentError, with the
// cure.
FileHandle connect_unix(const std::string& path);

// True when a server listens there, also when it is stopped.
bool is_unix_served(const std::string& path);

// Listens at a socket of mode 0600, which is there when it can be connected to; what a server left
// behind is replaced. Throws EnvironmentError.
FileHandle listen_unix(const std::string& path);

// The process at the other end, where it is one of this user or of root; else -1.
pid_t own_peer(int socket);

}  // namespace ruedo::bus
