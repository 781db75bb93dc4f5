// design.ros2.org/articles/actions.html: names, types and the goals' states.
#include "bridges/ros2/services/step_action.h"

#include <algorithm>
#include <chrono>

#include "engine/outcome.h"
#include "ruedo/request_t.hpp"
#include "ruedo/step_request_t.hpp"

namespace ruedo::ros2 {
namespace {

constexpr const char* kType = "simulation_interfaces/action/SimulateSteps";
constexpr uint8_t kOk = 1, kFailed = 4;  // simulation_interfaces/msg/Result
constexpr uint64_t kNode = 0;            // the caller of a goal's steps: not a client

int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

void put_stamp(CdrWriter& out, int64_t ns) {
  constexpr int64_t kSecond = 1'000'000'000;
  out.put(static_cast<int32_t>(ns / kSecond)).put(static_cast<uint32_t>(ns % kSecond));
}

int64_t read_stamp(CdrReader& in) {
  const auto seconds = in.get<int32_t>();
  const auto ns = in.get<uint32_t>();
  return int64_t{seconds} * 1'000'000'000 + ns;
}

template <size_t size>
std::array<uint8_t, size> read_bytes(CdrReader& in) {
  std::array<uint8_t, size> bytes;
  for (uint8_t& byte : bytes) byte = in.get<uint8_t>();
  return bytes;
}

void put_bytes(CdrWriter& out, std::span<const uint8_t> bytes) { out.put_array(bytes); }

}  // namespace

StepAction::StepAction(const ServiceContext& context, Requests& requests,
                       std::atomic<uint64_t>& faulty)
    : requests_(requests), faulty_(faulty), name_(context.names.topic("", "simulate_steps")) {
  const std::string type = kType;
  const auto writer = [&](const std::string& part, const std::string& of, const Qos& qos) {
    return context.transport.add_writer(
        {Role::topic,
         {context.names.topic("", "simulate_steps/_action/" + part), of, qos},
         type_hash(of, context.distro)});
  };
  const auto service = [&](const char* part, const std::string& of,
                           void (StepAction::*handler)(const CallPointer&)) {
    return std::make_unique<ServiceServer>(
        context, std::string("simulate_steps/_action/") + part, of,
        [this, handler](const CallPointer& call) { (this->*handler)(call); }, faulty_);
  };
  feedback_ = writer("feedback", type + "_FeedbackMessage", kStateQos);
  status_ = writer("status", "action_msgs/msg/GoalStatusArray", kLatchedQos);
  send_goal_ = service("send_goal", type + "_SendGoal", &StepAction::send_goal);
  cancel_goal_ = service("cancel_goal", "action_msgs/srv/CancelGoal", &StepAction::cancel_goal);
  get_result_ = service("get_result", type + "_GetResult", &StepAction::get_result);
}

Topic StepAction::topic() const { return {name_, kType, kCommandQos}; }

std::vector<const Reader*> StepAction::readers() const {
  return {&send_goal_->requests(), &cancel_goal_->requests(), &get_result_->requests()};
}

std::vector<const Writer*> StepAction::writers() const {
  return {&send_goal_->replies(), &cancel_goal_->replies(), &get_result_->replies(),
          feedback_.get(), status_.get()};
}

StepAction::Goal* StepAction::find(const Uuid& id) {
  const auto found =
      std::find_if(goals_.begin(), goals_.end(), [&](const Goal& goal) { return goal.id == id; });
  return found == goals_.end() ? nullptr : &*found;
}

StepAction::Goal* StepAction::active() {
  return goals_.empty() || goals_.back().is_over() ? nullptr : &goals_.back();
}

void StepAction::send_goal(const CallPointer& call) {
  Goal goal;
  goal.id = read_bytes<16>(call->in);
  goal.steps = call->in.get<uint64_t>();
  goal.accepted_ns = now_ns();
  if (!call->in.good()) return void(++faulty_);
  bool accepted = false;
  {
    const std::lock_guard lock(mutex_);
    accepted = !active() && !find(goal.id);
    CdrWriter out = call->answer();
    out.put(accepted);
    put_stamp(out, accepted ? goal.accepted_ns : 0);
    call->send(out);
    if (!accepted) return;
    if (goals_.size() >= kMostGoals) goals_.pop_front();
    goals_.push_back(std::move(goal));
    tell_status();
  }
  step();
}

void StepAction::step() {
  step_request_t body;
  body.steps = 1;
  {
    const std::lock_guard lock(mutex_);
    Goal* goal = active();
    if (!goal) return;
    if (goal->status == canceling) return end(*goal, canceled, kOk, "");
    if (goal->done == goal->steps) return end(*goal, succeeded, kOk, "");
  }
  requests_.send(kNode, request_t::STEP, engine::encoded(body),
                 [this](const reply_t& reply) { stepped(reply); });
}

void StepAction::stepped(const reply_t& reply) {
  {
    const std::lock_guard lock(mutex_);
    Goal* goal = active();
    if (!goal) return;
    if (reply.code != reply_t::OK) return end(*goal, aborted, kFailed, reply.text);
    ++goal->done;
    CdrWriter out;
    put_bytes(out, goal->id);
    out.put(goal->done).put(goal->steps - goal->done);
    feedback_->write(out.bytes());
  }
  step();
}

void StepAction::end(Goal& goal, Status status, uint8_t result, const std::string& text) {
  goal.status = status;
  goal.result = result;
  goal.text = text;
  tell_status();
  for (const CallPointer& call : goal.waiting) answer_result(call, status, result, text);
  goal.waiting.clear();
}

void StepAction::tell_status() {
  CdrWriter out;
  out.put_length(goals_.size());
  for (const Goal& goal : goals_) {
    put_bytes(out, goal.id);
    put_stamp(out, goal.accepted_ns);
    out.put(static_cast<int8_t>(goal.status));
  }
  status_->write(out.bytes());
}

void StepAction::answer_result(const CallPointer& call, Status status, uint8_t result,
                               const std::string& text) {
  CdrWriter out = call->answer();
  out.put(static_cast<int8_t>(status)).put(result).put(text);
  call->send(out);
}

void StepAction::get_result(const CallPointer& call) {
  const Uuid id = read_bytes<16>(call->in);
  if (!call->in.good()) return void(++faulty_);
  const std::lock_guard lock(mutex_);
  Goal* goal = find(id);
  if (!goal) return answer_result(call, unknown, kFailed, "there is no such goal");
  if (goal->is_over()) return answer_result(call, goal->status, goal->result, goal->text);
  if (goal->waiting.size() >= kMostWaiting)
    return answer_result(call, unknown, kFailed, "too many wait for this goal already");
  goal->waiting.push_back(call);
}

// No id and no time: all goals; an id: that one; a time: all that were accepted until then, too.
void StepAction::cancel_goal(const CallPointer& call) {
  enum : int8_t { none = 0, unknown_id = 2, terminated = 3 };
  const Uuid id = read_bytes<16>(call->in);
  const int64_t until_ns = read_stamp(call->in);
  if (!call->in.good()) return void(++faulty_);
  const bool any = id == Uuid{};
  const std::lock_guard lock(mutex_);
  Goal* goal = active();
  const bool meant = goal && ((any && until_ns == 0) || (!any && goal->id == id) ||
                              (until_ns != 0 && goal->accepted_ns <= until_ns));
  if (meant) goal->status = canceling;  // once the step that is being taken is done
  CdrWriter out = call->answer();
  const int8_t code = meant || any ? none : find(id) ? terminated : unknown_id;
  out.put(code).put_length(meant ? 1 : 0);
  if (meant) {
    put_bytes(out, goal->id);
    put_stamp(out, goal->accepted_ns);
  }
  call->send(out);
  if (meant) tell_status();
}

}  // namespace ruedo::ros2
