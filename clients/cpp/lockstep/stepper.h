// The client's side of lockstep: grants steps, and collects every message of every step, whatever
// is lost on the way.
//
// The caller of step() grants, receives in its own thread while it waits, and asks again for what
// does not come.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/client.h"
#include "session.h"
#include "transport/channel_names.h"

namespace ruedo::client {

class Core;
class WireReader;
struct WorldInfo;

class Stepper {
 public:
  explicit Stepper(Core& core) : core_(core) {}

  Observations step(int64_t n, const std::vector<Command>& commands, Duration timeout);
  void forget();  // the client has reset the world, or left: the next step takes part again

  std::string whose_turn();  // for whose grant the run waits, as far as this client knows

  // The receiving thread's.
  void on_info(const std::shared_ptr<const WorldInfo>& info);
  void on_tick(const uint8_t* bytes, size_t size);
  void on_reply(const Reply& reply);  // to GRANT or RESEND

 private:
  static constexpr int64_t kAcknowledgedTogether = 32;  // steps
  using Clock = std::chrono::steady_clock;

  struct Entry {  // of a manifest
    int32_t channel = 0;
    int64_t sequence = 0;
    size_t size = 0;
    uint32_t crc = 0;
    std::vector<uint8_t> bytes;  // as much as is here
    bool here() const { return bytes.size() == size; }
  };
  struct Step {
    int64_t utime = 0, state_hash = 0;
    size_t nparts = 0, parts_here = 0, missing = 0;
    std::vector<std::vector<Entry>> parts;  // empty where a part is missing or has no entries
    std::vector<bool> part_here;
    bool complete() const { return nparts > 0 && parts_here == nparts && missing == 0; }
  };
  struct Early {  // a message whose tick has not come yet
    size_t size;
    uint32_t crc;
    int64_t utime;
    std::vector<uint8_t> bytes;
  };
  struct Grant {  // the one under way
    int64_t sequence = 0, from = 0;
    std::vector<uint8_t> body;
    bool taken = true;
  };

  void check_run();
  void take_part(Duration timeout);
  void look(Duration timeout);
  void subscribe();
  std::vector<uint8_t> grant_body(int64_t until, const std::vector<Command>& commands) const;
  void wait(std::unique_lock<std::mutex>& lock, int64_t until, Duration timeout);
  void forget_steps();
  void doubt();
  void grant_again();
  void ask_for_lost(int64_t until);
  void collect(Observations& observations);
  void on_message(int32_t channel, const uint8_t* bytes, size_t size);
  void forget_first(std::deque<Early>& early);
  bool fill(Step& step, int32_t channel, size_t size, uint32_t crc, std::vector<uint8_t>& bytes);
  void take_tick(const uint8_t* bytes, size_t size);
  Entry read_entry(WireReader& in);
  void progress();
  void take_pieces(const std::vector<uint8_t>& body);
  std::exception_ptr fault_of(const Reply& reply) const;

  Core& core_;
  std::mutex one_at_a_time_;

  std::mutex mutex_;   // everything below
  bool part_ = false;  // takes part
  int64_t run_id_ = 0;
  int32_t epoch_ = 0;
  std::shared_ptr<const WorldInfo> info_;  // whose channels are subscribed
  ChannelNames names_;                     // in the state that is being collected
  std::map<size_t, std::pair<std::string, Subscription>>
      sources_;                      // by the channel's index; the caller's of step()
  int64_t granted_ = 0, have_ = -1;  // all of the states up to that one are here
  int64_t collected_ = -1, acknowledged_ = -1, newest_ = -1;
  Grant grant_;
  int64_t resend_sequence_ = 0;
  std::map<int64_t, Step> steps_;         // those not collected yet
  size_t listed_ = 0;                     // messages in the manifests of those not here
  std::vector<std::deque<Early>> early_;  // of each channel
  size_t early_bytes_ = 0;                // of all
  std::string waits_for_;
  std::exception_ptr fault_;
  bool ask_now_ = false;                    // without waiting for a silence
  int64_t last_utime_ = 0, last_hash_ = 0;  // of what was collected
};

// CRC-32 (IEEE 802.3), as in a manifest.
uint32_t crc32(const uint8_t* bytes, size_t size);

}  // namespace ruedo::client
