#include "system/file_handle.h"

#include <cerrno>

namespace ruedo {

size_t write_all(int file, const void* data, size_t size) {
  size_t done = 0;
  while (done < size) {
    const ssize_t count = ::write(file, static_cast<const char*>(data) + done, size - done);
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) errno = ENOSPC;
    if (count <= 0) break;
    done += static_cast<size_t>(count);
  }
  return done;
}

}  // namespace ruedo
