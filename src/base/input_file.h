// Files that others wrote: what is read of them goes through here.
//
// A file is opened once and never waited for, so that a FIFO cannot stall the program, a device
// cannot feed it for ever, and what was looked at is what is read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

namespace ruedo {

struct InputFile {
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file;
  int64_t size = 0;  // bytes, as it was opened
};

// A regular file, at its beginning. Throws InputError that names the file and what is wrong with
// it.
InputFile open_input(const std::string& path);

// Likewise, to see what kind of file it is: nothing is made from it, and it may still be written.
InputFile open_to_look(const std::string& path);

// The bytes of a regular file. Throws InputError, also for more than max_bytes.
std::string read_input(const std::string& path, size_t max_bytes);

// That a file is read for what this process makes, also where a part of it, or another program,
// reads it later. open_input() notes what it opens.
void note_read(const std::string& path);

// By whatever name.
bool was_read(const std::string& path);

}  // namespace ruedo
