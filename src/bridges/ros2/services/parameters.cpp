#include "bridges/ros2/services/parameters.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bridges/ros2/messages/conversions.h"
#include "engine/outcome.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/fault_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/rate_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "world/model/fault.h"

namespace ruedo::ros2 {
namespace {

using engine::encoded;

constexpr size_t kMostNames = 1000;  // in a call
constexpr Qos kEventsQos{true, false, 1000};
// rcl_interfaces/msg/ParameterType
enum Type : uint8_t { not_set = 0, boolean = 1, integer = 2, real = 3, text = 4 };

struct Row {
  const char* name;
  Type type;
  bool read_only;
  const char* description;
  const char* allowed = "";
};

constexpr Row kRows[] = {
    {"fault", text, false, "the last fault that was set here; each acts from then on",
     "[ROBOT][/TARGET]:KIND[,for=S][,value=V]..., as of ruedo run --fault, without a time"},
    {"paused", boolean, false, "whether the simulation is paused"},
    {"rate", real, false, "sim time per real time", "0.0001 to 1e6; .inf: as fast as it goes"},
    {"seed", integer, true, "of all random numbers of the run"},
    {"step_size", real, true, "length of a step, s"},
    {"use_sim_time", boolean, true, "false: this node gives the time, on /clock"},
    {"world", text, true, "name of the world"},
};

const Row* find(const std::string& name) {
  const auto found = std::find_if(std::begin(kRows), std::end(kRows),
                                  [&](const Row& row) { return name == row.name; });
  return found == std::end(kRows) ? nullptr : found;
}

std::vector<uint8_t> no_name() {
  name_request_t body;
  return encoded(body);
}

fault_t message_of(const world::Fault& fault) {
  fault_t message{};
  message.kind = fault.kind;
  message.target = fault.target;
  message.duration = fault.duration_s;
  message.value = fault.value;
  message.view_begin = fault.from;
  message.view_end = fault.to;
  message.x = fault.x;
  message.y = fault.y;
  message.heading = fault.heading;
  return message;
}

}  // namespace

struct Parameters::Setting {
  CallPointer call;
  bool atomically = false;
  std::vector<Parameter> parameters;
  std::vector<std::string> refusals;  // of those that were tried, "": it was set
};

Parameters::Parameters(const ServiceContext& context, Requests& requests, Requests::Inject inject,
                       std::atomic<uint64_t>& faulty)
    : requests_(requests), inject_(std::move(inject)), faulty_(faulty) {
  const auto add = [&](const char* name, const char* type, auto handler) {
    services_.push_back(std::make_unique<ServiceServer>(context, std::string("ruedo/") + name,
                                                        std::string("rcl_interfaces/srv/") + type,
                                                        handler, faulty));
  };
  add("get_parameters", "GetParameters", [this](const CallPointer& call) { get_values(call); });
  add("get_parameter_types", "GetParameterTypes",
      [this](const CallPointer& call) { get_types(call); });
  add("list_parameters", "ListParameters", [this](const CallPointer& call) { list_names(call); });
  add("describe_parameters", "DescribeParameters",
      [this](const CallPointer& call) { describe(call); });
  add("set_parameters", "SetParameters", [this](const CallPointer& call) { set(call, false); });
  add("set_parameters_atomically", "SetParametersAtomically",
      [this](const CallPointer& call) { set(call, true); });
  constexpr const char* kEvent = "rcl_interfaces/msg/ParameterEvent";
  events_ = context.transport.add_writer(
      {Role::topic, {"/parameter_events", kEvent, kEventsQos}, type_hash(kEvent, context.distro)});
}

std::vector<Topic> Parameters::list() const {
  std::vector<Topic> topics;
  for (const auto& service : services_) topics.push_back(service->topic());
  return topics;
}

std::vector<const Reader*> Parameters::readers() const {
  std::vector<const Reader*> all;
  for (const auto& service : services_) all.push_back(&service->requests());
  return all;
}

std::vector<const Writer*> Parameters::writers() const {
  std::vector<const Writer*> all{events_.get()};
  for (const auto& service : services_) all.push_back(&service->replies());
  return all;
}

void Parameters::update(const std::vector<world_info_t>& info) {
  const std::lock_guard lock(mutex_);
  fault_channels_.clear();
  for (const world_info_t& part : info) {
    world_ = part.world;
    seed_ = part.seed;
    step_us_ = part.step_us;
    for (const channel_info_t& channel : part.channels)
      if (channel.input && channel.type == fault_t::getTypeName())
        fault_channels_[channel.robot] = channel.name;
  }
}

// ---- Values

Parameters::Value Parameters::value_of(const std::string& name, const state_reply_t* state) const {
  const std::lock_guard lock(mutex_);
  if (name == "fault") return fault_;
  if (name == "paused" && state) return static_cast<bool>(state->paused);
  if (name == "rate" && state) return state->rate;
  if (name == "seed") return seed_;
  if (name == "step_size") return static_cast<double>(step_us_) * 1e-6;
  if (name == "use_sim_time") return false;
  if (name == "world") return world_;
  return {};
}

void Parameters::put(CdrWriter& out, const Value& value) {
  const auto of = [&]<class Kind>(Kind none) {
    const Kind* held = std::get_if<Kind>(&value);
    return held ? *held : none;
  };
  out.put(static_cast<uint8_t>(value.index()));
  out.put(of(false)).put(of(int64_t{0})).put(of(0.0)).put(of(std::string()));
  for (int sequence = 0; sequence < 5; ++sequence) out.put_length(0);
}

Parameters::Parameter Parameters::read(CdrReader& in) {
  Parameter parameter;
  parameter.name = in.get_text();
  const auto type = in.get<uint8_t>();
  const bool truth = in.get<bool>();
  const auto whole = in.get<int64_t>();
  const auto number = in.get<double>();
  std::string words = in.get_text();
  in.get_sequence<uint8_t>();
  in.get_sequence<uint8_t>();
  in.get_sequence<int64_t>();
  in.get_sequence<double>();
  in.get_texts();
  if (type == boolean) parameter.value = truth;
  if (type == integer) parameter.value = whole;
  if (type == real) parameter.value = number;
  if (type == text) parameter.value = std::move(words);
  // 2 for 2.0, as a command line writes it.
  if (const Row* row = find(parameter.name); row && row->type == real && type == integer)
    parameter.value = static_cast<double>(whole);
  return parameter;
}

// ---- Looking

void Parameters::get_values(const CallPointer& call) {
  const std::vector<std::string> names = call->in.get_texts();
  if (!call->in.good() || names.size() > kMostNames) return void(++faulty_);
  requests_.send(
      call->client(), request_t::GET_STATE, no_name(), [this, call, names](const reply_t& reply) {
        state_reply_t state{};
        const bool known =
            reply.code == reply_t::OK &&
            decode_checked(reply.body.data(), reply.body.size(), state) == DecodeFault::none;
        CdrWriter out = call->answer();
        out.put_length(names.size());
        for (const std::string& name : names) put(out, value_of(name, known ? &state : nullptr));
        call->send(out);
      });
}

void Parameters::get_types(const CallPointer& call) {
  const std::vector<std::string> names = call->in.get_texts();
  if (!call->in.good()) return void(++faulty_);
  std::vector<uint8_t> types;
  for (const std::string& name : names) {
    const Row* row = find(name);
    types.push_back(row ? row->type : not_set);
  }
  CdrWriter out = call->answer();
  out.put_sequence(std::span<const uint8_t>(types));
  call->send(out);
}

// No name has a dot, so that each is at the first depth, and a prefix is a name.
void Parameters::list_names(const CallPointer& call) {
  const std::vector<std::string> prefixes = call->in.get_texts();
  call->in.get<uint64_t>();
  if (!call->in.good()) return void(++faulty_);
  std::vector<const char*> names;
  for (const Row& row : kRows)
    if (prefixes.empty() || std::find(prefixes.begin(), prefixes.end(), row.name) != prefixes.end())
      names.push_back(row.name);
  CdrWriter out = call->answer();
  out.put_length(names.size());
  for (const char* name : names) out.put(name);
  out.put_length(0);
  call->send(out);
}

void Parameters::describe(const CallPointer& call) {
  const std::vector<std::string> names = call->in.get_texts();
  if (!call->in.good() || names.size() > kMostNames) return void(++faulty_);
  CdrWriter out = call->answer();
  out.put_length(names.size());
  for (const std::string& name : names) {
    const Row* row = find(name);
    out.put(name).put(static_cast<uint8_t>(row ? row->type : not_set));
    out.put(row ? row->description : "").put(row ? row->allowed : "");
    out.put(row && row->read_only).put(false);
    out.put_length(0).put_length(0);  // ranges
  }
  call->send(out);
}

// ---- Setting

void Parameters::set(const CallPointer& call, bool atomically) {
  constexpr size_t kSmallest = 40;  // of a parameter
  const auto setting = std::make_shared<Setting>();
  setting->call = call;
  setting->atomically = atomically;
  setting->parameters.resize(call->in.get_length(kSmallest));
  for (Parameter& parameter : setting->parameters) parameter = read(call->in);
  if (!call->in.good() || setting->parameters.size() > kMostNames) return void(++faulty_);
  if (atomically) {
    for (const Parameter& parameter : setting->parameters) {
      if (std::string fault = fault_of(parameter); !fault.empty()) {
        setting->refusals.push_back(std::move(fault));
        return answer(*setting);
      }
    }
  }
  set_next(setting);
}

void Parameters::set_next(const std::shared_ptr<Setting>& setting) {
  const size_t next = setting->refusals.size();
  const bool refused = setting->atomically && next > 0 && !setting->refusals.back().empty();
  if (next == setting->parameters.size() || refused) return answer(*setting);
  apply(setting->call->client(), setting->parameters[next],
        [this, setting](const std::string& why) {
          setting->refusals.push_back(why);
          set_next(setting);
        });
}

void Parameters::answer(const Setting& setting) {
  CdrWriter out = setting.call->answer();
  const auto put_result = [&](const std::string& why) { out.put(why.empty()).put(why); };
  if (setting.atomically) {
    put_result(setting.refusals.empty() ? "" : setting.refusals.back());
  } else {
    out.put_length(setting.refusals.size());
    for (const std::string& why : setting.refusals) put_result(why);
  }
  setting.call->send(out);
  std::vector<Parameter> changed;
  for (size_t i = 0; i < std::min(setting.refusals.size(), setting.parameters.size()); ++i)
    if (setting.refusals[i].empty()) changed.push_back(setting.parameters[i]);
  if (!changed.empty()) tell(changed);
}

std::string Parameters::fault_of(const Parameter& parameter) const {
  constexpr const char* kTypes[] = {"", "a bool", "an integer", "a double", "a string"};
  const Row* row = find(parameter.name);
  if (!row) {
    std::vector<const char*> names;
    for (const Row& each : kRows) names.push_back(each.name);
    return fmt::format("there is no parameter '{}': there are {}", parameter.name,
                       fmt::join(names, ", "));
  }
  if (row->read_only) return fmt::format("'{}' is read-only", row->name);
  if (parameter.value.index() != row->type)
    return fmt::format("'{}' is {}", row->name, kTypes[row->type]);
  return "";
}

void Parameters::apply(uint64_t client, const Parameter& parameter,
                       const std::function<void(const std::string&)>& then) {
  if (const std::string fault = fault_of(parameter); !fault.empty()) return then(fault);
  if (parameter.name == "fault") return then(inject_fault(std::get<std::string>(parameter.value)));
  const auto ask = [&](int32_t kind, std::vector<uint8_t> body) {
    requests_.send(client, kind, std::move(body), [then](const reply_t& reply) {
      then(reply.code == reply_t::OK ? "" : reply.text.empty() ? "it is refused" : reply.text);
    });
  };
  if (parameter.name == "paused") {
    const int32_t kinds[] = {request_t::RESUME, request_t::PAUSE};
    return ask(kinds[std::get<bool>(parameter.value)], {});
  }
  rate_request_t body;
  body.rate = std::get<double>(parameter.value);
  ask(request_t::RATE, encoded(body));
}

std::string Parameters::inject_fault(const std::string& words) {
  world::Fault fault;
  try {
    fault = world::parse_fault_from_now(words);
  } catch (const InputError& error) {
    return error.what();
  }
  std::string channel;
  {
    const std::lock_guard lock(mutex_);
    const auto found =
        fault.robot.empty() ? fault_channels_.begin() : fault_channels_.find(fault.robot);
    if (found == fault_channels_.end())
      return fmt::format("there is no robot '{}' that takes faults", fault.robot);
    channel = found->second;
    fault_ = words;
  }
  inject_(channel, encoded(message_of(fault)));
  return "";
}

void Parameters::tell(const std::vector<Parameter>& changed) {
  using std::chrono::duration_cast, std::chrono::microseconds, std::chrono::system_clock;
  const int64_t now = duration_cast<microseconds>(system_clock::now().time_since_epoch()).count();
  CdrWriter out;
  out.put(static_cast<int32_t>(now / 1'000'000));
  out.put(static_cast<uint32_t>(now % 1'000'000 * 1000)).put("/ruedo");
  out.put_length(0).put_length(changed.size());
  for (const Parameter& parameter : changed) {
    out.put(parameter.name);
    put(out, parameter.value);
  }
  out.put_length(0);
  events_->write(out.bytes());
}

}  // namespace ruedo::ros2
