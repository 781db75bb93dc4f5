// The names of the channels while robots come and go, and others take their places.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace ruedo::client {

struct WorldInfo;

// As they are in each of the states that a client in lockstep collects, one after the other. Of
// more than 16 MB of changes since the last one, the oldest count as made: a server may send ever
// new ones.
class ChannelNames {
 public:
  void begin(const WorldInfo& info);   // forgets everything
  void change(const WorldInfo& info);  // from the states after its utime on
  void go_to(int64_t utime);           // the state of that time, us; never backwards

  // In that state. Where the info from before it was lost, the next name of the channel; "" without
  // one.
  const std::string& of(size_t channel) const;

 private:
  struct Change {
    int64_t utime;  // us, holds after it
    size_t channel;
    std::string name;
  };
  void make_first();

  std::vector<std::string> names_;   // by the channel's index
  std::vector<std::string> newest_;  // likewise, when all changes are made
  int64_t newest_utime_ = 0;
  std::deque<Change> changes_;
  size_t bytes_ = 0;  // that they take
};

}  // namespace ruedo::client
