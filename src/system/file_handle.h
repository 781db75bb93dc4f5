// A file descriptor that closes itself, and writing to one.
#pragma once

#include <cstddef>
#include <utility>

#include <unistd.h>

namespace ruedo {

class FileHandle {
 public:
  explicit FileHandle(int file = -1) : file_(file) {}
  ~FileHandle() {
    if (file_ >= 0) ::close(file_);
  }
  FileHandle(FileHandle&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  FileHandle& operator=(FileHandle&& other) noexcept {
    std::swap(file_, other.file_);
    return *this;
  }
  int get() const { return file_; }
  explicit operator bool() const { return file_ >= 0; }

 private:
  int file_;
};

// Writes all of the bytes, also where signals interrupt it. Returns how many were written: fewer
// than `size` when writing failed, and errno says why.
size_t write_all(int file, const void* data, size_t size);

}  // namespace ruedo
