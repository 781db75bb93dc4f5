// Reads standard LCM logs, event by event, those that were cut off included.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/input_file.h"
#include "base/progress.h"
#include "ruedo/sim_time.h"

namespace ruedo::log {

struct Event {
  int64_t number = 0;
  SimTime timestamp_us = 0;
  std::string channel;
  std::vector<uint8_t> data;
};

class Reader {
 public:
  // Throws InputError when the file cannot be opened, or is not an LCM log.
  // doing: in a terminal's line, before the path.
  explicit Reader(const std::string& path, const std::string& doing = "reading");

  // Reads the next whole event; false at the end, or where the log was cut off or is damaged: see
  // fault(). The event's buffers are reused. wanted: of other channels the data is passed over, and
  // left empty.
  bool next(Event& event, const std::function<bool(const std::string& channel)>& wanted = {});

  // The next event is that at this byte, where offset() was before one.
  void seek(int64_t offset);

  // Skips nearly all events that are earlier than that time, and no others: finds the place by
  // halves, in a log whose times never go back.
  void seek_time(SimTime time_us);

  // After next() returned false: "" at a proper end, else what is wrong and at which byte.
  const std::string& fault() const { return fault_; }
  const std::string& path() const { return path_; }
  int64_t size() const { return size_; }      // bytes of the file
  int64_t offset() const { return offset_; }  // bytes read

 private:
  bool read_event(Event& event, const std::function<bool(const std::string&)>& wanted);
  bool read(void* into, size_t size);
  bool skip(size_t size);

  std::string path_;
  std::unique_ptr<std::FILE, InputFile::Close> file_;
  int64_t size_ = 0;
  int64_t offset_ = 0;
  std::string fault_;
  std::optional<Progress> progress_;  // while it is read from one end to the other
};

}  // namespace ruedo::log
