// One participant with a thread that waits for samples of all readers.
#include "bridges/dds/cyclone_transport.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <dds/dds.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "bridges/dds/configuration.h"
#include "bridges/dds/identity.h"
#include "bridges/dds/incoming.h"
#include "bridges/dds/publications.h"
#include "bridges/dds/raw_type.h"
#include "bridges/dds/reply_ends.h"
#include "bridges/ros2/fair_queue.h"
#include "bridges/ros2/messages/interfaces.h"
#include "ruedo/errors.h"
#include "system/enough_threads.h"

namespace ruedo::dds {
namespace {

using ros2::Endpoint;
using ros2::Gid;
using ros2::Role;
using ros2::Topic;

constexpr int kCyclonesThreads = 12;
constexpr int kMostTaken = 64;        // samples taken at once
constexpr auto kLook = DDS_MSECS(2);  // interval for requests that have to wait

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using QosPointer = std::unique_ptr<dds_qos_t, QosDeleter>;
struct ListenerDeleter {
  void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
};
using ListenerPointer = std::unique_ptr<dds_listener_t, ListenerDeleter>;

dds_entity_t checked(dds_entity_t result, const std::string& what) {
  if (result < 0)
    throw EnvironmentError(fmt::format("ROS 2: {}: {}", what, dds_strretcode(-result)));
  return result;
}

Gid gid_of(dds_entity_t entity) {
  dds_guid_t guid{};
  Gid gid{};
  if (dds_get_guid(entity, &guid) == DDS_RETCODE_OK)
    std::copy(std::begin(guid.v), std::end(guid.v), gid.begin());
  return gid;
}

std::string dds_topic(const Endpoint& endpoint) {
  switch (endpoint.role) {
    case Role::topic: return "rt" + endpoint.topic.name;
    case Role::request: return "rq" + endpoint.topic.name + "Request";
    case Role::reply: return "rr" + endpoint.topic.name + "Reply";
    case Role::graph: break;
  }
  return endpoint.topic.name;
}

QosPointer qos_of(const Endpoint& endpoint) {
  const ros2::Qos& wanted = endpoint.topic.qos;
  QosPointer qos(dds_create_qos());
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, wanted.depth);
  // Never waits for a slow reader: samples beyond its queue are dropped.
  dds_qset_reliability(qos.get(),
                       wanted.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(
      qos.get(), wanted.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (wanted.transient_local) {
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  dds_qset_writer_data_lifecycle(qos.get(), false);
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  const std::string user_data =
      (endpoint.service.empty() ? "" : "serviceid=" + endpoint.service + ";") +
      (endpoint.hash.empty() ? "" : "typehash=" + endpoint.hash + ";");
  if (!user_data.empty()) dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  return qos;
}

void tell(void*, const dds_log_data_t* data);

// The messages of Cyclone while it starts: the reason of its failure, or warnings.
class StartLog {
 public:
  explicit StartLog(const CycloneOptions& options)
      : options_(options),
        lists_interfaces_(options.range == Range::localhost || options.range == Range::off) {
    const std::lock_guard lock(mutex_);
    current_ = this;
    dds_set_log_sink(tell, nullptr);
  }
  ~StartLog() {
    const std::lock_guard lock(mutex_);
    current_ = nullptr;
  }
  // Whether Cyclone is starting, and the line is kept.
  static bool takes(std::string_view line) {
    const std::lock_guard lock(mutex_);
    if (!current_) return false;
    if (current_->lists_interfaces_ && line.find("is not multicast-capable") != line.npos)
      return true;
    std::vector<std::string>& lines = current_->lines_;
    if (lines.size() < kMost && std::find(lines.begin(), lines.end(), line) == lines.end())
      lines.emplace_back(line);
    return true;
  }
  // Not while Cyclone's threads still call back.
  std::vector<std::string> lines() const {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  dds_entity_t checked(dds_entity_t result, const std::string& what) const {
    if (result >= 0) return result;
    throw EnvironmentError(fmt::format("ROS 2: {}: {}", what, reason(result)));
  }

 private:
  std::string reason(dds_entity_t result) const {
    const UserSettings own(options_.own, options_.domain);
    if (!own.unreadable().empty()) return own.unreadable();
    std::vector<std::string> why = lines();
    for (std::string& line : why) line = without_offset(line);
    return fmt::format("{}{}{}",
                       why.empty() ? std::string(dds_strretcode(-result))
                                   : fmt::format("{}", fmt::join(why, "; ")),
                       std::getenv("CYCLONEDDS_URI") ? " (CYCLONEDDS_URI is set)" : "", cure(why));
  }
  // "... (CYCLONEDDS_URI+1022 line 1)" counts what Ruedo puts before the user's text.
  static std::string without_offset(const std::string& line) {
    return line.substr(0, line.find(" (CYCLONEDDS_URI+"));
  }
  // "failed to increase socket receive buffer size to at least 10485760 bytes, current is ..."
  static std::string cure(const std::vector<std::string>& why) {
    for (const std::string& line : why) {
      constexpr std::string_view kWanted = "socket receive buffer size to at least ";
      const size_t at = line.find(kWanted);
      if (at == line.npos) continue;
      const size_t begin = at + kWanted.size();
      const std::string bytes = line.substr(begin, line.find(' ', begin) - begin);
      return "; the system allows less than SocketReceiveBufferSize asks for: run: sudo sysctl -w "
             "net.core.rmem_max=" +
             bytes;
    }
    return "";
  }
  static constexpr size_t kMost = 10;
  static inline std::mutex mutex_;
  static inline StartLog* current_ = nullptr;
  const CycloneOptions& options_;
  const bool lists_interfaces_;  // most of them without multicast, of which Cyclone warns
  std::vector<std::string> lines_;
};

void warn(std::string_view line) { spdlog::warn("ROS 2: Cyclone DDS: {}", line); }

// Cyclone's own warnings, of which any sender can cause any number: at most one a second, and each
// text once a minute, for it repeats what lasts (no network) with each message. Refused samples are
// counted elsewhere.
bool is_due(std::string_view line) {
  using Clock = std::chrono::steady_clock;
  constexpr auto kPeriod = std::chrono::seconds(1), kPeriodOfEach = std::chrono::seconds(60);
  constexpr size_t kMostKnown = 64;
  static std::mutex mutex;
  static std::map<std::string, Clock::time_point, std::less<>> told;
  static Clock::time_point last;
  const Clock::time_point now = Clock::now();
  const std::lock_guard lock(mutex);
  if (last != Clock::time_point() && now < last + kPeriod) return false;
  const auto known = told.find(line);
  if (known != told.end() && now < known->second + kPeriodOfEach) return false;
  if (told.size() == kMostKnown) told.clear();
  told.insert_or_assign(std::string(line), now);
  last = now;
  return true;
}

void tell(void*, const dds_log_data_t* data) {
  const std::string_view text(data->message, data->size);
  if (text.find("deserialization") != text.npos) return;
  const std::string_view line = text.substr(0, text.find_last_not_of('\n') + 1);
  if (StartLog::takes(line) || !is_due(line)) return;
  if (const size_t sample = line.find("sample"); line.starts_with("dropping oversize"))
    spdlog::warn(
        "ROS 2: left out, for it has more than {} MB or fragments of less than {} bytes: {}",
        kLargestIncoming >> 20, kSmallestFragment, line.substr(std::min(sample, line.size())));
  else
    warn(line);
}

// ROS's name of the policy by which a reader and a writer are incompatible.
const char* policy_name(uint32_t id) {
  switch (id) {
    case DDS_DURABILITY_QOS_POLICY_ID: return "durability";
    case DDS_DEADLINE_QOS_POLICY_ID: return "deadline";
    case DDS_LIVELINESS_QOS_POLICY_ID: return "liveliness";
    case DDS_RELIABILITY_QOS_POLICY_ID: return "reliability";
    default: return "another policy";
  }
}

class CycloneWriter : public ros2::Writer {
 public:
  CycloneWriter(dds_entity_t participant, const Endpoint& endpoint) : name_(endpoint.topic.name) {
    const std::string name = dds_topic(endpoint);
    topic_ = checked(create_raw_topic(participant, name.c_str(),
                                      ros2::dds_type(endpoint.topic.type).c_str(), &type_),
                     "topic " + name);
    const ListenerPointer listener(dds_create_listener(this));
    dds_lset_offered_incompatible_qos(listener.get(), tell_incompatible);
    writer_ =
        checked(dds_create_writer(participant, topic_, qos_of(endpoint).get(), listener.get()),
                "writer of " + name);
    if (endpoint.role == Role::reply) tell_identities(*type_);
  }
  ~CycloneWriter() override {
    dds_delete(writer_);
    dds_delete(topic_);
  }

  bool write(std::span<const uint8_t> cdr) override {
    ddsi_serdata* sample = make_sample(type_, cdr);
    return dds_writecdr(writer_, sample) == DDS_RETCODE_OK;
  }
  bool reply(std::span<const uint8_t> cdr, const ros2::SampleIdentity& request) override {
    const std::vector<uint8_t> marked = with_identity(cdr, request);
    return !marked.empty() && write(marked);
  }
  size_t readers() const override {
    dds_publication_matched_status_t status{};
    return dds_get_publication_matched_status(writer_, &status) == DDS_RETCODE_OK
               ? status.current_count
               : 0;
  }
  Gid gid() const override { return gid_of(writer_); }
  dds_entity_t entity() const { return writer_; }

 private:
  static void tell_incompatible(dds_entity_t, const dds_offered_incompatible_qos_status_t status,
                                void* writer) noexcept {
    CycloneWriter& self = *static_cast<CycloneWriter*>(writer);
    if (std::exchange(self.told_, true)) return;
    spdlog::warn("ROS 2: somebody reads {} with a QoS that is not offered ({}): it gets nothing",
                 self.name_, policy_name(status.last_policy_id));
  }

  std::string name_;
  bool told_ = false;
  dds_entity_t topic_ = 0, writer_ = 0;
  const ddsi_sertype* type_ = nullptr;
};

class CycloneReader;

// The transport's thread, which takes what comes. Readers may come and go meanwhile.
class Receiver {
 public:
  explicit Receiver(dds_entity_t participant)
      : waitset_(dds_create_waitset(participant)), wake_(dds_create_guardcondition(participant)) {
    dds_waitset_attach(waitset_, wake_, 0);
  }
  ~Receiver() { stop(); }

  void start();
  void stop();

  void attach(dds_entity_t entity, CycloneReader* reader, const std::string& name) {
    checked(dds_waitset_attach(waitset_, entity, reinterpret_cast<dds_attach_t>(reader)),
            "reader of " + name);
  }
  // Returns when the thread is done with it. Not to be called from a handler.
  void detach(dds_entity_t entity, CycloneReader* reader);

 private:
  void receive();
  void let_go();

  dds_entity_t waitset_, wake_;
  std::set<CycloneReader*> readers_;  // the thread's: those with deferred work
  std::atomic<bool> stopping_{false};
  std::thread thread_;
  std::condition_variable gone_;
  std::mutex mutex_;  // of what follows
  std::set<CycloneReader*> leaving_;
  bool running_ = false;
};

class CycloneReader : public ros2::Reader {
 public:
  CycloneReader(dds_entity_t participant, Receiver& receiver, const Endpoint& endpoint,
                ros2::Transport::Handler handler)
      : receiver_(receiver), name_(endpoint.topic.name), handler_(std::move(handler)) {
    const std::string name = dds_topic(endpoint);
    const ddsi_sertype* type = nullptr;
    topic_ = checked(create_raw_topic(participant, name.c_str(),
                                      ros2::dds_type(endpoint.topic.type).c_str(), &type),
                     "topic " + name);
    reader_ = checked(dds_create_reader(participant, topic_, qos_of(endpoint).get(), nullptr),
                      "reader of " + name);
    bound_incoming(*type, gid_of(participant));
    checked(dds_set_status_mask(reader_,
                                DDS_DATA_AVAILABLE_STATUS | DDS_REQUESTED_INCOMPATIBLE_QOS_STATUS),
            "reader of " + name);
    if (const auto* replies = static_cast<const CycloneWriter*>(endpoint.replies))
      requests_ = std::make_unique<WaitingRequests>(reader_, replies->entity());
    receiver_.attach(reader_, this, name);
  }
  ~CycloneReader() override {
    receiver_.detach(reader_, this);
    requests_.reset();
    dds_delete(reader_);
    dds_delete(topic_);
  }

  Gid gid() const override { return gid_of(reader_); }
  size_t writers() const override {
    dds_subscription_matched_status_t status{};
    return dds_get_subscription_matched_status(reader_, &status) == DDS_RETCODE_OK
               ? status.current_count
               : 0;
  }

  // Deferred work, in the transport's thread. One batch at a time, so that a writer that sends
  // without end leaves time for others.
  enum class Left { nothing, waiting, more };
  Left take() {
    uint32_t status = 0;
    dds_take_status(reader_, &status,
                    DDS_DATA_AVAILABLE_STATUS | DDS_REQUESTED_INCOMPATIBLE_QOS_STATUS);
    if (status & DDS_REQUESTED_INCOMPATIBLE_QOS_STATUS) tell_incompatible();
    ddsi_serdata* samples[kMostTaken];
    dds_sample_info_t infos[kMostTaken];
    const int count = dds_takecdr(reader_, samples, kMostTaken, infos, DDS_ANY_STATE);
    for (int i = 0; i < count; ++i) {
      SamplePointer sample(samples[i]);
      if (!infos[i].valid_data) continue;
      const dds_instance_handle_t writer = infos[i].publication_handle;
      if (requests_)
        requests_->queue.push(writer, std::move(sample));
      else
        hand_over(*sample, writer);
    }
    if (requests_) answer();
    if (count == kMostTaken) return Left::more;
    return requests_ && !requests_->queue.empty() ? Left::waiting : Left::nothing;
  }

 private:
  struct Unref {
    void operator()(ddsi_serdata* sample) const { ddsi_serdata_unref(sample); }
  };
  using SamplePointer = std::unique_ptr<ddsi_serdata, Unref>;
  // While waiting they count towards their writer's share of the topic's memory.
  struct WaitingRequests {
    WaitingRequests(dds_entity_t requests, dds_entity_t replies) : ends(requests, replies) {}
    ReplyEnds ends;
    ros2::FairQueue<SamplePointer> queue;
  };

  void hand_over(const ddsi_serdata& data, dds_instance_handle_t writer) {
    ros2::Sample sample = as_sample(&data);
    sample.sender = writer;
    handler_(sample);
  }
  void answer() {
    for (int i = 0; i < kMostTaken; ++i) {
      const auto now = ReplyEnds::Clock::now();
      const auto request = requests_->queue.next(
          now, [&](uint64_t writer) { return requests_->ends.may_answer(writer, now); });
      if (!request) return;
      hand_over(*request->second, request->first);
    }
  }
  void tell_incompatible() {
    if (std::exchange(told_, true)) return;
    dds_requested_incompatible_qos_status_t status{};
    dds_get_requested_incompatible_qos_status(reader_, &status);
    spdlog::warn(
        "ROS 2: somebody publishes on {} with a QoS that a reliable reader does not get ({}): it "
        "is not heard",
        name_, policy_name(status.last_policy_id));
  }

  Receiver& receiver_;
  dds_entity_t topic_ = 0, reader_ = 0;
  std::string name_;
  ros2::Transport::Handler handler_;
  std::unique_ptr<WaitingRequests> requests_;  // null: a topic
  bool told_ = false;
};

void Receiver::start() {
  const std::lock_guard lock(mutex_);
  thread_ = std::thread([this] { receive(); });
  running_ = true;
}

void Receiver::stop() {
  if (!thread_.joinable()) return;
  stopping_ = true;
  dds_set_guardcondition(wake_, true);
  thread_.join();
}

void Receiver::detach(dds_entity_t entity, CycloneReader* reader) {
  dds_waitset_detach(waitset_, entity);
  std::unique_lock lock(mutex_);
  leaving_.insert(reader);
  dds_set_guardcondition(wake_, true);
  gone_.wait(lock, [&] { return !running_ || !leaving_.contains(reader); });
  leaving_.erase(reader);
}

void Receiver::let_go() {
  bool woken = false;
  dds_take_guardcondition(wake_, &woken);
  const std::lock_guard lock(mutex_);
  for (CycloneReader* reader : leaving_) readers_.erase(reader);
  leaving_.clear();
  gone_.notify_all();
}

void Receiver::receive() {
  using Left = CycloneReader::Left;
  dds_attach_t woken[kMostTaken];
  dds_duration_t patience = DDS_INFINITY;
  while (!stopping_) {
    const dds_return_t count = dds_waitset_wait(waitset_, woken, kMostTaken, patience);
    for (dds_return_t i = 0; i < std::min(count, kMostTaken); ++i) {
      if (woken[i] != 0) readers_.insert(reinterpret_cast<CycloneReader*>(woken[i]));
    }
    let_go();
    patience = DDS_INFINITY;
    for (auto reader = readers_.begin(); reader != readers_.end() && !stopping_;) {
      const Left left = (*reader)->take();
      if (left != Left::nothing) patience = left == Left::more ? 0 : std::min(patience, kLook);
      reader = left == Left::nothing ? readers_.erase(reader) : std::next(reader);
    }
  }
  const std::lock_guard lock(mutex_);
  running_ = false;
  gone_.notify_all();
}

class CycloneTransport : public ros2::Transport {
 public:
  explicit CycloneTransport(const CycloneOptions& options) : options_(options) {
    require_threads(kCyclonesThreads);  // without one of them it aborts
    std::optional<StartLog> start(std::in_place, options_);
    domain_ = start->checked(dds_create_domain(options.domain, configuration(options).c_str()),
                             fmt::format("domain {} cannot be joined", options.domain));
    QosPointer qos(dds_create_qos());
    constexpr char kEnclave[] = "enclave=/;";
    dds_qset_userdata(qos.get(), kEnclave, sizeof kEnclave - 1);
    participant_ = dds_create_participant(options.domain, qos.get(), nullptr);
    if (participant_ < 0) dds_delete(domain_);
    start->checked(participant_, fmt::format("no participant in domain {}", options.domain));
    const std::vector<std::string> warnings = start->lines();
    start.reset();
    for (const std::string& line : warnings) warn(line);
    receiver_.emplace(participant_);
    publications_.emplace(participant_);
  }
  ~CycloneTransport() override {
    stop();
    publications_.reset();
    dds_delete(domain_);
  }

  std::unique_ptr<ros2::Writer> add_writer(const Endpoint& endpoint) override {
    return std::make_unique<CycloneWriter>(participant_, endpoint);
  }
  std::unique_ptr<ros2::Reader> add_reader(const Endpoint& endpoint, Handler handler) override {
    return std::make_unique<CycloneReader>(participant_, *receiver_, endpoint, std::move(handler));
  }

  bool is_published(const Topic& topic) override {
    return publications_->has("rt" + topic.name, ros2::dds_type(topic.type));
  }

  void start() override { receiver_->start(); }
  void stop() override { receiver_->stop(); }

  Gid gid() const override { return gid_of(participant_); }
  std::string where() const override {
    constexpr const char* kRanges[] = {"discovery off", "this machine only", "the subnet",
                                       "as Cyclone DDS is configured"};
    return fmt::format("domain {}, {}", options_.domain,
                       kRanges[static_cast<size_t>(options_.range)]);
  }
  uint64_t refused() const override { return refused_samples(); }

 private:
  CycloneOptions options_;
  dds_entity_t domain_ = 0, participant_ = 0;
  std::optional<Receiver> receiver_;  // of the participant
  std::optional<Publications> publications_;
};

}  // namespace

std::unique_ptr<ros2::Transport> open_cyclone(const CycloneOptions& options) {
  return std::make_unique<CycloneTransport>(options);
}

}  // namespace ruedo::dds
