// Writes a standard LCM log: what lcm-logplayer, lcm-spy and lcm::LogFile read.
//
// Buffered, and flushed at whole events: a log that was cut off by a full disk or a kill is
// readable up to there.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "system/file_handle.h"

namespace ruedo::log {

class Writer {
 public:
  // Creates or empties the file. Throws EnvironmentError when that fails. wait: called again and
  // again while a FIFO has no reader; what it throws ends that. Without one, the wait has no end.
  explicit Writer(const std::string& path, const std::function<void()>& wait = {});
  // Takes over an open, empty file. name: for messages.
  Writer(int file, std::string name);
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // The number of the next event; later ones count on from there. Of an empty log.
  void number_from(int64_t first) { first_number_ = first; }

  // Adds an event. After a failure this does nothing: see error().
  void write(int64_t timestamp_us, const std::string& channel, const uint8_t* data, size_t size);

  // Writes all events to the operating system.
  void flush();

  // Whether its name still leads to the file, and the file holds all that was written: see error().
  void look_for_file();

  // Begins with an empty file again, whatever went wrong before.
  void truncate();

  // Adds the events of another log that was written from its beginning and flushed, to an empty
  // one. Returns the error, or "".
  std::string append(const Writer& other);
  // Adds so many events of a log, which lie at these bytes of its file. Returns the error, or "".
  std::string append(const std::string& path, int64_t begin, int64_t end, int64_t events);

  // The error ("no space left on device"), or "". The file then ends with the last whole
  // event that had room.
  const std::string& error() const { return error_; }
  // After an error: others have removed, replaced or truncated the file.
  bool is_lost() const { return lost_; }
  const std::string& path() const { return path_; }
  // Bytes written, with those that are still buffered.
  int64_t size() const { return written_ + static_cast<int64_t>(buffer_.size()); }
  int64_t events() const { return events_; }

 private:
  std::string copy(int file, const std::string& path, int64_t begin, int64_t end);
  void fail(int error_number);
  void lose(const std::string& how);
  bool is_whole();

  std::string path_;
  FileHandle file_;
  std::vector<uint8_t> buffer_;
  std::vector<size_t> ends_;  // where the events in the buffer end
  int64_t written_ = 0;       // bytes of whole events in the file
  int64_t events_ = 0;
  int64_t first_number_ = 0;
  std::string error_;
  bool lost_ = false;
};

}  // namespace ruedo::log
