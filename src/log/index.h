// Where each message of a log is, by channel and time: gives random access to any moment of the
// log.
//
// The log is read through once; of most messages only the place is kept, in a file (places.h).
// Times never go back: an event whose time does is given the time of the event before it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "log/places.h"
#include "log/reader.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/log_header_t.hpp"

namespace ruedo::log {

// Whether a request of that kind changes which models there are.
bool changes_world(int32_t kind);

class Index {
 public:
  static constexpr size_t kMostChannels = 65'536;  // what is on others is not shown
  static constexpr size_t kMostEdits =
      1'000;  // requests that changed the world, and as many SET_POSE; later ones are not followed

  // Without places: the log's sources and the changes of its world, for readers that begin at its
  // start.
  enum class Keeps { places, changes };
  struct Channel {
    std::string name;
    int64_t fingerprint = 0;  // of its first message
    int64_t bytes = 0;        // of the file, by all of its messages
    Places places;
  };
  struct Edit {
    SimTime time_us;
    applied_t applied;
  };

  // Throws InputError if the file is not a log, or has no message.
  explicit Index(const std::string& path, Keeps keeps = Keeps::places);

  const std::vector<Channel>& channels() const { return channels_; }
  const std::optional<log_header_t>& header() const {
    return header_;
  }  // none: not recorded by ruedo run
  const std::vector<Edit>& edits() const { return edits_; }
  SimTime begin_us() const { return begin_us_; }
  SimTime end_us() const { return end_us_; }
  // "" or why not all of the log is shown.
  const std::string& fault() const { return fault_; }

 private:
  void add(const Event& event, int64_t offset, int64_t end, size_t channel);

  Keeps keeps_;
  std::vector<Channel> channels_;
  std::optional<log_header_t> header_;
  std::vector<Edit> edits_;
  size_t poses_ = 0, others_ = 0;
  SimTime begin_us_ = 0, end_us_ = 0;
  std::string fault_;
};

}  // namespace ruedo::log
