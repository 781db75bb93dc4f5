// A peer of `ruedo run --ros2` over Fast DDS (2 of Debian 12, 3 of Debian 13), which shares nothing
// with Ruedo: topics by CDR as fastcdr reads and writes it, services as rmw_fastrtps maps them.
//
// fastdds_peer DOMAIN prints a line for each thing that it tried: name, tab, type, tab, what came
// of it.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fastcdr/Cdr.h>
#if __has_include(<fastdds/rtps/common/WriteParams.hpp>)
#include <fastdds/rtps/common/WriteParams.hpp>
#define FAST_DDS_3
#else
#include <fastdds/rtps/common/WriteParams.h>
#endif
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

namespace {

using namespace eprosima::fastdds::dds;
using eprosima::fastcdr::Cdr;
#ifdef FAST_DDS_3
namespace rtps = eprosima::fastdds::rtps;
constexpr auto kOk = RETCODE_OK;
constexpr auto kCdr = eprosima::fastcdr::DDS_CDR;
#else
namespace rtps = eprosima::fastrtps::rtps;
const auto kOk = ReturnCode_t::RETCODE_OK;
constexpr auto kCdr = Cdr::DDS_CDR;
#endif
using rtps::InstanceHandle_t;
using rtps::SampleIdentity;
using rtps::SerializedPayload_t;
using rtps::WriteParams;
using Bytes = std::vector<char>;
using namespace std::chrono_literals;

constexpr auto kPatience = 60s;

// Samples are CDR bytes, with their header.
class BytesType : public TopicDataType {
 public:
#ifdef FAST_DDS_3
  explicit BytesType(const std::string& name) {
    set_name(name);
    max_serialized_type_size = kMost;
  }
  bool serialize(const void* data, SerializedPayload_t& payload, DataRepresentationId_t) override {
    return put(data, payload);
  }
  bool deserialize(SerializedPayload_t& payload, void* data) override { return get(payload, data); }
  uint32_t calculate_serialized_size(const void* data, DataRepresentationId_t) override {
    return size(data);
  }
  void* create_data() override { return new Bytes; }
  void delete_data(void* data) override { delete static_cast<Bytes*>(data); }
  bool compute_key(SerializedPayload_t&, InstanceHandle_t&, bool) override { return false; }
  bool compute_key(const void*, InstanceHandle_t&, bool) override { return false; }
#else
  explicit BytesType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = kMost;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, SerializedPayload_t* payload) override { return put(data, *payload); }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    return get(*payload, data);
  }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return size(data); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
#endif

 private:
  static constexpr uint32_t kMost = 4 << 20;
  static bool put(const void* data, SerializedPayload_t& payload) {
    const auto& bytes = *static_cast<const Bytes*>(data);
    std::memcpy(payload.data, bytes.data(), bytes.size());
    payload.length = static_cast<uint32_t>(bytes.size());
    payload.encapsulation = CDR_LE;
    return true;
  }
  static bool get(const SerializedPayload_t& payload, void* data) {
    static_cast<Bytes*>(data)->assign(payload.data, payload.data + payload.length);
    return true;
  }
  static uint32_t size(const void* data) {
    return static_cast<uint32_t>(static_cast<const Bytes*>(data)->size());
  }
};

void report(const std::string& name, const std::string& type, const std::string& result) {
  std::printf("%s\t%s\t%s\n", name.c_str(), type.c_str(), result.c_str());
  std::fflush(stdout);
}

template <class Condition>
bool wait_for(const Condition& condition, std::chrono::seconds patience = kPatience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(5ms);
  }
  return true;
}

// "sensor_msgs/msg/LaserScan" is sensor_msgs::msg::dds_::LaserScan_ in DDS.
std::string dds_name(const std::string& type) {
  const size_t a = type.find('/'), b = type.rfind('/');
  return type.substr(0, a) + "::" + type.substr(a + 1, b - a - 1) +
         "::dds_::" + type.substr(b + 1) + "_";
}

class Out {
 public:
  Out() : cdr_(buffer_, Cdr::LITTLE_ENDIANNESS, kCdr) { cdr_.serialize_encapsulation(); }
  template <class T>
  Out& operator<<(const T& value) {
    cdr_ << value;
    return *this;
  }
  Bytes bytes() {
#ifdef FAST_DDS_3
    const size_t size = cdr_.get_serialized_data_length();
#else
    const size_t size = cdr_.getSerializedDataLength();
#endif
    return {buffer_.getBuffer(), buffer_.getBuffer() + size};
  }

 private:
  eprosima::fastcdr::FastBuffer buffer_;
  Cdr cdr_;
};

class In {
 public:
  explicit In(Bytes& bytes)
      : buffer_(bytes.data(), bytes.size()), cdr_(buffer_, Cdr::LITTLE_ENDIANNESS, kCdr) {
    cdr_.read_encapsulation();
  }
  template <class T>
  T get() {
    T value{};
    cdr_ >> value;
    return value;
  }

 private:
  eprosima::fastcdr::FastBuffer buffer_;
  Cdr cdr_;
};

class Peer {
 public:
  explicit Peer(int domain)
      : participant_(DomainParticipantFactory::get_instance()->create_participant(
            static_cast<uint32_t>(domain), PARTICIPANT_QOS_DEFAULT)),
        publisher_(participant_->create_publisher(PUBLISHER_QOS_DEFAULT)),
        subscriber_(participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT)) {}

  DataReader* reader(const std::string& topic, const std::string& type, bool latched = false) {
    DataReaderQos qos;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    qos.history().depth = 100;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return subscriber_->create_datareader(this->topic(topic, type), qos);
  }
  DataWriter* writer(const std::string& topic, const std::string& type) {
    DataWriterQos qos;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return publisher_->create_datawriter(this->topic(topic, type), qos);
  }

 private:
  Topic* topic(const std::string& name, const std::string& type) {
    const std::string dds_type = dds_name(type);
    if (!participant_->find_type(dds_type))
      participant_->register_type(TypeSupport(new BytesType(dds_type)));
    return participant_->create_topic(name, dds_type, TOPIC_QOS_DEFAULT);
  }

  DomainParticipant* participant_;
  Publisher* publisher_;
  Subscriber* subscriber_;
};

// The next sample that holds what is wanted; what `look` says of it.
std::string first(DataReader* reader, const std::function<std::string(In&)>& look) {
  std::string told;
  const bool came = wait_for([&] {
    Bytes bytes;
    SampleInfo info;
    while (told.empty() && reader->take_next_sample(&bytes, &info) == kOk) {
      if (!info.valid_data) continue;
      try {
        In in(bytes);
        told = look(in);
      } catch (const eprosima::fastcdr::exception::Exception& error) {
        told = std::string("fails: ") + error.what();
      }
    }
    return !told.empty();
  });
  return came ? told : "fails: nothing came";
}

struct Header {
  int32_t sec;
  uint32_t nanosec;
  std::string frame;
};
Header header(In& in) {
  Header read;
  read.sec = in.get<int32_t>();
  read.nanosec = in.get<uint32_t>();
  read.frame = in.get<std::string>();
  return read;
}

void try_topics(Peer& peer) {
  const auto topic = [&](const std::string& name, const std::string& type, bool latched,
                         const std::function<std::string(In&)>& look) {
    report(name, type, first(peer.reader("rt" + name, type, latched), look));
  };
  topic("/clock", "rosgraph_msgs/msg/Clock", false, [](In& in) {
    const auto sec = in.get<int32_t>();
    const auto nanosec = in.get<uint32_t>();
    return nanosec % 10'000'000 == 0 && sec >= 0 ? std::string("works") : "fails: odd time";
  });
  topic("/scan", "sensor_msgs/msg/LaserScan", false, [](In& in) {
    const Header at = header(in);
    for (int i = 0; i < 7; ++i) in.get<float>();
    const auto ranges = in.get<std::vector<float>>();
    const bool good = at.frame == "lrf" && ranges.size() == 181 && std::isfinite(ranges[90]);
    return good ? std::string("works") : "fails: other values";
  });
  const auto transforms = [](In& in) {
    const auto count = in.get<uint32_t>();
    const Header at = header(in);
    const auto child = in.get<std::string>();
    return count > 0 && !at.frame.empty() && !child.empty() ? std::string("works")
                                                            : "fails: no frames";
  };
  topic("/tf", "tf2_msgs/msg/TFMessage", false, transforms);
  topic("/tf_static", "tf2_msgs/msg/TFMessage", true, transforms);
  topic("/robot_description", "std_msgs/msg/String", true, [](In& in) {
    return in.get<std::string>().find("<robot name=\"p3at\">") != std::string::npos
               ? std::string("works")
               : "fails: no URDF";
  });
  topic("/image_raw", "sensor_msgs/msg/Image", false, [](In& in) {
    header(in);
    const auto height = in.get<uint32_t>(), width = in.get<uint32_t>();
    return height == 480 && width == 640 ? std::string("works") : "fails: another size";
  });
}

void try_driving(Peer& peer) {
  const std::string type = "geometry_msgs/msg/Twist";
  DataWriter* commands = peer.writer("rt/cmd_vel", type);
  DataReader* odometry = peer.reader("rt/odom", "nav_msgs/msg/Odometry");
  const bool drives = wait_for([&] {
    Out out;
    out << 0.3;
    for (int i = 0; i < 5; ++i) out << 0.0;
    Bytes bytes = out.bytes(), taken;
    commands->write(&bytes);
    std::this_thread::sleep_for(50ms);
    SampleInfo info;
    while (odometry->take_next_sample(&taken, &info) == kOk) {
      if (!info.valid_data) continue;
      In in(taken);
      header(in);
      in.get<std::string>();
      for (int i = 0; i < 7 + 36; ++i) in.get<double>();
      if (std::abs(in.get<double>() - 0.3) < 1e-6) return true;
    }
    return false;
  });
  report("/cmd_vel", type, drives ? "works" : "fails: odometry shows no 0.3 m/s");
}

// As rmw_fastrtps: the request names the reader that waits, the reply names it and the request.
class Client {
 public:
  Client(Peer& peer, const std::string& name, const std::string& type)
      : requests_(peer.writer("rq" + name + "Request", type + "_Request")),
        replies_(peer.reader("rr" + name + "Reply", type + "_Response")) {}

  std::optional<Bytes> call(Bytes request) {
    const bool found = wait_for([&] {
      PublicationMatchedStatus requests;
      SubscriptionMatchedStatus replies;
      requests_->get_publication_matched_status(requests);
      replies_->get_subscription_matched_status(replies);
      return requests.current_count > 0 && replies.current_count > 0;
    });
    if (!found) return std::nullopt;
    // A request that is sent before the server knows its writer is lost, with any DDS.
    for (int again = 0; again < 10; ++again) {
      if (auto reply = ask(request)) return reply;
    }
    return std::nullopt;
  }

 private:
  std::optional<Bytes> ask(Bytes& request) {
    WriteParams params;
    params.related_sample_identity().writer_guid() = replies_->guid();
#ifdef FAST_DDS_3
    if (requests_->write(&request, params) != kOk) return std::nullopt;
#else
    if (!requests_->write(&request, params)) return std::nullopt;
#endif
    Bytes reply;
    const bool came = wait_for(
        [&] {
          SampleInfo info;
          while (replies_->take_next_sample(&reply, &info) == kOk) {
            const SampleIdentity& related = info.related_sample_identity;
            if (info.valid_data && related.writer_guid() == replies_->guid() &&
                related.sequence_number() == params.sample_identity().sequence_number())
              return true;
          }
          return false;
        },
        5s);
    return came ? std::optional(reply) : std::nullopt;
  }

  DataWriter* requests_;
  DataReader* replies_;
};

void try_services(Peer& peer) {
  const auto service = [&](const std::string& name, const std::string& kind, Out&& request,
                           const std::function<bool(In&)>& is_right) {
    const std::string type = "simulation_interfaces/srv/" + kind;
    Client client(peer, "/" + name, type);
    auto reply = client.call(request.bytes());
    if (!reply) return report("/" + name, type, "fails: no reply");
    In in(*reply);
    report("/" + name, type, is_right(in) ? "works" : "fails: another reply");
  };
  const auto result = [](In& in) { return in.get<uint8_t>() == 1; };
  Out nothing, pause, steps, entity;
  nothing << uint8_t{0};
  service("get_simulation_state", "GetSimulationState", std::move(nothing),
          [&](In& in) { return in.get<uint8_t>() == 1 && result(in); });
  pause << uint8_t{2};
  service("set_simulation_state", "SetSimulationState", std::move(pause), result);
  steps << uint64_t{20};
  service("step_simulation", "StepSimulation", std::move(steps), result);
  entity << std::string("p3at");
  service("get_entity_state", "GetEntityState", std::move(entity), [&](In& in) {
    return result(in) && in.get<std::string>().empty() && header(in).frame == "world";
  });
}

void try_action(Peer& peer) {
  const std::string type = "simulation_interfaces/action/SimulateSteps",
                    name = "/simulate_steps/_action/";
  Client send(peer, name + "send_goal", type + "_SendGoal"),
      get(peer, name + "get_result", type + "_GetResult");
  DataReader* feedback = peer.reader("rt" + name + "feedback", type + "_FeedbackMessage");
  Out goal, wanted;
  for (uint8_t i = 0; i < 16; ++i) goal << i, wanted << i;
  goal << uint64_t{3};
  auto accepted = send.call(goal.bytes());
  if (!accepted || !In(*accepted).get<bool>())
    return report("/simulate_steps", type, "fails: no goal");
  auto result = get.call(wanted.bytes());
  if (!result || In(*result).get<int8_t>() != 4)
    return report("/simulate_steps", type, "fails: no result");
  report("/simulate_steps", type, first(feedback, [](In& in) {
           for (int i = 0; i < 16; ++i) in.get<uint8_t>();
           const auto done = in.get<uint64_t>(), left = in.get<uint64_t>();
           return done + left == 3 ? std::string("works") : "fails: other feedback";
         }));
}

}  // namespace

int main(int, char** arguments) {
  Peer peer(std::atoi(arguments[1]));
  try_topics(peer);
  try_driving(peer);
  try_services(peer);
  try_action(peer);
}
