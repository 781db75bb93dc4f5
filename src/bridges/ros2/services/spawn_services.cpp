// The services that put models into the world, and that list them.
#include <algorithm>
#include <cctype>
#include <utility>

#include <fmt/format.h>

#include "bridges/ros2/services/services.h"
#include "engine/edits/edits.h"
#include "engine/outcome.h"
#include "ruedo/decode.h"
#include "ruedo/request_t.hpp"
#include "run/requests/control.h"
#include "world/model_library.h"

namespace ruedo::ros2 {

namespace {

using engine::encoded;

// Names of letters, digits and underscores, none of which begins with a digit, between slashes.
bool is_namespace(const std::string& text) {
  if (text.empty() || text.find("__") != text.npos) return false;
  char before = '/';
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool digit = std::isdigit(byte) != 0, letter = byte < 128 && std::isalpha(byte) != 0;
    if (before == '/' ? !letter && c != '_' : !letter && !digit && c != '_' && c != '/')
      return false;
    before = c;
  }
  return before != '/';
}

}  // namespace

struct Services::Order {
  spawn_request_t body;
  bool renames = false;
  std::string name_space;  // without the first slash
  std::string frame;

  explicit Order(CdrReader& in) {
    body.name = in.get_text();
    renames = in.get<bool>();
    body.model = in.get_text();
    body.text = in.get_text();
    name_space = in.get_text();
    in.skip<uint32_t>(2);
    frame = in.get_text();
    for (double& x : body.position) x = in.get<double>();
    for (const size_t i : {1, 2, 3, 0}) body.orientation[i] = in.get<double>();
    if (body.model.starts_with("file://")) body.model = body.model.substr(7);
    if (!body.model.empty()) body.text.clear();
    if (name_space.starts_with('/')) name_space = name_space.substr(1);
  }
};

struct Services::Orders {
  CallPointer call;
  std::vector<Order> waiting;  // the last is the next
  std::vector<std::pair<Result, std::string>> done;
};

void Services::get_spawnables(const CallPointer& call) {
  const std::vector<std::string> sources = call->in.get_texts();
  if (!call->in.good()) return void(++faulty_);
  std::string file;
  {
    const std::lock_guard lock(mutex_);
    if (entities_.world()) file = entities_.world()->file;
  }
  const std::vector<world::ListedModel> models = world::listed_models(file);
  std::string text;
  for (const std::string& source : sources)
    text += (text.empty() ? "sources that are not searched: " : ", ") + source;
  CdrWriter out = call->answer();
  out.put(uint8_t{kOk}).put(text).put_length(models.size());
  for (const world::ListedModel& model : models) {
    out.put(model.name).put(model.is_robot ? "a robot" : "a model");
    out.put(uint8_t{0}).put_length(0);  // bounds
  }
  send(call, out);
}

void Services::spawn_entity(const CallPointer& call) {
  Order order(call->in);
  if (!call->in.good()) return void(++faulty_);
  spawn(call->client(), std::move(order),
        [this, call](const Result& result, const std::string& name) {
          CdrWriter out = call->answer();
          out.put(result.code).put(result.text).put(name);
          send(call, out);
        });
}

void Services::spawn_entities(const CallPointer& call) {
  constexpr size_t kSmallest = 64;  // bytes of an order
  const auto orders = std::make_shared<Orders>();
  orders->call = call;
  for (size_t left = call->in.get_length(kSmallest); left > 0 && call->in.good(); --left)
    orders->waiting.emplace_back(call->in);
  if (!call->in.good()) return void(++faulty_);
  std::reverse(orders->waiting.begin(), orders->waiting.end());
  spawn_next(orders);
}

void Services::spawn_next(const std::shared_ptr<Orders>& orders) {
  if (!orders->waiting.empty()) {
    Order order = std::move(orders->waiting.back());
    orders->waiting.pop_back();
    return spawn(orders->call->client(), std::move(order),
                 [this, orders](const Result& result, const std::string& name) {
                   orders->done.emplace_back(result, name);
                   spawn_next(orders);
                 });
  }
  const auto failed = std::count_if(orders->done.begin(), orders->done.end(),
                                    [](const auto& each) { return each.first.code != kOk; });
  CdrWriter out = orders->call->answer();
  out.put(uint8_t{failed > 0 ? kSpawnFailed : kOk});
  out.put(failed > 0 ? fmt::format("{} of {} were not spawned", failed, orders->done.size()) : "");
  out.put_length(orders->done.size());
  for (const auto& [result, name] : orders->done) out.put(result.code).put(result.text).put(name);
  send(orders->call, out);
}

// The checks without the model.
Result Services::fault_of(const Order& order) const {
  const spawn_request_t& body = order.body;
  if (body.model.empty() && body.text.empty()) return {kNoResource, "give uri or resource_string"};
  if (body.name.empty() && !order.renames)
    return {kNameInvalid, "the name is empty, and allow_renaming is false"};
  if (const std::string fault = body.name.empty() ? "" : engine::fault_of_name(body.name);
      !fault.empty())
    return {kNameInvalid, "the name " + fault};
  if (!order.name_space.empty() && !is_namespace(order.name_space))
    return {kNamespaceInvalid, "'" + order.name_space + "' is not a namespace of ROS"};
  if (const std::string fault = engine::fault_of_pose(body.position, body.orientation);
      !fault.empty())
    return {kInvalidPose, fault};
  if (const size_t size = encoded(body).size(); size > run::Control::kMaxRequestSize)
    return {kFailed, fmt::format("its body has {} bytes: a request has {} at most", size,
                                 run::Control::kMaxRequestSize)};
  return {};
}

// The model is read before the request, so that the reply reports its faults.
void Services::spawn(uint64_t client, Order order, Spawned then) {
  if (const Result fault = fault_of(order); fault.code != kOk) return then(fault, "");
  std::string file;
  {
    const std::lock_guard lock(mutex_);
    if (served_ == 0)
      return then({kUnsupported, "this run accepts no requests (--control off)"}, "");
    if (entities_.world()) file = entities_.world()->file;
  }
  std::string uri = order.body.model, text = order.body.text;
  checks_.add(std::move(uri), std::move(text), file,
              [this, client, order = std::move(order), then = std::move(then)](
                  const Result& result, const std::string& name) {
                if (result.code != kOk) return then(result, "");
                Order named = order;
                if (named.body.name.empty()) named.body.name = name;
                spawn_checked(client, std::move(named), then);
              });
}

void Services::spawn_checked(uint64_t client, Order order, const Spawned& then) {
  if (const Result fault = reserve(order); fault.code != kOk) return then(fault, "");
  const auto done = [this, asked = order.body.name, then](const Result& result,
                                                          const std::string& name) {
    release(asked, result.code == kOk);
    then(result, name);
  };
  const auto place = [this, client, order, done](const Result& result, const Motion& moved) {
    if (result.code != kOk)
      return done({result.code == kNotFound ? uint8_t{kInvalidPose} : result.code, result.text},
                  "");
    spawn_request_t body = order.body;
    const Quat& q = moved.pose.rotation;
    std::copy_n(moved.pose.translation.data(), 3, body.position);
    const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
    std::copy_n(wxyz, 4, body.orientation);
    body.on_ground = false;
    requests_.send(client, request_t::SPAWN, encoded(body), [done](const reply_t& reply) {
      state_reply_t state{};
      if (reply.code == reply_t::OK) decode_checked(reply.body.data(), reply.body.size(), state);
      done(result_of(reply), state.name);
    });
  };
  const spawn_request_t& body = order.body;
  const double *p = body.position, *q = body.orientation;
  to_world(client, {order.frame, {Quat(q[0], q[1], q[2], q[3]), Vec3(p[0], p[1], p[2])}, {}},
           place);
}

Result Services::reserve(Order& order) {
  std::string& name = order.body.name;
  const std::lock_guard lock(mutex_);
  if (entities_.find(name) || spawning_.contains(name)) {
    if (!order.renames) return {kNameNotUnique, "there is a '" + name + "' already"};
    name = free_name(name);
  }
  if (!order.name_space.empty()) {
    for (const auto& [other, taken] : namespaces_)
      if (taken == order.name_space)
        return {kNamespaceInvalid, "the namespace '" + taken + "' is that of '" + other + "'"};
    namespaces_[name] = order.name_space;
  }
  spawning_.insert(name);
  return {};
}

void Services::release(const std::string& name, bool spawned) {
  const std::lock_guard lock(mutex_);
  spawning_.erase(spawning_.find(name));
  if (!spawned) namespaces_.erase(name);
}

std::string Services::free_name(const std::string& wanted) const {
  std::string name = wanted;
  for (int i = 2; entities_.find(name) || spawning_.contains(name); ++i)
    name = wanted + "_" + std::to_string(i);
  return name;
}

}  // namespace ruedo::ros2
