// The one way to write a file at once: whole, or not at all.
#pragma once

#include <string>
#include <string_view>

namespace ruedo {

// The bytes go into a new file beside it that takes its name at the end: when the disk is full,
// what was there before stays. Devices and FIFOs are written to as they are. Throws
// EnvironmentError that names the file and the reason.
void write_file(const std::string& path, std::string_view bytes);

}  // namespace ruedo
