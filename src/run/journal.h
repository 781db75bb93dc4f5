// The inputs of the world since its epoch began, from which snapshots are made.
//
// A file without a name in the snapshots' folder: it grows with inputs of the world and with
// nothing else, and is reset with the world.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "log/header.h"
#include "log/writer.h"
#include "ruedo/log_header_t.hpp"
#include "ruedo/state_hash_t.hpp"
#include "run/sink.h"

namespace ruedo::run {

using log::kAppliedChannel, log::kHeaderChannel, log::kStateHashChannel;
inline const std::string kStateChannel = "ruedo/state";  // in snapshots alone

class Journal : public Sink {
 public:
  // Of the files in the folder; more are refused.
  static constexpr size_t kMostSnapshots = 1000;
  static constexpr uintmax_t kMostBytes = 10'000'000'000;

  // Throws EnvironmentError when nothing can be written in the folder.
  explicit Journal(const std::string& folder);

  // The world is built, or rebuilt, at that stamp.
  void begin(const log_header_t& header, SimTime stamp_us);

  // How much there is of it. A snapshot that is saved now begins with that.
  struct Extent {
    int64_t header_end = 0, end = 0;  // bytes
    int64_t events = 0;               // between them
  };
  Extent extent() const { return {header_end_, writer_.size(), writer_.events() - 1}; }
  // The world is rebuilt, and what it was when that snapshot was saved. stamp_us: of sim time 0.
  void begin_with(const log_header_t& header, SimTime stamp_us, const std::string& snapshot,
                  const Extent& extent);

  Hears hears() const override { return {.samples = false, .records = true, .repeated = true}; }
  void message(const Published& message) override;

  // Writes the journal and the state that it leads to into a file of the folder, which then is
  // whole or not there. stamp_us: of the state. bytes: of the state, too; empty: none. The error,
  // or
  // "".
  std::string save_snapshot(const std::string& name, const state_hash_t& state, SimTime stamp_us,
                            const std::vector<uint8_t>& bytes = {});
  // The same for a past state. Its hash is not in the journal, so it will not be checked. time_us:
  // of that state.
  std::string save_past(const std::string& name, int64_t step, SimTime time_us, int32_t epoch,
                        SimTime stamp_us);
  // The file of a snapshot; "" for an invalid name: 1 to 63 of letters, digits, '_', '-' and
  // '.', not first a '.'.
  std::string snapshot_path(const std::string& name) const;

 private:
  // A file that becomes a snapshot when fill(writer) has written it: what went wrong, or "".
  std::string save(const std::string& name,
                   const std::function<std::string(log::Writer& snapshot)>& fill);

  const std::string folder_;
  log::Writer writer_;
  SimTime base_us_ = 0;  // the stamp of its begin
  int64_t header_end_ = 0;
  std::string fault_;  // why it is not whole
};

}  // namespace ruedo::run
