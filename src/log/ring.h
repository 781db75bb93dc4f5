// A log of bounded size for endless runs: the latest messages, and everything that acted on the
// run.
//
// run.lcm gets what repeats the run: the header, what acted, hashes of the state. Beside it,
// run.000001.lcm and so on hold everything, each for a while; when all files together are larger
// than the limit, the oldest goes. Each begins with the header and the requests that had changed
// the world by then, so that it can be played and exported alone. A step is never divided.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "log/writer.h"

namespace ruedo::log {

class Ring {
 public:
  static constexpr int64_t kLeastLimit = int64_t{16} << 20;  // bytes
  static constexpr int kFiles = 8;                           // about so many beside run.lcm
  // Each numbered file begins with what had changed the world by then: half of it at most.
  static constexpr int64_t kPreambleShare = 2 * kFiles;

  // Removes the numbered files of an earlier run, and no others. Throws EnvironmentError when a
  // file cannot be created. wait: as Writer's.
  Ring(const std::string& path, int64_t limit, const std::function<void()>& wait = {});

  void begin_step(int64_t timestamp_us);
  // record: it acted on the run, or is a hash of its state.
  void write(int64_t timestamp_us, const std::string& channel, const uint8_t* data, size_t size,
             bool record);
  void flush();

  // As Writer's, of the files that are being written; and what went wrong, or "".
  void look_for_files();
  const std::string& error() const { return error_; }
  bool is_lost() const { return acted_.is_lost() || (file_ && file_->is_lost()); }
  // False: the record of what acted fills half of the limit, and is no longer kept.
  bool repeats() const { return repeats_; }
  // False: so much has changed the world that numbered files no longer begin with all of it.
  bool follows() const { return follows_; }

 private:
  struct File {
    std::string path;
    int64_t size;
  };
  struct Event {
    std::string channel;
    std::vector<uint8_t> data;
  };

  std::string name_of(int64_t number) const;
  void begin_file(int64_t timestamp_us);
  void remove_old();
  void take_errors();
  void keep_for_later(const std::string& channel, const uint8_t* data, size_t size);

  const std::string path_;
  const int64_t limit_;
  Writer acted_;
  std::unique_ptr<Writer> file_;
  std::deque<File> full_;  // that are complete, the oldest first
  int64_t full_bytes_ = 0;
  int64_t number_ = 0;  // of file_
  std::vector<Event> preamble_;
  int64_t preamble_bytes_ = 0;
  bool follows_ = true;
  bool repeats_ = true;
  std::string error_;
};

}  // namespace ruedo::log
