// What a run leaves behind: its log, and the journal of what acted on it, which snapshots are made from.
//
// The publisher's, all of it. Stamps never run backwards, whatever is reset. The journal is a file without a name in the
// snapshots' folder: it grows with what acts on the world and with nothing else, and begins anew with the world.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ruedo/applied_t.hpp"
#include "ruedo/log_header_t.hpp"
#include "ruedo/sim_time.h"
#include "ruedo/state_hash_t.hpp"
#include "log/writer.h"

namespace ruedo::run {

class Recorder {
 public:
  // Sees each event as the log would get it.
  using Watcher = std::function<void(SimTime stamp, const std::string& channel, const uint8_t* data, size_t size)>;

  static constexpr size_t kMostSnapshots = 1000;    // files in the folder; more are refused

  // log: a file; snapshots: a folder; "": none. Throws EnvironmentError.
  Recorder(const std::string& log, const std::string& snapshots, Watcher watcher);

  // Whether anybody wants the run's messages.
  bool wants_messages() const { return log_ || watcher_; }
  bool has_journal() const { return journal_ != nullptr; }
  // The stamp of sim time 0 now.
  SimTime base_us() const { return base_us_; }

  // The first event of all. The journal begins with it, too.
  void begin(const log_header_t& header);
  // The world was made anew: `passed` us after the epoch began; the journal begins anew with the header.
  void begin_anew(SimTime passed, const log_header_t& header);
  // Sim time was set back by `passed` us, and the world stays.
  void set_back(SimTime passed);

  void message(SimTime utime, const std::string& channel, const uint8_t* data, size_t size);
  void applied(const applied_t& applied);
  // Of a model that came since the first header: the same header with the files that it was read from.
  void files(const log_header_t& header);
  void state_hash(const state_hash_t& hash);

  void flush();
  // Throws EnvironmentError when the log cannot be written any more.
  void check(SimTime now) const;

  // Writes the journal and the state that it leads to into a file of the folder, which then is whole or not there. The
  // error, or "".
  std::string save_snapshot(const std::string& name, const state_hash_t& state);
  // The file of a snapshot; "" for a name that is none: 1 to 63 of letters, digits, '_', '-' and '.', not first a '.'.
  std::string snapshot_path(const std::string& name) const;

 private:
  template <class Message>
  void record(const std::string& channel, const Message& message);
  void begin_journal(const log_header_t& header);

  std::unique_ptr<log::Writer> log_, journal_;
  std::string folder_;
  Watcher watcher_;
  SimTime base_us_ = 0;            // of the log's stamps
  SimTime journal_base_us_ = 0;    // of the log's when the journal began
  std::vector<uint8_t> buffer_;
};

}  // namespace ruedo::run
