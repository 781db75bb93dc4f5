// Where the messages of a log are. All but the last ones of each channel are in a temporary file
// without a name, so that memory does not grow with the log.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "ruedo/sim_time.h"
#include "system/file_handle.h"

namespace ruedo::log {

struct Place {
  SimTime time_us = 0;
  int64_t offset = 0;  // of the event in the log
  uint32_t size = 0;   // bytes of the log up to the next event
};

// The file that the channels of a log share. Made when it is first needed, in $TMPDIR or /var/tmp.
class PlacesFile {
 public:
  // Both throw EnvironmentError. append() returns where they begin.
  int64_t append(std::span<const Place> places);
  void read(int64_t at, std::span<Place> places) const;

 private:
  FileHandle file_;
  int64_t size_ = 0;
};

// The places of a channel's messages, by time. Reading is safe in several threads.
class Places {
 public:
  // page: so many are written at a time.
  Places(std::shared_ptr<PlacesFile> file, size_t page) : file_(std::move(file)), page_(page) {}

  void push_back(const Place& place);
  size_t size() const { return pages_.size() * page_ + last_.size(); }
  bool empty() const { return size() == 0; }
  Place operator[](size_t i) const;
  Place back() const { return (*this)[size() - 1]; }
  // How many there are up to that time, itself included.
  size_t count_until(SimTime time_us) const;

  // Goes through them from the first on, with few reads of the file.
  class Cursor {
   public:
    explicit Cursor(const Places& places) : places_(&places) {}
    const Place* next();  // null after the last; valid until the next call

   private:
    const Places* places_;
    std::vector<Place> read_;
    size_t begin_ = 0, next_ = 0;  // of read_ in all places, and in read_
  };

 private:
  struct Page {
    SimTime begin_us;
    int64_t at;  // in the file
  };

  // Up to so many from the i-th on, without crossing a page's end.
  void read(size_t i, size_t most, std::vector<Place>& places) const;

  std::shared_ptr<PlacesFile> file_;
  size_t page_;
  std::vector<Page> pages_;
  std::vector<Place> last_;  // after those in the file
};

}  // namespace ruedo::log
