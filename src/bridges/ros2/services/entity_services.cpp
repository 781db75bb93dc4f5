// The services that look at entities, and change them.
#include <algorithm>
#include <utility>

#include "bridges/ros2/messages/conversions.h"
#include "bridges/ros2/services/services.h"
#include "engine/edits/edits.h"
#include "engine/outcome.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"

namespace ruedo::ros2 {

namespace {

using engine::encoded;

void put_vector(CdrWriter& out, const Vec3& v) { out.put(v.x()).put(v.y()).put(v.z()); }

void put_state(CdrWriter& out, const state_reply_t& state) {
  put_header(out, state.utime, "world");
  const double* q = state.orientation;
  for (const double x : state.position) out.put(x);
  for (const double x : {q[1], q[2], q[3], q[0]}) out.put(x);
  for (const double x : state.linear) out.put(x);
  for (const double x : state.angular) out.put(x);
  for (int i = 0; i < 6; ++i) out.put(0.0);  // acceleration
}

Pose pose_of(const state_reply_t& state) {
  const double *p = state.position, *q = state.orientation;
  return {Quat(q[0], q[1], q[2], q[3]), Vec3(p[0], p[1], p[2])};
}

void copy(const Vec3& from, double (&to)[3]) { std::copy_n(from.data(), 3, to); }

}  // namespace

struct Services::Selection {
  Selection(CallPointer from, bool with_states)
      : call(std::move(from)), with_states(with_states), filter(call->in) {}

  CallPointer call;
  bool with_states;
  EntityFilter filter;
  struct Chosen {
    std::string name;
    std::optional<Eigen::AlignedBox3d> box;
    state_reply_t state{};
    bool is_there = true;
  };
  std::vector<Chosen> chosen;
  size_t next = 0;  // to ask for
};

void Services::delete_entity(const CallPointer& call) {
  name_request_t body;
  body.name = call->in.get_text();
  if (!call->in.good()) return void(++faulty_);
  in_turn(call, {{request_t::REMOVE, encoded(body)}});
}

void Services::select(const CallPointer& call, bool with_states) {
  const auto selection = std::make_shared<Selection>(call, with_states);
  if (!call->in.good()) return void(++faulty_);
  if (selection->filter.fault().code != kOk) return answer(call, selection->filter.fault());
  {
    const std::lock_guard lock(mutex_);
    for (const std::string& name : entities_.matching(selection->filter))
      selection->chosen.push_back({name, entities_.find(name)->box});
  }
  if (with_states || selection->filter.has_bounds()) return next_state(selection);
  answer_selection(*selection);
}

// One after the other: a client's share of the run's attention.
void Services::next_state(const std::shared_ptr<Selection>& selection) {
  if (selection->next == selection->chosen.size()) return answer_selection(*selection);
  ask_state(selection->call->client(), selection->chosen[selection->next].name,
            [this, selection](const Result& result, const state_reply_t& state) {
              if (result.code != kOk && result.code != kNotFound)  // it left meanwhile
                return answer(selection->call, result);
              Selection::Chosen& chosen = selection->chosen[selection->next++];
              chosen.state = state;
              chosen.is_there =
                  result.code == kOk && (!selection->filter.has_bounds() ||
                                         selection->filter.overlaps(chosen.box, pose_of(state)));
              next_state(selection);
            });
}

void Services::answer_selection(const Selection& selection) {
  std::vector<const Selection::Chosen*> found;
  for (const Selection::Chosen& chosen : selection.chosen)
    if (chosen.is_there) found.push_back(&chosen);
  CdrWriter out = selection.call->answer();
  out.put(uint8_t{kOk}).put("").put_length(found.size());
  for (const auto* chosen : found) out.put(chosen->name);
  if (selection.with_states) {
    out.put_length(found.size());
    for (const auto* chosen : found) put_state(out, chosen->state);
  }
  send(selection.call, out);
}

void Services::get_entity_bounds(const CallPointer& call) {
  const std::string name = call->in.get_text();
  if (!call->in.good()) return void(++faulty_);
  std::optional<Entities::Entity> entity;
  {
    const std::lock_guard lock(mutex_);
    if (const Entities::Entity* found = entities_.find(name)) entity = *found;
  }
  if (!entity) return answer(call, kNotFound, "there is no entity '" + name + "'");
  CdrWriter out = call->answer();
  out.put(uint8_t{kOk}).put("").put(static_cast<uint8_t>(entity->box.has_value()));
  out.put_length(entity->box ? 2 : 0);
  if (entity->box) {
    Eigen::AlignedBox3d box;  // in the canonical link's frame
    const Pose X_LM = entity->X_ML.inverse();
    for (int corner = 0; corner < 8; ++corner)
      box.extend(X_LM * entity->box->corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
    put_vector(out, box.max());
    put_vector(out, box.min());
  }
  send(call, out);
}

void Services::get_entity_info(const CallPointer& call) {
  const std::string name = call->in.get_text();
  if (!call->in.good()) return void(++faulty_);
  CdrWriter out = call->answer();
  {
    const std::lock_guard lock(mutex_);
    const Entities::Entity* entity = entities_.find(name);
    if (!entity) return answer(call, kNotFound, "there is no entity '" + name + "'");
    out.put(uint8_t{kOk}).put("").put(entity->category).put(entity->description);
    out.put_length(entity->tags.size());
    for (const std::string& tag : entity->tags) out.put(tag);
  }
  send(call, out);
}

void Services::set_entity_info(const CallPointer& call) {
  constexpr size_t kMostBytes = 10'000;
  const std::string name = call->in.get_text();
  const auto category = call->in.get<uint8_t>();
  std::string description = call->in.get_text();
  std::vector<std::string> tags = call->in.get_texts();
  if (!call->in.good()) return void(++faulty_);
  size_t bytes = description.size();
  for (const std::string& tag : tags) bytes += tag.size() + sizeof(uint32_t);
  if (bytes > kMostBytes)
    return answer(call, kFailed, "a description and tags of at most 10000 bytes are kept");
  if (category > kStatic || category == 3)
    return answer(call, kFailed, "categories are 0, 1, 2, 4 and 5");
  const std::lock_guard lock(mutex_);
  if (!entities_.say(name, category, std::move(description), std::move(tags)))
    return answer(call, kNotFound, "there is no entity '" + name + "'");
  answer(call, Result{});
}

void Services::get_entity_state(const CallPointer& call) {
  const std::string name = call->in.get_text();
  if (!call->in.good()) return void(++faulty_);
  if (name.empty()) return answer(call, kNotFound, "the name is empty");
  ask_state(call->client(), name, [this, call](const Result& result, const state_reply_t& state) {
    if (result.code != kOk) return answer(call, result);
    CdrWriter out = call->answer();
    out.put(result.code).put("");
    put_state(out, state);
    send(call, out);
  });
}

void Services::set_entity_state(const CallPointer& call) {
  CdrReader& in = call->in;
  set_pose_request_t pose;
  pose.name = in.get_text();
  in.skip<uint32_t>(2);
  Motion motion;
  motion.frame = in.get_text();
  for (double& x : pose.position) x = in.get<double>();
  for (const size_t i : {1, 2, 3, 0}) pose.orientation[i] = in.get<double>();
  Vec3 acceleration[2];
  for (Vec3* v : {&motion.twist.linear, &motion.twist.angular, &acceleration[0], &acceleration[1]})
    for (double& x : *v) x = in.get<double>();
  if (!in.good()) return void(++faulty_);
  const bool rests = motion.twist.linear.isZero(0) && motion.twist.angular.isZero(0);
  {
    const std::lock_guard lock(mutex_);
    const Entities::Entity* entity = entities_.find(pose.name);
    if (!entity) return answer(call, kNotFound, "there is no entity '" + pose.name + "'");
    if (entity->is_static && !(rests && acceleration[0].isZero(0) && acceleration[1].isZero(0)))
      return answer(call, kFailed, "'" + pose.name + "' is static: it has no twist");
  }
  if (const std::string fault = engine::fault_of_pose(pose.position, pose.orientation);
      !fault.empty())
    return answer(call, kInvalidState, fault);
  motion.pose = engine::pose_of(pose);
  to_world(call->client(), motion,
           [this, call, pose, rests](const Result& result, const Motion& moved) {
             if (result.code != kOk)
               return answer(call, result.code == kNotFound ? uint8_t{kInvalidState} : result.code,
                             result.text);
             set_pose_request_t placed = pose;
             const Quat& q = moved.pose.rotation;
             copy(moved.pose.translation, placed.position);
             const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
             std::copy_n(wxyz, 4, placed.orientation);
             set_twist_request_t twist;
             twist.name = pose.name;
             copy(moved.twist.linear, twist.linear);
             copy(moved.twist.angular, twist.angular);
             const Step put{request_t::SET_POSE, encoded(placed)};
             const Step push{request_t::SET_TWIST, encoded(twist)};
             // SET_POSE brings it to rest, and so the twist comes after it; but before it, too, so
             // that an entity which cannot have one stays where it is.
             if (rests) return in_turn(call, {put});
             in_turn(call, {push, put, push});
           });
}

}  // namespace ruedo::ros2
