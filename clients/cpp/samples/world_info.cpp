// ruedo/info: the assembly of its parts, and their decoding.
#include "samples/world_info.h"

#include <cstdio>
#include <map>
#include <string_view>
#include <utility>

#include "ruedo/world_info_t.hpp"
#include "samples/wire_reader.h"

namespace ruedo::client {
namespace {

constexpr size_t kHead = 8 + 8 + 8 + 4 + 2 + 2;  // bytes
constexpr int kMostParts = 1024;
constexpr size_t kMostBytes = 64 << 20;  // of all parts

RobotInfo read_robot(WireReader& in) {
  RobotInfo robot;
  robot.name = in.name();
  robot.model = in.name();
  robot.drive = in.name();
  in.int32();  // body
  for (double* value : {&robot.wheel_radius, &robot.track, &robot.max_speed, &robot.max_turn_rate,
                        &robot.acceleration, &robot.deceleration, &robot.turn_acceleration}) {
    *value = in.float64();
  }
  robot.watchdog = static_cast<double>(in.int64()) * 1e-6;
  const size_t n = in.count(5 + 1);
  robot.wheels.resize(n);
  for (std::string& wheel : robot.wheels) wheel = in.name();
  in.booleans(n);  // which are on the left
  return robot;
}

DeviceInfo read_device(WireReader& in) {
  DeviceInfo device;
  device.robot = in.name();
  device.name = in.name();
  device.kind = in.name();
  device.rate = in.float64();
  device.position = in.array<3>();
  device.orientation = in.array<4>();
  for (double* value :
       {&device.range_min, &device.range_max, &device.fov_horizontal, &device.fov_vertical}) {
    *value = in.float64();
  }
  device.width = in.int32();
  device.height = in.int32();
  device.elements.resize(in.count(6 * 8));
  for (auto& element : device.elements) element = in.array<6>();
  return device;
}

ChannelInfo read_channel(WireReader& in) {
  ChannelInfo channel;
  channel.name = in.name();
  channel.robot = in.name();
  channel.device = in.name();
  channel.type = in.name();
  channel.fingerprint = in.int64();
  channel.rate = in.float64();
  channel.input = in.boolean();
  return channel;
}

BodyInfo read_body(WireReader& in) {
  BodyInfo body;
  in.int32();  // its place in ruedo/world
  body.name = in.name();
  body.is_static = in.boolean();
  body.mass = in.float64();
  return body;
}

// The rest after the fingerprint and utime. The head of every part is the same.
void read_part(WireReader& in, WorldInfo& info) {
  info.run_id = in.int64();
  info.epoch = in.int32();
  in.int16();  // part
  in.int16();  // nparts
  info.version = in.name();
  info.world = in.name();
  info.seed = in.int64();
  info.step_us = in.int64();
  info.features = in.int64();
  info.paused = in.boolean();
  for (size_t n = in.count(80); n > 0; --n) info.robots.push_back(read_robot(in));
  for (size_t n = in.count(100); n > 0; --n) {
    DeviceInfo device = read_device(in);
    info.devices[device.robot].push_back(std::move(device));
  }
  for (size_t n = in.count(30); n > 0; --n) {
    ChannelInfo channel = read_channel(in);
    if (channel.type == "tick_t")
      info.tick_channel = static_cast<int32_t>(info.channel_list.size());
    info.channel_list.push_back(channel);
    info.channels[channel.robot].push_back(std::move(channel));
  }
  for (size_t n = in.count(4 + 4 + 1 + 1 + 8); n > 0; --n) {
    BodyInfo body = read_body(in);
    if (!body.name.empty()) info.bodies.push_back(std::move(body));  // else it was removed
  }
}

}  // namespace

std::string hex(int64_t fingerprint) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(fingerprint));
  return text;
}

const RobotInfo* WorldInfo::robot(const std::string& name) const {
  const auto found = robot_index.find(name);
  return found == robot_index.end() ? nullptr : &robots[found->second];
}

std::optional<int64_t> run_id_of(const uint8_t* bytes, size_t size) {
  if (size < kHead) return std::nullopt;
  WireReader head(bytes, size);
  if (head.int64() != world_info_t::getHash()) return std::nullopt;
  head.int64();  // utime
  return head.int64();
}

std::shared_ptr<const WorldInfo> WorldInfoAssembler::add(const uint8_t* bytes, size_t size) {
  if (size < kHead) return nullptr;
  WireReader head(bytes, size);
  const int64_t fingerprint = head.int64();
  if (fingerprint != world_info_t::getHash()) {
    throw TypeMismatch("ruedo/info carries another version of world_info_t (fingerprint " +
                       hex(fingerprint) +
                       ") than this "
                       "client reads (" +
                       hex(world_info_t::getHash()) + "): use the client of the server's version");
  }
  const int64_t utime = head.int64(), run_id = head.int64();
  const int32_t epoch = head.int32();
  const int part = head.int16(), nparts = head.int16();
  if (part < 0 || part >= nparts) return nullptr;
  const Key key{utime, run_id, epoch, nparts};
  if (key != key_) parts_.clear();
  key_ = key;
  parts_[part].assign(bytes + 16, bytes + size);
  check_size(nparts);
  if (parts_.size() < static_cast<size_t>(nparts)) return nullptr;
  if (parts_ == last_) {
    parts_.clear();
    return nullptr;
  }
  auto info = std::make_shared<WorldInfo>();
  info->utime = utime;
  try {
    for (const auto& [index, content] : parts_) {
      WireReader in(content.data(), content.size());
      read_part(in, *info);
    }
  } catch (const WireError& error) {
    parts_.clear();
    throw TypeMismatch(std::string("a message on ruedo/info is not a valid world_info_t: ") +
                       error.what());
  }
  for (size_t i = 0; i < info->robots.size(); ++i)
    info->robot_index.emplace(info->robots[i].name, i);
  // A device's channel is the first that carries its samples.
  std::map<std::pair<std::string_view, std::string_view>, const ChannelInfo*> of_device;
  for (const auto& [robot, channels] : info->channels) {
    for (const ChannelInfo& channel : channels)
      if (!channel.input) of_device.try_emplace({robot, channel.device}, &channel);
  }
  for (auto& [robot, devices] : info->devices) {
    for (DeviceInfo& device : devices) {
      const auto found = of_device.find({robot, device.name});
      if (found == of_device.end()) continue;
      device.channel = found->second->name;
      device.type = found->second->type;
    }
  }
  last_ = std::move(parts_);
  parts_.clear();
  return info;
}

// Incomplete parts wait in memory.
void WorldInfoAssembler::check_size(int nparts) {
  size_t size = 0;
  for (const auto& [part, content] : parts_) size += content.size();
  if (nparts <= kMostParts && size <= kMostBytes) return;
  parts_.clear();
  throw TypeMismatch("ruedo/info has " + std::to_string(nparts) + " parts of " +
                     std::to_string(size) + " bytes so far: a client takes " +
                     std::to_string(kMostParts) + " parts of " + std::to_string(kMostBytes) +
                     " bytes together at most");
}

}  // namespace ruedo::client
