#include "ros2/node.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <spdlog/spdlog.h>

#include "core/whole.h"
#include "ruedo/decode.h"

namespace ruedo::ros2 {
namespace {

constexpr auto kLook = std::chrono::milliseconds(50);    // how often it is looked who reads

std::string key(const Topic& topic) { return topic.name + " " + topic.type; }

// What names and channels depend on; not the time, and whether the run is paused.
bool is_same(const std::vector<world_info_t>& a, const std::vector<world_info_t>& b) {
  const auto names = [](const std::vector<world_info_t>& info) {
    std::vector<std::string> all;
    for (const world_info_t& part : info) {
      for (const channel_info_t& channel : part.channels) all.push_back(channel.name + " " + channel.type);
      for (const device_info_t& device : part.devices) all.push_back(device.robot + "/" + device.name);
    }
    return all;
  };
  return names(a) == names(b);
}

std::string channel_of(const std::vector<world_info_t>& info, const std::string& type) {
  for (const world_info_t& part : info) {
    for (const channel_info_t& channel : part.channels) {
      if (channel.type == type && channel.robot.empty()) return channel.name;
    }
  }
  return {};
}

}  // namespace

Node::Node(NodeOptions options, std::unique_ptr<Transport> transport, const std::vector<world_info_t>& info, Inject inject)
    : options_(std::move(options)),
      transport_(std::move(transport)),
      inject_(std::move(inject)),
      names_(options_.conversion.many, options_.conversion.topics),
      clock_period_us_(std::max<int64_t>(1, rounded(1e6 / options_.clock_hz))) {
  clock_topic_ = {names_.topic("", "clock"), "rosgraph_msgs/msg/Clock", kStateQos};
  static_frames_topic_ = {names_.topic("", "tf_static"), "tf2_msgs/msg/TFMessage", kLatchedQos};
  clock_ = transport_->add_writer(endpoint(clock_topic_));
  static_frames_ = transport_->add_writer(endpoint(static_frames_topic_));
  graph_ = transport_->add_writer(endpoint({"ros_discovery_info", "rmw_dds_common/msg/ParticipantEntitiesInfo", kLatchedQos}, Role::graph));
  take_over(info);
  names_.check_remaps();
}

Node::~Node() { stop(); }

void Node::start() {
  injecting_ = true;
  transport_->start();
  thread_ = std::thread([this] { work(); });
}

void Node::stop() {
  injecting_ = false;
  transport_->stop();
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  if (thread_.joinable()) thread_.join();
}

Endpoint Node::endpoint(const Topic& topic, Role role) const { return {role, topic, type_hash(topic.type, options_.conversion.distro)}; }

void Node::offer(const std::string& channel, const uint8_t* data, size_t size) {
  const std::lock_guard lock(mutex_);
  const auto wanted = wanted_.find(channel);
  if (wanted == wanted_.end() || !wanted->second) return;
  queue_.push_back({-1, channel, {data, data + size}});
  queued_ += size;
  while (queued_ > kMostQueued && queue_.size() > 1) {
    queued_ -= queue_.front().bytes.size();
    queue_.pop_front();
    ++dropped_;
  }
  wake_.notify_one();
}

void Node::state(int64_t utime) {
  const std::lock_guard lock(mutex_);
  // Time goes back with a reset.
  if (utime < next_clock_us_ && utime + clock_period_us_ >= next_clock_us_) return;
  next_clock_us_ = utime / clock_period_us_ * clock_period_us_ + clock_period_us_;
  queue_.push_back({utime, {}, {}});
  wake_.notify_one();
}

void Node::work() {
  std::deque<Item> items;
  auto next_look = std::chrono::steady_clock::now();
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait_until(lock, next_look, [this] { return stopping_ || !queue_.empty(); });
      if (stopping_) return;
      items.swap(queue_);
      queued_ = 0;
    }
    for (const Item& item : items) handle(item);
    items.clear();
    if (std::chrono::steady_clock::now() < next_look) continue;
    update_wanted();
    next_look = std::chrono::steady_clock::now() + kLook;
  }
}

void Node::handle(const Item& item) {
  if (item.clock >= 0) return send(*clock_, clock_message(item.clock));
  if (item.channel == info_channel_) return handle_info(item);
  conversions_->convert(item.channel, item.bytes, [this](size_t topic) { return writer_of_topic_[topic]->is_read(); },
                        [this](size_t topic, std::span<const uint8_t> cdr) { send(*writer_of_topic_[topic], cdr); });
}

void Node::send(Writer& writer, std::span<const uint8_t> cdr) {
  if (writer.write(cdr)) ++sent_;
  else ++dropped_;
}

// Comes in parts; all of them make a whole.
void Node::handle_info(const Item& item) {
  world_info_t part;
  if (decode_checked(item.bytes.data(), item.bytes.size(), part) != DecodeFault::none) return;
  if (part.part == 0) parts_.clear();
  const bool next = part.part == static_cast<int16_t>(parts_.size());
  const int16_t count = part.nparts;
  if (!next) return parts_.clear();
  parts_.push_back(std::move(part));
  if (static_cast<int16_t>(parts_.size()) != count) return;
  if (!is_same(parts_, info_)) take_over(parts_);
  parts_.clear();
}

void Node::take_over(const std::vector<world_info_t>& info) {
  info_ = info;
  info_channel_ = channel_of(info, world_info_t::getTypeName());
  auto conversions = std::make_unique<Conversions>(info, options_.conversion, names_);
  std::map<std::string, std::unique_ptr<Writer>> writers;
  std::vector<Writer*> of_topic;
  for (const Topic& topic : conversions->topics()) {
    auto& writer = writers[key(topic)];
    const auto known = writers_.find(key(topic));
    writer = known != writers_.end() ? std::move(known->second) : transport_->add_writer(endpoint(topic));
    of_topic.push_back(writer.get());
  }
  conversions_ = std::move(conversions);
  writers_ = std::move(writers);
  writer_of_topic_ = std::move(of_topic);
  add_commands(info);
  static_frames_->write(conversions_->static_frames());
  announce();
  update_wanted();
}

// Of a robot that is gone, the run itself refuses what comes.
void Node::add_commands(const std::vector<world_info_t>& info) {
  for (Command& command : commands_of(info, options_.joints, names_)) {
    const std::string name = key(command.topic);
    const auto [at, fresh] = commands_.try_emplace(name, std::move(command));
    if (!fresh) continue;
    readers_[name] = transport_->add_reader(endpoint(at->second.topic), [this, added = &at->second](std::span<const uint8_t> cdr) { receive(*added, cdr); });
  }
}

void Node::update_wanted() {
  std::unordered_map<std::string, bool> wanted{{info_channel_, true}};
  for (const std::string& channel : conversions_->channels()) {
    wanted[channel] = conversions_->is_wanted(channel, [this](size_t topic) { return writer_of_topic_[topic]->is_read(); });
  }
  const std::lock_guard lock(mutex_);
  wanted_ = std::move(wanted);
}

void Node::announce() {
  const size_t size = options_.conversion.distro == Distro::humble ? 24 : 16;
  CdrWriter out;
  const auto put_gid = [&](const Gid& gid) {
    std::vector<uint8_t> padded(gid.begin(), gid.end());
    padded.resize(size);
    out.put_array(std::span<const uint8_t>(padded));
  };
  put_gid(transport_->gid());
  out.put_length(1).put("/").put("ruedo");
  out.put_length(readers_.size());
  for (const auto& [name, reader] : readers_) put_gid(reader->gid());
  out.put_length(writers_.size() + 2);
  for (const auto& [name, writer] : writers_) put_gid(writer->gid());
  put_gid(clock_->gid());
  put_gid(static_frames_->gid());
  graph_->write(out.bytes());
}

void Node::receive(const Command& command, std::span<const uint8_t> cdr) {
  ++received_;
  if (!injecting_) return;
  if (const auto bytes = command.convert(cdr)) return inject_(command.channel, *bytes);
  const uint64_t faulty = ++faulty_;
  const int64_t now = std::chrono::steady_clock::now().time_since_epoch().count();
  if (now < last_warning_ns_ + 1'000'000'000 && last_warning_ns_ != 0) return;
  last_warning_ns_ = now;
  spdlog::warn("ROS 2: {} got {} bytes that are no {} for this robot: ignored ({} such messages so far)", command.topic.name, cdr.size(),
               command.topic.type, faulty);
}

std::vector<Topic> Node::outputs() const {
  std::vector<Topic> topics = conversions_->topics();
  topics.insert(topics.end(), {clock_topic_, static_frames_topic_});
  return topics;
}

std::vector<Topic> Node::inputs() const {
  std::vector<Topic> topics;
  for (const auto& [name, command] : commands_) topics.push_back(command.topic);
  return topics;
}

}  // namespace ruedo::ros2
