// Bodies by their names: where they are, how they move, and putting them elsewhere.
#include <algorithm>

#include "core.h"
#include "replies.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"

namespace ruedo::client {
namespace {

constexpr double kReplyTime = 5.0;  // s

State state(Core& core, const std::string& name) {
  name_request_t body;
  body.name = name;
  return state_of(core.session().request(request_t::GET_STATE, encoded(body), kReplyTime));
}

}  // namespace

Transform Body::pose() const {
  const State now = state(*core_, name);
  return {now.position, now.orientation};
}

Twist Body::twist() const {
  const State now = state(*core_, name);
  return {now.linear, now.angular};
}

void Body::set_pose(const Transform& pose) const {
  set_pose_request_t body;
  body.name = name;
  std::copy(pose.position.begin(), pose.position.end(), body.position);
  std::copy(pose.orientation.begin(), pose.orientation.end(), body.orientation);
  core_->session().request(request_t::SET_POSE, encoded(body), kReplyTime);
}

void Body::set_twist(const Twist& twist) const {
  set_twist_request_t body;
  body.name = name;
  std::copy(twist.linear.begin(), twist.linear.end(), body.linear);
  std::copy(twist.angular.begin(), twist.angular.end(), body.angular);
  core_->session().request(request_t::SET_TWIST, encoded(body), kReplyTime);
}

Body Simulation::body(const std::string& name) const {
  const auto info = core()->info();
  BodyInfo whole{name, true, 0.0};
  bool found = false;
  std::string models, last;
  for (const BodyInfo& body : info->bodies) {
    const std::string model = body.name.substr(0, body.name.find('/'));
    if (model != last) models += (models.empty() ? "" : ", ") + model;
    last = model;
    if (body.name != name && body.name.rfind(name + "/", 0) != 0) continue;
    found = true;
    whole.is_static = whole.is_static && body.is_static;
    whole.mass += body.mass;
  }
  if (found) return {core(), whole};
  throw UnknownName("there is no model or MODEL/LINK '" + name + "'; there is " +
                    (models.empty() ? "none" : models));
}

}  // namespace ruedo::client
