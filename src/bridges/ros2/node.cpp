#include "bridges/ros2/node.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <spdlog/spdlog.h>

#include "base/whole.h"
#include "ruedo/camera_info_t.hpp"
#include "ruedo/image_t.hpp"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/set_pose_request_t.hpp"

namespace ruedo::ros2 {
namespace {

constexpr auto kLook = std::chrono::milliseconds(20);  // interval of checks for readers of pictures

std::string key(const Topic& topic) { return topic.name + " " + topic.type; }

std::string channel_of(const std::vector<world_info_t>& info, const std::string& type) {
  for (const world_info_t& part : info) {
    for (const channel_info_t& channel : part.channels) {
      if (channel.type == type && channel.robot.empty()) return channel.name;
    }
  }
  return {};
}

}  // namespace

Node::Node(NodeOptions options, std::unique_ptr<Transport> transport,
           const std::vector<world_info_t>& info, Inject inject)
    : options_(std::move(options)),
      transport_(std::move(transport)),
      inject_(std::move(inject)),
      names_(options_.conversion.root, options_.conversion.topics, options_.conversion.tf),
      requests_([this](const std::string& channel, std::span<const uint8_t> message) {
        inject_(channel, message);
      }),
      clock_period_us_(std::max<int64_t>(1, rounded(1e6 / options_.clock_hz))) {
  clock_topic_ = {names_.topic("", "clock"), "rosgraph_msgs/msg/Clock", kStateQos};
  clock_ = transport_->add_writer(endpoint(clock_topic_));
  diagnostics_topic_ = {names_.topic("", "diagnostics"), Diagnostics::kType, kStateQos};
  diagnosed_ = transport_->add_writer(endpoint(diagnostics_topic_));
  drawn_topic_ = {names_.topic("", "markers"), MarkerArrays::kType, kMarkersQos};
  drawn_ = std::make_unique<DrawnTopic>(transport_->add_writer(endpoint(drawn_topic_)), names_);
  services_ = std::make_unique<Services>(
      ServiceContext{*transport_, options_.conversion.distro, options_.mapping, names_}, requests_,
      [this](const std::string& channel, std::span<const uint8_t> message) {
        inject_(channel, message);
      });
  graph_ = transport_->add_writer(
      endpoint({"ros_discovery_info", "rmw_dds_common/msg/ParticipantEntitiesInfo", kLatchedQos},
               Role::graph));
  take_over(info);
  names_.check_remaps();
}

Node::~Node() { stop(); }

void Node::start() {
  injecting_ = true;
  transport_->start();
}

void Node::stop() {
  injecting_ = false;
  transport_->stop();
}

Endpoint Node::endpoint(const Topic& topic, Role role) const {
  return {role, topic, type_hash(topic.type, options_.conversion.distro)};
}

// For pictures, the result of the last check; everything else costs little.
bool Node::wants(const std::string& channel) const {
  const std::lock_guard lock(pictures_mutex_);
  const auto picture = pictures_.find(channel);
  return picture == pictures_.end() || picture->second;
}

void Node::flush() {
  const Requests::Clock::time_point now = Requests::Clock::now();
  requests_.repeat(now);
  if (now < next_look_) return;
  next_look_ = now + kLook;
  const auto [lost, missed] = options_.losses();
  const Counts counted = counts();
  if (const auto message = diagnostics_.look(
          now, {lost, missed, counted.sent, counted.dropped, counted.received, counted.faulty}))
    send(*diagnosed_, *message);
  look_for_readers();
  look_for_writers();
  drawn_->look(time_us_);
}

void Node::look_for_readers() {
  const std::lock_guard lock(pictures_mutex_);
  for (auto& [channel, is_read] : pictures_) {
    const std::vector<size_t>& topics = conversions_->topics_of(channel);
    const bool now = std::any_of(topics.begin(), topics.end(),
                                 [&](size_t topic) { return writer_of_topic_[topic]->is_read(); });
    if (std::exchange(is_read, now) != now) ++audience_;
  }
}

void Node::look_for_writers() {
  bool changed = false;
  for (const Command& command : others_) {
    const bool published = transport_->is_published(command.topic);
    if (published == inputs_.contains(key(command.topic))) continue;
    changed = true;
    if (published)
      add_command(inputs_, command);
    else
      inputs_.erase(key(command.topic));
  }
  if (changed) tell_graph();
}

// The first pictures of a channel are drawn, until the first check.
void Node::add_pictures(const std::vector<world_info_t>& info) {
  const std::lock_guard lock(pictures_mutex_);
  const std::map<std::string, bool> before = std::exchange(pictures_, {});
  for (const world_info_t& part : info) {
    for (const channel_info_t& channel : part.channels) {
      if (channel.type != image_t::getTypeName() && channel.type != camera_info_t::getTypeName())
        continue;
      const auto known = before.find(channel.name);
      pictures_[channel.name] = known == before.end() || known->second;
    }
  }
  ++audience_;
}

void Node::announce(const std::shared_ptr<const run::Announcement>& announcement) {
  next_clock_us_ = 0;  // sim time may have been reset
  // A robot of the same name and devices may be another one.
  take_over(announcement->info);
}

// Before measurements of that time.
void Node::begin_step(const run::Step& step) {
  time_us_ = step.time_us;
  diagnostics_.step(step.time_us);
  if (step.time_us < next_clock_us_) return;
  next_clock_us_ = step.time_us / clock_period_us_ * clock_period_us_ + clock_period_us_;
  send(*clock_, clock_message(step.time_us));
}

void Node::message(const run::Published& message) {
  if (message.kind == run::Kind::service && message.channel == reply_channel_)
    requests_.reply({message.data, message.size});
  if (message.kind == run::Kind::record)
    drawn_->take({message.data, message.size}, message.time_us);
  if (message.kind != run::Kind::sample) return;
  conversions_->convert(
      message.channel, {message.data, message.size},
      [this](size_t topic) { return writer_of_topic_[topic]->is_read(); },
      [this](size_t topic, std::span<const uint8_t> cdr) { send(*writer_of_topic_[topic], cdr); });
}

void Node::send(Writer& writer, std::span<const uint8_t> cdr) {
  if (writer.write(cdr))
    ++sent_;
  else
    ++dropped_;
}

void Node::take_over(const std::vector<world_info_t>& info) {
  requests_.listen(channel_of(info, request_t::getTypeName()));
  reply_channel_ = channel_of(info, reply_t::getTypeName());
  services_->update(info, options_.world());
  names_.wish(services_->namespaces());
  auto conversions = std::make_unique<Conversions>(info, options_.conversion, names_);
  std::map<std::string, std::unique_ptr<Writer>> writers;
  std::vector<Writer*> of_topic;
  for (const Topic& topic : conversions->topics()) {
    auto& writer = writers[key(topic)];
    const auto known = writers_.find(key(topic));
    writer = known != writers_.end() ? std::move(known->second)
                                     : transport_->add_writer(endpoint(topic));
    of_topic.push_back(writer.get());
  }
  conversions_ = std::move(conversions);
  writers_ = std::move(writers);
  writer_of_topic_ = std::move(of_topic);
  add_pictures(info);
  listen(info);
  tell_standing();
  tell_graph();
}

// Writes changed descriptions. The description of a removed robot is withdrawn.
void Node::tell_standing() {
  std::map<std::string, Standing> told;
  for (const Conversions::Standing& each : conversions_->standing()) {
    Standing& now = told[key(each.topic)];
    if (const auto known = standing_.find(key(each.topic)); known != standing_.end())
      now = std::move(known->second);
    else
      now.writer = transport_->add_writer(endpoint(each.topic));
    if (now.cdr == each.cdr) continue;
    now.cdr = each.cdr;
    now.writer->write(now.cdr);
  }
  standing_ = std::move(told);
}

// To commands and initial poses.
void Node::listen(const std::vector<world_info_t>& info) {
  std::map<std::string, Input> inputs;
  others_.clear();
  for (const Command& command : commands_of(info, options_.stamped, options_.joints, names_)) {
    if (command.when_published) others_.push_back(command);
    if (!command.when_published || transport_->is_published(command.topic))
      add_command(inputs, command);
  }
  for (const world_info_t& part : info) {
    for (const robot_info_t& robot : part.robots) {
      const Topic topic{names_.topic(robot.name, "initialpose"),
                        "geometry_msgs/msg/PoseWithCovarianceStamped", kCommandQos};
      add_input(inputs, {topic, robot.name, {}, nullptr},
                [this, name = robot.name, topic](const Sample& sample) {
                  receive_pose(name, topic.name, sample);
                });
    }
  }
  inputs_ = std::move(inputs);
}

void Node::add_command(std::map<std::string, Input>& inputs, const Command& command) {
  add_input(inputs, {command.topic, command.channel, command.joints, nullptr},
            [this, command](const Sample& sample) { on_command(command, sample.cdr); });
}

// An existing reader that does the same stays. Else it ends first: no message may be read
// twice.
void Node::add_input(std::map<std::string, Input>& inputs, Input input,
                     Transport::Handler handler) {
  auto known = inputs_.extract(key(input.topic));
  if (known && known.mapped().target == input.target && known.mapped().joints == input.joints) {
    inputs.insert(std::move(known));
    return;
  }
  known = {};
  const auto [at, fresh] = inputs.try_emplace(key(input.topic), std::move(input));
  if (fresh) at->second.reader = transport_->add_reader(endpoint(at->second.topic), handler);
}

void Node::tell_graph() {
  const size_t size = options_.conversion.distro == Distro::humble ? 24 : 16;
  CdrWriter out;
  const auto put_gid = [&](const Gid& gid) {
    std::vector<uint8_t> padded(gid.begin(), gid.end());
    padded.resize(size);
    out.put_array(std::span<const uint8_t>(padded));
  };
  put_gid(transport_->gid());
  out.put_length(1).put("/").put("ruedo");
  out.put_length(inputs_.size() + services_->readers().size());
  for (const auto& [name, input] : inputs_) put_gid(input.reader->gid());
  for (const Reader* reader : services_->readers()) put_gid(reader->gid());
  out.put_length(writers_.size() + standing_.size() + services_->writers().size() + 3);
  for (const auto& [name, writer] : writers_) put_gid(writer->gid());
  for (const Writer* writer : services_->writers()) put_gid(writer->gid());
  put_gid(clock_->gid());
  put_gid(diagnosed_->gid());
  put_gid(drawn_->writer().gid());
  for (const auto& [name, standing] : standing_) put_gid(standing.writer->gid());
  graph_->write(out.bytes());
}

void Node::on_command(const Command& command, std::span<const uint8_t> cdr) {
  ++received_;
  if (!injecting_) return;
  if (const auto bytes = command.convert(cdr)) return inject_(command.channel, *bytes);
  count_faulty(command.topic.name, command.topic.type, cdr.size());
}

// The robot is placed where the message says: the map frame is the world.
void Node::receive_pose(const std::string& robot, const std::string& topic, const Sample& sample) {
  ++received_;
  if (!injecting_) return;
  CdrReader in(sample.cdr);
  in.skip<uint32_t>(2);
  const std::string frame = in.get_text();
  set_pose_request_t pose;
  pose.name = robot;
  for (double& x : pose.position) x = in.get<double>();
  for (const size_t i : {1, 2, 3, 0}) pose.orientation[i] = in.get<double>();
  if (!in.good() || !(frame.empty() || frame == "map" || frame == "world"))
    return count_faulty(topic, "pose in the frame map", sample.cdr.size());
  std::vector<uint8_t> body(static_cast<size_t>(pose.getEncodedSize()));
  pose.encode(body.data(), 0, static_cast<int>(body.size()));
  requests_.send(sample.sender, request_t::SET_POSE, std::move(body),
                 [this, topic](const reply_t& reply) {
                   if (reply.code != reply_t::OK && may_warn())
                     spdlog::warn("ROS 2: {}: {}", topic, reply.text);
                 });
}

bool Node::may_warn() {
  const int64_t now = std::chrono::steady_clock::now().time_since_epoch().count();
  int64_t last = last_warning_ns_;
  if (now < last + 1'000'000'000 && last != 0) return false;
  return last_warning_ns_.compare_exchange_strong(last, now);
}

void Node::count_faulty(const std::string& topic, const std::string& type, size_t size) {
  const uint64_t faulty = ++faulty_;
  if (!may_warn()) return;
  spdlog::warn(
      "ROS 2: {} got {} bytes that are not a valid {} for this robot: ignored ({} such so far)",
      topic, size, type, faulty);
}

bool Node::is_read() const {
  return std::any_of(writers_.begin(), writers_.end(),
                     [](const auto& each) { return each.second->is_read(); });
}

bool Node::is_written(const std::string& topic) {
  look_for_writers();
  return std::any_of(inputs_.begin(), inputs_.end(), [&](const auto& each) {
    return each.second.topic.name == topic && each.second.reader->writers() > 0;
  });
}

size_t Node::peers() const {
  size_t count = 0;
  for (const auto& [name, writer] : writers_) count += writer->readers();
  for (const auto& [name, input] : inputs_) count += input.reader->writers();
  return count;
}

std::vector<Topic> Node::outputs() const {
  std::vector<Topic> topics = conversions_->topics();
  topics.push_back(clock_topic_);
  topics.push_back(diagnostics_topic_);
  topics.push_back(drawn_topic_);
  for (const Conversions::Standing& each : conversions_->standing()) topics.push_back(each.topic);
  return topics;
}

std::vector<Topic> Node::inputs() const {
  std::vector<Topic> topics;
  for (const auto& [name, input] : inputs_) topics.push_back(input.topic);
  return topics;
}

}  // namespace ruedo::ros2
