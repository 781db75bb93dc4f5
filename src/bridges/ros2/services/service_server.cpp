#include "bridges/ros2/services/service_server.h"

#include <algorithm>
#include <utility>

#include "ruedo/errors.h"

namespace ruedo::ros2 {
namespace {

constexpr std::array<uint8_t, 2> kCyclone{1, 16};  // as OMG has numbered the vendors of DDS

// Both ends of a service say that they belong together.
std::string service_id(const Gid& gid, const std::string& name) {
  uint64_t hash = 14695981039346656037u;  // FNV-1a
  const auto mix = [&](uint8_t byte) { hash = (hash ^ byte) * 1099511628211u; };
  for (const uint8_t byte : gid) mix(byte);
  for (const char c : name) mix(static_cast<uint8_t>(c));
  std::string text;
  for (int i = 0; i < 16; ++i) {
    const char* digits = "0123456789abcdef";
    const auto byte = static_cast<uint8_t>(hash >> (i % 8 * 8)) ^ static_cast<uint8_t>(i);
    text += i == 0 ? "" : ".";
    text += digits[byte / 16];
    text += digits[byte % 16];
  }
  return text;
}

}  // namespace

ServiceMapping parse_mapping(const std::string& name) {
  if (name == "auto") return ServiceMapping::automatic;
  if (name == "cyclonedds") return ServiceMapping::cyclonedds;
  if (name == "fastrtps") return ServiceMapping::fastrtps;
  throw InputError({}, "there is no mapping of services '" + name +
                           "': auto, cyclonedds and fastrtps are known");
}

Call::Call(Writer& replies, const Sample& sample, ServiceMapping mapping, const std::string& type)
    : bytes_(sample.cdr.begin(), sample.cdr.end()),
      in(bytes_),
      replies_(replies),
      type_(type),
      has_header_(mapping == ServiceMapping::cyclonedds ||
                  (mapping == ServiceMapping::automatic && !sample.is_related &&
                   sample.vendor == kCyclone)),
      identity_(sample.identity),
      sender_(sample.sender) {
  if (!has_header_) return;
  client_ = in.get<uint64_t>();
  sequence_ = in.get<int64_t>();
}

CdrWriter Call::answer() const {
  CdrWriter out;
  if (has_header_) out.put(client_).put(sequence_);
  return out;
}

bool Call::send(const CdrWriter& out) {
  return has_header_ ? replies_.write(out.bytes()) : replies_.reply(out.bytes(), identity_);
}

ServiceServer::ServiceServer(const ServiceContext& context, const std::string& name,
                             const std::string& type, Handler handler,
                             std::atomic<uint64_t>& faulty)
    : topic_{context.names.topic("", name), type, kCommandQos},
      mapping_(context.mapping),
      handler_(std::move(handler)),
      faulty_(faulty) {
  const std::string hash = type_hash(type, context.distro),
                    id = service_id(context.transport.gid(), topic_.name);
  replies_ = context.transport.add_writer(
      {Role::reply, {topic_.name, type + "_Response", kServiceQos}, hash, id});
  requests_ = context.transport.add_reader(
      {Role::request, {topic_.name, type + "_Request", kServiceQos}, hash, id, replies_.get()},
      [this](const Sample& sample) { on_request(sample); });
}

void ServiceServer::on_request(const Sample& sample) {
  const auto call = std::make_shared<Call>(*replies_, sample, mapping_, topic_.type);
  if (!call->in.good()) {
    ++faulty_;
    return;
  }
  handler_(call);
}

}  // namespace ruedo::ros2
