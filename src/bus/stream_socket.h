// Sockets to a server: over TCP, or on this machine.
#pragma once

#include <string>

#include "system/file_handle.h"

namespace ruedo::bus {

// A stream socket whose connect() and send() give up after some seconds: a server that reads
// nothing blocks no caller for longer.
FileHandle stream_socket(int family);

// Connects to a TCP server; empty if none answers, with the reason in `why`.
FileHandle connect_tcp(const std::string& host, const std::string& port, std::string& why);

}  // namespace ruedo::bus
