// Whether raw pictures get through on this machine: for `ruedo doctor --ros2`.
#pragma once

namespace ruedo::dds {

struct PictureCount {
  int sent = 0;
  int arrived = 0;
  int buffer = 0;  // bytes, of the reader's socket: net.core.rmem_default
};

// Sends raw pictures of 640 x 480 over the loopback interface to a best-effort reader, at 15 Hz for
// two seconds of real time. The reader's socket has the system's default buffer, as a reader on
// Fast DDS has it (configure_buffer_sizes() in its asio_helpers.hpp). Throws EnvironmentError if
// Cyclone finds no usable network or the reader is not found.
PictureCount send_pictures_to_self();

}  // namespace ruedo::dds
