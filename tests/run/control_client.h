// A server that runs in a thread, and a client of its control, for tests.
#pragma once

#include <gtest/gtest.h>

#include "ruedo/decode.h"
#include "ruedo/join_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"
#include "ruedo/spawn_request_t.hpp"
#include "ruedo/state_reply_t.hpp"
#include "ruedo/step_request_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "running.h"

namespace ruedo::run {

template <class T>
T decoded_as(const std::vector<uint8_t>& bytes) {
  T message;
  EXPECT_EQ(decode_checked(bytes.data(), bytes.size(), message), DecodeFault::none)
      << T::getTypeName();
  return message;
}

template <class SomeBus>
class ControlledOn {
 public:
  ~ControlledOn() { end(); }

  void begin(RunOptions options, const std::string& models, Sink* onlooker = nullptr) {
    start(std::move(options), models, onlooker);
    join();
  }
  void start(RunOptions options, const std::string& models, Sink* onlooker = nullptr) {
    server_ = std::make_unique<run::Run>(load_text(models), std::move(options), bus);
    if (onlooker) server_->add(*onlooker);
    thread_ = std::thread([this] { server_->run(); });
  }
  reply_t join() {
    join_t body;
    body.client = "test";
    request_t joining = request(request_t::JOIN, engine::encoded(body));
    joining.session = 0;
    joining.sequence = 4711;
    const reply_t reply = ask(joining);
    if (reply.session != session_) sequence_ = 0;
    session_ = reply.session;
    return reply;
  }
  void end() {
    if (server_) server_->stop();
    wait();
  }
  void wait() {  // for the end of the run
    if (thread_.joinable()) thread_.join();
  }

  void send(const request_t& request) { bus.send("ruedo/request", engine::encoded(request)); }
  reply_t ask(const request_t& request) {
    send(request);
    return answer(request);
  }
  reply_t answer(const request_t& request) {
    return decoded_as<reply_t>(bus.wait_for("ruedo/reply", from_,
                                            [&](const Message& message) {
                                              return decoded_as<reply_t>(message.bytes).sequence ==
                                                     request.sequence;
                                            })
                                   .bytes);
  }
  reply_t ask(int32_t kind, const std::vector<uint8_t>& body = {}) {
    return ask(request(kind, body));
  }

  state_reply_t step(int64_t steps) {
    step_request_t body;
    body.steps = steps;
    return decoded_as<state_reply_t>(ask(request_t::STEP, engine::encoded(body)).body);
  }
  state_reply_t state(const std::string& name = "") {
    name_request_t body;
    body.name = name;
    const reply_t reply = ask(request_t::GET_STATE, engine::encoded(body));
    EXPECT_EQ(reply.code, reply_t::OK) << reply.text;
    return decoded_as<state_reply_t>(reply.body);
  }

  static spawn_request_t spawning(const std::string& text, double x, double y,
                                  const std::string& name = "") {
    spawn_request_t body;
    body.name = name;
    body.text = text;
    body.on_ground = true;
    const double position[3] = {x, y, 0}, orientation[4] = {1, 0, 0, 0};
    std::copy(position, position + 3, body.position);
    std::copy(orientation, orientation + 4, body.orientation);
    return body;
  }
  reply_t spawn(const spawn_request_t& body) {
    return ask(request_t::SPAWN, engine::encoded(body));
  }
  reply_t spawn(const std::string& text, double x, double y, const std::string& name = "") {
    return spawn(spawning(text, x, y, name));
  }

  reply_t remove(const std::string& name) {
    name_request_t body;
    body.name = name;
    return ask(request_t::REMOVE, engine::encoded(body));
  }
  reply_t set_pose(const std::string& name, Vec3 p, Quat q = Quat::Identity()) {
    set_pose_request_t body;
    body.name = name;
    const double orientation[4] = {q.w(), q.x(), q.y(), q.z()};
    std::copy(p.data(), p.data() + 3, body.position);
    std::copy(orientation, orientation + 4, body.orientation);
    return ask(request_t::SET_POSE, engine::encoded(body));
  }
  reply_t set_twist(const std::string& name, Vec3 linear, Vec3 angular = Vec3::Zero()) {
    set_twist_request_t body;
    body.name = name;
    std::copy(linear.data(), linear.data() + 3, body.linear);
    std::copy(angular.data(), angular.data() + 3, body.angular);
    return ask(request_t::SET_TWIST, engine::encoded(body));
  }
  reply_t reset(int8_t what, int64_t seed = -1) {
    reset_request_t body;
    body.what = what;
    body.seed = seed;
    return ask(request_t::RESET, engine::encoded(body));
  }

  // All of the newest ruedo/info.
  world_info_t info() {
    ask(request_t::INFO);
    world_info_t whole;
    for (const Message& message : bus.messages()) {
      if (message.channel != "ruedo/info") continue;
      const auto part = decoded_as<world_info_t>(message.bytes);
      if (part.part == 0) {
        whole = part;
        continue;
      }
      whole.robots.insert(whole.robots.end(), part.robots.begin(), part.robots.end());
      whole.devices.insert(whole.devices.end(), part.devices.begin(), part.devices.end());
      whole.channels.insert(whole.channels.end(), part.channels.begin(), part.channels.end());
      whole.bodies.insert(whole.bodies.end(), part.bodies.begin(), part.bodies.end());
    }
    return whole;
  }

  // The messages of a channel since message number `from`.
  template <class T>
  std::vector<T> on(const std::string& channel, size_t from = 0) {
    std::vector<T> found;
    const std::vector<Message> messages = bus.messages();
    for (size_t i = from; i < messages.size(); ++i) {
      if (messages[i].channel == channel) found.push_back(decoded_as<T>(messages[i].bytes));
    }
    return found;
  }

  request_t request(int32_t kind, const std::vector<uint8_t>& body = {}) {
    request_t request;
    request.utime = 0;
    request.run_id = 0;
    request.epoch = -1;
    request.session = session_;
    request.sequence = ++sequence_;
    request.kind = kind;
    request.body = body;
    request.size = static_cast<int32_t>(body.size());
    return request;
  }
  request_t stepping(int64_t steps) {
    step_request_t body;
    body.steps = steps;
    return request(request_t::STEP, engine::encoded(body));
  }

  void rewind() { from_ = 0; }  // after bus.forget(), or for an answer that came before another's
  run::Run& server() { return *server_; }
  SomeBus bus;

 private:
  std::unique_ptr<run::Run> server_;
  std::thread thread_;
  int64_t session_ = 0, sequence_ = 0;
  size_t from_ = 0;
};

using Controlled = ControlledOn<MemoryBus>;

inline RunOptions paused_server() {
  RunOptions options;
  options.paused = true;
  return options;
}

// A model as it is sent along in a SPAWN.
inline std::string as_file(const std::string& model) {
  return "<?xml version='1.0'?><sdf version='1.9' xmlns:ruedo='ruedo'>" + model + "</sdf>";
}

inline std::string box_sdf(const std::string& name, const std::string& size, bool is_static,
                           double x = 0, double y = 0, double z = 0) {
  const std::string place =
      std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + " 0 0 0";
  return "<model name='" + name + "'><pose>" + place + "</pose>" +
         (is_static ? "<static>true</static>" : "") +
         "<link "
         "name='link'><inertial><mass>1</mass><inertia><ixx>0.02</ixx><iyy>0.02</iyy><izz>0.02</"
         "izz></inertia></inertial>"
         "<collision name='c'><geometry><box><size>" +
         size + "</size></box></geometry></collision></link></model>";
}

}  // namespace ruedo::run
