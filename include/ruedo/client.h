/// @file
/// Ruedo's client for C++17: connect to a robot simulation, read its sensors, drive its robots.
///
/// SI units, radians; x ahead, y left, z up; quaternions w, x, y, z. utime is sim time in
/// microseconds. Everything here is safe to use from any thread. Link with ruedo::client.
///
/// Failures throw: Error or a class derived from it, std::invalid_argument for a bad argument.
/// Values that may rightly be absent are std::optional. Nothing returns an error code. A
/// Duration is any of std::chrono's, or a number of seconds.
///
/// Handles (Robot, Stream, Device, Motion) may outlive their Simulation. Once it was closed,
/// destroyed or moved from, calls that need the server throw NoServer ("this simulation was
/// closed"). So they do in the child of a fork, which connects for itself.
//
//     auto sim = ruedo::client::connect();
//     auto robot = sim.robot("p3at");
//     robot.set_velocity(0.3, 0.0);               // m/s, rad/s; holds until changed
//     while (robot.lrf().next().nearest(-0.5, 0.5) > 0.8) {}
//     robot.stop().wait();
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "ruedo/client_map.h"
#include "ruedo/client_markers.h"
#include "ruedo/client_requests.h"
#include "ruedo/client_samples.h"
#include "ruedo/setting.h"

/// The client of a running simulation.
namespace ruedo::client {

// ---- Descriptions.

/// A robot's drive, limits and dimensions.
struct RobotInfo {
  std::string name;                 ///< its name
  std::string model;                ///< its model's name
  std::string drive;                ///< "kinematic", "wheels", "": it only senses
  double wheel_radius = 0.0;        ///< m
  double track = 0.0;               ///< m between the left and the right wheels
  double max_speed = 0.0;           ///< m/s
  double max_turn_rate = 0.0;       ///< rad/s
  double acceleration = 0.0;        ///< m/s^2
  double deceleration = 0.0;        ///< m/s^2
  double turn_acceleration = 0.0;   ///< rad/s^2
  double watchdog = 0.0;            ///< s of sim time, 0: off
  std::vector<std::string> wheels;  ///< joint names
};

/// A set of links that do not move against each other.
struct BodyInfo {
  std::string name;        ///< MODEL/LINK: what Simulation::state() takes
  bool is_static = false;  ///< it never moves
  double mass = 0.0;       ///< kg; 0 of what never moves
};

/// A sensor of a robot, or what it has besides (its pose, odometry, joints).
struct DeviceInfo {
  std::string robot;            ///< its name
  std::string name;             ///< the channel is ROBOT/NAME, usually
  std::string kind;             ///< "lrf", "sonar", "odometry", "camera", "pose", ...
  std::string channel;          ///< on the bus
  std::string type;             ///< of its messages
  double rate = 0.0;            ///< Hz of sim time; 0: every step
  Vector3 position{};           ///< m, in base_link at the start
  Quaternion orientation{};     ///< device to base_link
  double range_min = 0.0;       ///< m
  double range_max = 0.0;       ///< m
  double fov_horizontal = 0.0;  ///< rad
  double fov_vertical = 0.0;    ///< rad
  int width = 0;                ///< rays, transducers, or pixels
  int height = 0;               ///< layers, or pixels
  std::vector<std::array<double, 6>>
      elements;  ///< a sonar's transducers: x, y, z, roll, pitch, yaw in its frame
};

/// A command for Simulation::step(), as Robot::velocity_command() and its like make it.
struct Command {
  std::string channel;         ///< one of the command channels of ruedo/info
  std::vector<uint8_t> bytes;  ///< the encoded message
  int64_t after = 0;           ///< steps from where the call begins to the state that it acts on
  /// @param steps from where the call begins
  /// @return this command at another step
  Command at(int64_t steps) const { return {channel, bytes, steps}; }
};

class CallbackCore;  // clients/cpp/callbacks/callbacks.h
class Core;          // a connection; clients/cpp/core.h
class StreamCore;    // a subscription; clients/cpp/stream_core.h
struct MotionCore;

/// A callback that is called until this is closed or destroyed, or the Simulation is closed.
/// Move-only.
///
/// Once close() has returned, or the destructor, the callback is not called any more, and no call
/// of it is under way (but for the one that closes it itself): objects that it refers to may be
/// destroyed. If callbacks in several threads close each other, the last one does not wait for the
/// others. The next call of its simulation rethrows an exception of a callback, which harms no
/// other callback.
class [[nodiscard]] Subscription {
 public:
  Subscription() = default;  ///< Of no callback.
  /// @cond
  explicit Subscription(std::shared_ptr<CallbackCore> core) : core_(std::move(core)) {}
  Subscription(Subscription&&) noexcept = default;
  Subscription& operator=(Subscription&& other) noexcept;
  ~Subscription();
  /// @endcond
  void close();  ///< Ends the calls; a second time nothing.
  void keep();   ///< The callback stays for as long as the Simulation, without this.
  /// @return false once it was closed, by whatever
  [[nodiscard]] bool open() const;

 private:
  std::shared_ptr<CallbackCore> core_;
};

/// Goes through the samples of a stream, from the next one on, until the run ends:
/// `for (const Scan& scan : robot.lrf())`. A loop slower than the stream gets the newest each time,
/// or the oldest of the stream's queue_depth().
/// @tparam StreamType a Stream or MessageStream
/// @tparam SampleType of the stream
template <class StreamType, class SampleType>
class SampleIterator {
 public:
  /// @cond
  using iterator_category = std::input_iterator_tag;
  using value_type = SampleType;
  using difference_type = std::ptrdiff_t;
  using pointer = const SampleType*;
  using reference = const SampleType&;
  SampleIterator() = default;  // the end
  explicit SampleIterator(const StreamType& stream) : stream_(&stream) { ++*this; }
  const SampleType& operator*() const { return *sample_; }
  const SampleType* operator->() const { return &*sample_; }
  SampleIterator& operator++() {
    try {
      sample_ = stream_->next(kForever);
    } catch (const RunEnded&) {
      stream_ = nullptr;
    }
    return *this;
  }
  void operator++(int) { ++*this; }
  bool operator==(const SampleIterator& other) const { return stream_ == other.stream_; }
  bool operator!=(const SampleIterator& other) const { return stream_ != other.stream_; }
  /// @endcond

 private:
  const StreamType* stream_ = nullptr;
  std::optional<SampleType> sample_;
};

/// A stream of samples from one channel. The first use subscribes.
///
/// Each Stream is a reader of its own: next() goes by what this object has returned, not by what
/// others have. A new one begins where the channel was last read, so that `robot.lrf().next()` in a
/// loop returns each sample once.
/// @tparam SampleType one of client_samples.h
template <class SampleType>
class Stream {
 public:
  /// @cond
  explicit Stream(std::shared_ptr<StreamCore> core);
  Stream(const Stream& other)
      : core_(other.core_),
        seen_(other.seen_.load()),
        skipped_(other.skipped_.load()),
        depth_(other.depth_.load()) {}
  Stream& operator=(const Stream& other) {
    if (this == &other) return *this;
    core_ = other.core_;
    seen_ = other.seen_.load();
    skipped_ = other.skipped_.load();
    depth_ = other.depth_.load();
    return *this;
  }
  /// @endcond
  /// @return its name on the bus
  [[nodiscard]] const std::string& channel() const;

  /// The newest sample; before the first one it waits. All samples that have arrived before the
  /// call count.
  /// @param timeout of real time
  /// @return a copy
  /// @throws Timeout, TypeMismatch, NoServer
  [[nodiscard]] SampleType latest(Duration timeout = 5.0) const;
  /// The newest sample that neither latest() nor next() of this object has returned yet, or of the
  /// newest queue_depth() the oldest; waits for one. After Motion::wait() in the same thread it is
  /// one from the end of that motion or later. A reader slower than the rate skips samples, which
  /// dropped() counts; on_sample() skips none.
  /// @param timeout of real time
  /// @return a copy
  /// @throws Timeout, TypeMismatch, NoServer
  SampleType next(Duration timeout = 5.0) const;
  /// The sample of a time: waits until the stream has reached it. If no sample is of that time, a
  /// pose or odometry is interpolated between its neighbours, and other streams return the nearest
  /// sample. A stream keeps its last 256 samples, of 4 MB at most, from its first use on.
  /// @param utime us of sim time, such as `scan.utime`
  /// @param timeout of real time
  /// @return a copy
  /// @throws Timeout, also for a time before the kept samples: Simulation::synchronised() joins
  /// streams from the beginning; TypeMismatch, NoServer
  [[nodiscard]] SampleType at(int64_t utime, Duration timeout = 5.0) const;
  /// @cond
  // Nothing: the moment is before what is kept.
  [[nodiscard]] std::optional<SampleType> find(int64_t utime, Duration timeout) const;
  void subscribe() const;
  /// @endcond
  /// @return its samples, from the next one on
  SampleIterator<Stream, SampleType> begin() const {
    return SampleIterator<Stream, SampleType>(*this);
  }
  SampleIterator<Stream, SampleType> end() const {
    return {};
  }  ///< @return where the run has ended
  /// Calls back for every sample from now on. All callbacks of a simulation run in one thread of
  /// their own, one at a time, in the order in which the samples came; in lockstep those of the
  /// steps of step() return before it does. A server that launch() started waits for them. With
  /// another one, and more than a megabyte of samples behind, they get the newest of each channel
  /// (dropped()). A callback cannot wait for other samples or replies: such a call throws Error.
  /// @param callback what it throws is thrown by the next call of the simulation, at the latest by
  /// Simulation::close(); its destructor prints it, and the program's exit code is not 0
  /// @return ends the calls when it goes
  /// @throws TypeMismatch, NoServer; std::invalid_argument for an empty function
  Subscription on_sample(std::function<void(const SampleType&)> callback) const;
  /// The number of samples that latest() and next() have skipped, since newer ones had arrived or
  /// they were lost on the way; and of those that the channel's callbacks were too slow for. A new
  /// Stream continues from where the channel was last read, with its count.
  /// @return samples
  int64_t dropped() const;
  /// The number of samples kept for next() and loops, from 1 (only the newest, the default) to
  /// 1000. With more, next() returns the oldest kept one; if more arrive, the oldest are dropped,
  /// and dropped() counts them.
  /// @return samples
  int64_t queue_depth() const { return depth_; }
  /// Also of streams of this channel that are made from now on.
  /// @param depth samples
  /// @throws std::invalid_argument
  void set_queue_depth(int64_t depth);

 private:
  std::shared_ptr<StreamCore> core_;
  mutable std::atomic<int64_t>
      seen_;  ///< of the samples of the channel, the last that a call has returned
  mutable std::atomic<int64_t> skipped_;
  std::atomic<int64_t> depth_;
};

/// A stream of messages of a type of one's own: `robot.stream<thermometer_t>("temp")`.
///
/// It reads as Stream does, and is made of one.
/// @tparam Message a class that lcm-gen made of an .lcm file (lcm-gen -x)
template <class Message>
class MessageStream {
 public:
  /// @param raw a stream of such messages
  explicit MessageStream(const Stream<RawSample>& raw) : raw_(raw) {}
  /// @return its name on the bus
  [[nodiscard]] const std::string& channel() const { return raw_.channel(); }

  /// As Stream::latest().
  /// @param timeout of real time
  /// @return the newest message
  /// @throws Timeout, TypeMismatch, NoServer
  [[nodiscard]] Message latest(Duration timeout = 5.0) const {
    return decoded(channel(), raw_.latest(timeout).bytes);
  }
  /// As Stream::next().
  /// @param timeout of real time
  /// @return the newest message that was not returned yet
  /// @throws Timeout, TypeMismatch, NoServer
  Message next(Duration timeout = 5.0) const {
    return decoded(channel(), raw_.next(timeout).bytes);
  }
  /// As Stream::on_sample(). A message of another type is reported on the terminal and skipped.
  /// @param callback its exceptions are reported once on the terminal
  /// @return ends the calls when it goes
  /// @throws NoServer
  Subscription on_sample(std::function<void(const Message&)> callback) const {
    if (!callback) return raw_.on_sample({});
    return raw_.on_sample([callback = std::move(callback), name = channel()](const RawSample& raw) {
      callback(decoded(name, raw.bytes));
    });
  }
  /// @return its messages, from the next one on
  SampleIterator<MessageStream, Message> begin() const {
    return SampleIterator<MessageStream, Message>(*this);
  }
  SampleIterator<MessageStream, Message> end() const {  ///< @return where the run has ended
    return {};
  }
  /// As Stream::dropped().
  /// @return messages
  int64_t dropped() const { return raw_.dropped(); }
  /// As Stream::queue_depth().
  /// @return messages
  int64_t queue_depth() const { return raw_.queue_depth(); }
  /// As Stream::set_queue_depth().
  /// @param depth messages
  /// @throws std::invalid_argument
  void set_queue_depth(int64_t depth) { raw_.set_queue_depth(depth); }

  /// @param channel names it in the error
  /// @param bytes LCM's encoding
  /// @return the message
  /// @throws TypeMismatch if the bytes do not decode as a Message
  static Message decoded(const std::string& channel, const std::vector<uint8_t>& bytes) {
    const auto fail = [&](const char* what) -> Message {
      throw TypeMismatch(channel + ": a message of " + std::to_string(bytes.size()) + " bytes " +
                         what + " " + Message::getTypeName() + " of this program");
    };
    uint64_t fingerprint = 0;
    for (size_t i = 0; i < 8 && i < bytes.size(); ++i) fingerprint = fingerprint << 8 | bytes[i];
    if (bytes.size() < 8 || fingerprint != static_cast<uint64_t>(Message::getHash()))
      return fail("is another type than, or of another version of, the");
    Message message;
    const int size = static_cast<int>(bytes.size());
    return message.decode(bytes.data(), 0, size) == size ? message : fail("is not a valid");
  }

 private:
  Stream<RawSample> raw_;
};

/// The observations of step(): the state after its last step, and all steps' sensor messages.
struct Observations : State {
  /// A message as it came.
  struct Message {
    int64_t step = 0;            ///< of the run
    std::string channel;         ///< its name on the bus
    std::vector<uint8_t> bytes;  ///< LCM's encoding
  };
  std::vector<Message> messages;  ///< in the order in which the simulation made them

  /// @param stream a device or stream
  /// @return its samples, decoded, in order; none when none was due
  /// @throws TypeMismatch
  template <class SampleType>
  std::vector<SampleType> all(const Stream<SampleType>& stream) const;
  /// @param stream a device or stream
  /// @return the last of its samples
  /// @throws TypeMismatch
  template <class SampleType>
  std::optional<SampleType> latest(const Stream<SampleType>& stream) const;
  /// @param stream of a type of one's own
  /// @return its messages, decoded, in order
  /// @throws TypeMismatch
  template <class MessageType>
  std::vector<MessageType> all(const MessageStream<MessageType>& stream) const {
    std::vector<MessageType> found;
    for (const Message& message : messages) {
      if (message.channel == stream.channel())
        found.push_back(stream.decoded(message.channel, message.bytes));
    }
    return found;
  }
  /// @param stream of a type of one's own
  /// @return the last of its messages
  /// @throws TypeMismatch
  template <class MessageType>
  std::optional<MessageType> latest(const MessageStream<MessageType>& stream) const {
    for (auto message = messages.rbegin(); message != messages.rend(); ++message) {
      if (message->channel == stream.channel())
        return stream.decoded(message->channel, message->bytes);
    }
    return std::nullopt;
  }
};

/// A sensor of a robot.
template <class SampleType>
class Device : public Stream<SampleType> {
 public:
  /// @cond
  Device(std::shared_ptr<StreamCore> core, DeviceInfo info)
      : Stream<SampleType>(std::move(core)), info_(std::move(info)) {}
  /// @endcond
  /// @return its channel, rate, range and place
  const DeviceInfo& info() const { return info_; }
  /// @return as the world file has it
  const std::string& name() const { return info_.name; }
  /// @return its frame in base_link at the start
  Transform transform() const { return {info_.position, info_.orientation}; }

 private:
  DeviceInfo info_;
};

/// Streams joined by stamp, from Simulation::synchronised().
/// @tparam First sample of the first stream
/// @tparam Others samples of the others
template <class First, class... Others>
class Synchronised {
 public:
  /// @cond
  using Joined = std::tuple<First, Others...>;
  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = Joined;
    using difference_type = std::ptrdiff_t;
    using pointer = const Joined*;
    using reference = const Joined&;
    explicit Iterator(const Synchronised* of) : of_(of) {
      if (of_) ++*this;
    }
    const Joined& operator*() const { return *joined_; }
    Iterator& operator++() {
      joined_.reset();
      try {
        while (!joined_) joined_ = of_->next();
      } catch (const RunEnded&) {
        of_ = nullptr;
      }
      return *this;
    }
    bool operator!=(const Iterator& other) const { return of_ != other.of_; }

   private:
    const Synchronised* of_;
    std::optional<Joined> joined_;
  };
  Synchronised(Stream<First> first, Stream<Others>... others)
      : first_(std::move(first)), others_(std::move(others)...) {
    std::apply([](const auto&... stream) { (stream.subscribe(), ...); }, others_);
  }
  Iterator begin() const { return Iterator(this); }
  Iterator end() const { return Iterator(nullptr); }
  /// @endcond

 private:
  std::optional<Joined> next() const {
    const First sample = first_.next(kForever);
    return std::apply(
        [&](const auto&... stream) -> std::optional<Joined> {
          const auto found = std::make_tuple(stream.find(sample.utime, 5.0)...);
          const bool whole =
              std::apply([](const auto&... one) { return (one.has_value() && ...); }, found);
          if (!whole) return std::nullopt;  // it came before the others' first
          return std::apply([&](const auto&... one) { return Joined(sample, *one...); }, found);
        },
        others_);
  }

  Stream<First> first_;
  std::tuple<Stream<Others>...> others_;
};

/// A loop at a fixed period of sim time, from Simulation::every().
class Every {
 public:
  /// @cond
  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = double;
    using difference_type = std::ptrdiff_t;
    using pointer = const double*;
    using reference = double;
    explicit Iterator(const Every* of) : of_(of) {
      if (of_) ++*this;
    }
    double operator*() const { return time_; }
    Iterator& operator++() {
      const std::optional<double> next = of_->next();
      if (next)
        time_ = *next;
      else
        of_ = nullptr;
      return *this;
    }
    bool operator!=(const Iterator& other) const { return of_ != other.of_; }

   private:
    const Every* of_;
    double time_ = 0.0;
  };
  Every(std::shared_ptr<Core> core, int64_t period_us)
      : core_(std::move(core)), period_us_(period_us) {}
  Iterator begin() const { return Iterator(this); }
  Iterator end() const { return Iterator(nullptr); }
  /// @endcond

 private:
  std::optional<double> next() const;  // s; nothing: the run has ended

  std::shared_ptr<Core> core_;
  int64_t period_us_;
  mutable int64_t next_us_ = 0;
};

/// A camera, and its further channels.
class Camera : public Device<Image> {
 public:
  /// @cond
  Camera(std::shared_ptr<Core> core, std::shared_ptr<StreamCore> stream, DeviceInfo info);
  /// @endcond
  /// @return depth images, m
  /// @throws UnknownName when the world file does not ask for them
  Stream<Image> depth() const;
  /// @return images of body indices + 1
  /// @throws UnknownName when the world file does not ask for them
  Stream<Image> labels() const;
  /// @return the pinhole
  /// @throws UnknownName when the world file does not ask for it
  Stream<CameraInfo> intrinsics() const;

 private:
  std::shared_ptr<Core> connection_;
};

/// A motion primitive under way. Copies share everything.
class Motion {
 public:
  /// @cond
  explicit Motion(std::shared_ptr<MotionCore> core) : core_(std::move(core)) {}
  /// @endcond
  /// @return the number by which the robot's MotionStatus names it
  int64_t id() const;
  /// @return true when the robot is not executing it any more, for whatever reason
  bool done() const;
  /// @return how far it is
  MotionState state() const;
  /// @return why it ended early or was refused
  MotionReason reason() const;
  /// @return the body that blocked it; "": none did
  std::string blocked_by() const;
  /// @return m or rad
  double progress() const;
  /// @return m or rad
  double remaining() const;
  /// Waits until it is done.
  /// @param timeout of real time
  /// @return itself
  /// @throws MotionError if it ended early or was refused; Timeout if it still runs: the robot
  /// continues then; RunEnded; NoServer
  const Motion& wait(Duration timeout = kForever) const;

 private:
  std::shared_ptr<MotionCore> core_;
};

/// Limits of a primitive: m/s and m/s^2, for turns on the spot rad/s and rad/s^2. 0: the robot's
/// own.
struct Limits {
  double speed = 0.0;         ///< 0 or more
  double acceleration = 0.0;  ///< 0 or more
  double deceleration = 0.0;  ///< 0 or more
};

/// A joint of a robot, from Robot::joint(). Copies are the same joint.
class Joint {
 public:
  /// @cond
  Joint(std::shared_ptr<Core> core, std::string robot, std::string name);
  /// @endcond
  const std::string& name() const { return name_; }  ///< @return as the file has it
  /// @return revolute, continuous, prismatic, ...
  const std::string& kind() const { return kind_; }
  double lower() const { return lower_; }                ///< @return rad or m; -inf: no limit
  double upper() const { return upper_; }                ///< @return rad or m; +inf: no limit
  double max_velocity() const { return max_velocity_; }  ///< @return rad/s or m/s; +inf: no limit
  double max_effort() const { return max_effort_; }      ///< @return N m or N; +inf: no limit
  /// @return false of a joint that mimics another, of a gearbox and of a ball joint
  bool takes_commands() const { return takes_commands_; }
  /// @return true where the file has a controller, a transmission or a servo for it: it holds its
  /// position until its first command. The others are free until then.
  bool holds() const { return holds_; }

  /// @name Of the newest sample
  /// They throw Timeout and NoServer.
  /// @{
  [[nodiscard]] double position() const;  ///< @return rad or m
  [[nodiscard]] double velocity() const;  ///< @return rad/s or m/s
  [[nodiscard]] double effort() const;    ///< @return N m or N, of its motor
  /// @}
  /// @name Commands
  /// Each holds until the joint's next one. They throw as Robot::command_joints() does.
  /// @{
  void set_position(double value) const;  ///< @param value rad or m, kept within the limits
  void set_velocity(double value) const;  ///< @param value rad/s or m/s
  void set_effort(double value) const;    ///< @param value N m or N
                                          /// @}

 private:
  std::shared_ptr<Core> core_;
  std::string robot_, name_, kind_;
  double lower_, upper_, max_velocity_, max_effort_;
  bool takes_commands_, holds_;
};

/// The robot drives while this lives, from Robot::driving(). Move-only.
class [[nodiscard]] Driving {
 public:
  /// @cond
  Driving(std::shared_ptr<Core> core, std::string robot)
      : core_(std::move(core)), robot_(std::move(robot)) {}
  Driving(Driving&&) noexcept = default;
  Driving& operator=(Driving&&) = delete;
  ~Driving();
  /// @endcond

 private:
  std::shared_ptr<Core> core_;
  std::string robot_;
};

/// A robot of the simulation: its sensors and its drive. Copies are the same robot.
class Robot {
 public:
  /// @cond
  Robot(std::shared_ptr<Core> core, std::string name)
      : core_(std::move(core)), name_(std::move(name)) {}
  /// @endcond
  /// @return as the world file has it, or spawn() returned it
  const std::string& name() const { return name_; }
  /// @return its drive, its size and its limits
  /// @throws UnknownName once it was removed; NoServer
  RobotInfo info() const;

  /// @return all, in the order of the world file
  /// @throws NoServer
  std::vector<DeviceInfo> devices() const;
  /// @tparam SampleType what it delivers: Scan, Imu, ...
  /// @param name of the device ("front_laser")
  /// @return the device
  /// @throws UnknownName, which lists those that exist; TypeMismatch when its samples are of
  /// another kind; NoServer
  template <class SampleType>
  Device<SampleType> device(const std::string& name) const;
  /// The messages of a device or channel of this robot, of a plugin's, too.
  /// @tparam Message a class that lcm-gen made of its .lcm file
  /// @param name of the device or channel ("temp")
  /// @return the stream
  /// @throws UnknownName, with those that exist; NoServer
  template <class Message>
  [[nodiscard]] MessageStream<Message> stream(const std::string& name) const {
    return MessageStream<Message>(raw_stream(name));
  }
  /// The same as bytes, whatever their type is.
  /// @param name of the device or channel
  /// @return the stream
  /// @throws UnknownName, with those that exist; NoServer
  [[nodiscard]] Stream<RawSample> raw_stream(const std::string& name) const;

  /// @name The first device of a kind
  /// Each throws UnknownName when the robot has none.
  /// @{
  Device<Scan> lrf() const;            ///< @return the planar laser range finder
  Device<LidarScan> lidar() const;     ///< @return the laser scanner of several layers
  Device<SonarReading> sonar() const;  ///< @return the array of sonars
  Device<Odometry> odometry() const;   ///< @return the odometry
  /// @return what the odometry makes of the wheels' speeds, also sideways
  Stream<OdometryTwist> odometry_twist() const;
  Device<NavSat> gps() const;                 ///< @return the satellite receiver; see NavSat::enu()
  Device<Magnetometer> magnetometer() const;  ///< @return the magnetometer
  Device<Altimeter> altimeter() const;        ///< @return the altimeter
  Device<AirPressure> air_pressure() const;   ///< @return the barometer
  Device<AirSpeed> air_speed() const;         ///< @return the Pitot tube
  Device<ForceTorque> force_torque() const;   ///< @return the force-torque sensor
  Device<LogicalCamera> logical_camera() const;  ///< @return the logical camera
  Camera camera() const;                         ///< @return the camera
  Device<Boxes2D> boxes_2d() const;              ///< @return the camera of boxes in its picture
  Device<Boxes3D> boxes_3d() const;              ///< @return the camera of boxes in space
  Device<Imu> imu() const;                       ///< @return the inertial unit
  Device<Contact> contact() const;               ///< @return the bumper
  /// @}
  /// @param name of a camera ("left")
  /// @return the camera, with its depth, labels and intrinsics
  /// @throws as device()
  [[nodiscard]] Camera camera(const std::string& name) const;
  /// @return what it runs into, and what blocks it; it needs no bumper
  /// @throws UnknownName, NoServer
  Stream<Collisions> collisions() const;
  /// Calls back as Stream::on_sample() does, but only when the robot runs into a body that it did
  /// not touch a moment before.
  /// @param callback its exceptions are reported once on the terminal
  /// @return ends the calls when it goes
  /// @throws UnknownName, TypeMismatch, NoServer
  Subscription on_collision(std::function<void(const Collisions&)> callback) const;
  /// @return the true pose
  /// @throws UnknownName, NoServer
  Stream<Pose> pose() const;
  /// @return what it is executing
  /// @throws UnknownName, NoServer
  Stream<MotionStatus> motion() const;
  /// @return positions, velocities and efforts of its joints
  /// @throws UnknownName, NoServer
  Stream<Joints> joints() const;
  /// @param name of a joint
  /// @return its limits, its state and its commands
  /// @throws UnknownName, which lists the joints; NoServer
  [[nodiscard]] Joint joint(const std::string& name) const;
  /// Commands joints by their names: `{{"shoulder", 0.5}, {"elbow", -0.3}}`. Each holds its
  /// command until the next one; no watchdog ends it.
  /// @param values rad or m, rad/s or m/s, N m or N; positions are kept within the joint's limits
  /// @param mode the kind of the values
  /// @throws UnknownName, which lists the joints; std::invalid_argument for what is not finite;
  /// NotSupported for a joint that takes no commands, and in lockstep; NoServer
  void command_joints(const std::map<std::string, double>& values,
                      JointMode mode = JointMode::position) const;

  /// Drives within the robot's limits until the next command of any kind: this program repeats it
  /// in the background, so that the watchdog does not stop the robot. It lapses the watchdog's time
  /// after the program has ended or was stopped. driving() shows in the program how long that is to
  /// last.
  /// @param v m/s ahead
  /// @param omega rad/s, positive to the left
  /// @param vy m/s to the left, of a robot that moves sideways
  /// @throws std::invalid_argument for what is not finite; NotSupported for a robot without a
  /// drive, for vy of one that does not move sideways, and in lockstep; NoServer
  void set_velocity(double v, double omega, double vy = 0.0) const;
  /// As set_velocity(), for as long as the returned object lives; then the robot stops:
  /// `{ const auto driving = robot.driving(0.3, 0.0); ... }`.
  /// @param v m/s ahead
  /// @param omega rad/s, positive to the left
  /// @param vy m/s to the left, of a robot that moves sideways
  /// @return stops the robot when it goes
  /// @throws as set_velocity()
  [[nodiscard]] Driving driving(double v, double omega, double vy = 0.0) const;
  /// The same with the rates of the wheels.
  /// @param left rad/s, positive ahead
  /// @param right rad/s, positive ahead
  /// @throws as set_velocity()
  void set_wheels(double left, double right) const;

  /// @name Primitives
  /// Each returns at once; Motion::wait() waits for the end. They throw std::invalid_argument for
  /// values not finite or out of range, NotSupported for a robot without a drive and in lockstep,
  /// and NoServer.
  /// @{

  /// @param deceleration m/s^2; 0: the robot's own
  /// @return the primitive under way
  Motion stop(double deceleration = 0.0) const;
  /// @param distance m, negative: back
  /// @param limits m/s, m/s^2
  /// @return the primitive under way
  Motion advance(double distance, Limits limits = {}) const;
  /// On the spot.
  /// @param angle rad, positive to the left
  /// @param limits rad/s, rad/s^2
  /// @return the primitive under way
  Motion rotate(double angle, Limits limits = {}) const;
  /// On the spot, the shorter way.
  /// @param heading rad, in odom
  /// @param limits rad/s, rad/s^2
  /// @return the primitive under way
  Motion turn_to(double heading, Limits limits = {}) const;
  /// @param angle rad turned, positive to the left
  /// @param radius m, above 0
  /// @param limits m/s, m/s^2
  /// @return the primitive under way
  Motion arc(double angle, double radius, Limits limits = {}) const;
  /// @}

  /// @name Commands for Simulation::step()
  /// It sends them; nothing repeats these. They throw what the functions above do, but for
  /// lockstep.
  /// @{

  /// @param v m/s ahead
  /// @param omega rad/s, positive to the left
  /// @param vy m/s to the left, of a robot that moves sideways
  /// @return the command
  [[nodiscard]] Command velocity_command(double v, double omega, double vy = 0.0) const;
  /// @param left rad/s, positive ahead
  /// @param right rad/s, positive ahead
  /// @return the command
  [[nodiscard]] Command wheel_command(double left, double right) const;
  /// @param values as command_joints() takes them
  /// @param mode the kind of the values
  /// @return the command
  [[nodiscard]] Command joint_command(const std::map<std::string, double>& values,
                                      JointMode mode = JointMode::position) const;
  /// @param kind a primitive
  /// @param value m or rad; of a stop 0
  /// @param limits as of the primitive
  /// @param radius m, of an arc
  /// @return the command
  [[nodiscard]] Command move_command(MotionKind kind, double value, Limits limits = {},
                                     double radius = 0.0) const;
  /// @}

 private:
  std::shared_ptr<Core> core_;
  std::string name_;
};

/// Options of spawn().
struct SpawnOptions {
  double heading = 0.0;   ///< rad
  std::string name = {};  ///< "": the model's own
  std::string text = {};  ///< SDF or URDF sent along, instead of a model's name
  bool on_ground = true;  ///< stands on the ground below; false: at z
  double z = 0.0;         ///< m
};

/// The parts that Simulation::reset() resets.
enum class Reset {
  all,   ///< the run continues as a fresh one
  time,  ///< sim time starts at 0 again; nothing moves
  poses  ///< everything back to where it started, at rest; sim time continues
};

/// A velocity, linear and angular, in the world.
struct Twist {
  Vector3 linear{};   ///< m/s
  Vector3 angular{};  ///< rad/s
};

/// A model, or a part of it, from Simulation::body(). Each call asks the server, and throws what a
/// request does. Copies are the same body.
class Body : public BodyInfo {
 public:
  /// @cond
  Body(std::shared_ptr<Core> core, BodyInfo info)
      : BodyInfo(std::move(info)), core_(std::move(core)) {}
  /// @endcond
  [[nodiscard]] Transform pose() const;  ///< @return in the world, as it is now
  [[nodiscard]] Twist twist() const;     ///< @return as it moves now
  /// Puts the model somewhere, at rest.
  /// @param pose in the world
  void set_pose(const Transform& pose) const;
  /// The same on the ground.
  /// @param x m, world
  /// @param y m, world
  /// @param heading rad
  /// @param z m, world
  void set_pose(double x, double y, double heading = 0.0, double z = 0.0) const {
    set_pose(Transform::of(x, y, heading, z));
  }
  /// @param twist that the model gets
  void set_twist(const Twist& twist) const;

 private:
  std::shared_ptr<Core> core_;
};

/// A running simulation. Move-only; its destructor closes it. In lockstep, or while paused, step()
/// drives time.
class [[nodiscard]] Simulation : public Requests {
 public:
  /// @cond
  explicit Simulation(std::shared_ptr<Core> core);
  Simulation(Simulation&&) noexcept = default;
  Simulation& operator=(Simulation&& other) noexcept;
  ~Simulation();
  /// @endcond

  /// @name The run
  /// They throw NoServer once this was closed or moved from.
  /// @{
  [[nodiscard]] std::string url() const;      ///< @return where the server is
  [[nodiscard]] std::string version() const;  ///< @return the server's
  [[nodiscard]] std::string world() const;    ///< @return its name
  int64_t seed() const;                       ///< @return the run's
  double step_size() const;                   ///< @return s
  double time() const;                        ///< @return s of sim time, of the newest message
  bool paused() const;                        ///< @return as ruedo/info last said it
  [[nodiscard]] std::vector<Robot> robots() const;     ///< @return all, in the world's order
  [[nodiscard]] std::vector<BodyInfo> bodies() const;  ///< @return all, of what never moves, too
  bool lockstep() const;  ///< @return whether the server waits for clients
  /// @}

  /// @param name of a robot
  /// @return the robot
  /// @throws UnknownName, which lists those that exist; NoServer
  [[nodiscard]] Robot robot(const std::string& name) const;
  /// @param name of a model ("crate"), or of a part of it ("crate/lid")
  /// @return its pose, its twist, and putting it elsewhere
  /// @throws UnknownName, which lists the models; NoServer
  [[nodiscard]] Body body(const std::string& name) const;
  /// @param time of sim time
  /// @throws NoServer
  void sleep(Duration time) const;
  /// A loop at a period of sim time: `for (double t : sim.every(0.1))` iterates at each multiple of
  /// it, with its time (s), and skips those that have passed while the loop's body ran. Ends with
  /// the run.
  /// @param period of sim time, above 0
  /// @return the loop's range
  /// @throws std::invalid_argument; NotSupported in lockstep; NoServer
  [[nodiscard]] Every every(Duration period) const;
  /// Streams joined by stamp: `for (const auto& [scan, pose] :
  /// sim.synchronised(robot.lrf(), robot.pose()))` has, with each sample of the first stream, what
  /// Stream::at() of the others gives for its time. Ends with the run.
  /// @param first paces the loop
  /// @param others are joined to it
  /// @return the loop's range
  /// @throws TypeMismatch, NoServer
  template <class First, class... Others>
  [[nodiscard]] Synchronised<First, Others...> synchronised(const Stream<First>& first,
                                                            const Stream<Others>&... others) const {
    return {first, others...};
  }
  /// Calls back, in the thread of the callbacks, when another server, or the same one restarted,
  /// answers at this address. Commands are not repeated into the new run, and primitives under way
  /// have ended.
  /// @param callback its exceptions are reported once on the terminal
  /// @return ends the calls when it goes
  /// @throws NoServer
  Subscription on_new_run(std::function<void()> callback) const;

  /// @name Requests
  /// Those of Requests, and these, which throw what those do.
  /// @{

  /// Takes n steps and returns the observations.
  ///
  /// In lockstep (`ruedo run --lockstep N`): takes part from the first call on, grants n steps with
  /// their commands, and has every message of every step; the first call's observations begin with
  /// those of the state it found. Else it steps a paused simulation; there are no commands, and the
  /// messages are in the streams.
  /// @param n number of steps; 0 takes none
  /// @param commands in lockstep, for these steps
  /// @param timeout of real time, each time that nothing advances
  /// @return the state after the last step, and in lockstep the messages of all
  /// @throws LeaseLost if the other clients continued without this one; Timeout
  Observations step(int64_t n = 1, const std::vector<Command>& commands = {},
                    Duration timeout = 60.0) const;
  /// @param what the parts to reset
  /// @param seed of the new epoch; -1: the same again
  void reset(Reset what = Reset::all, int64_t seed = -1) const;
  /// @param model one that comes with Ruedo, or a file the server finds
  /// @param x m, world
  /// @param y m, world
  /// @param options heading, name, height, or the model's text
  /// @return the model's name: the server numbers a name that exists, unless the call gave it
  std::string spawn(const std::string& model, double x, double y,
                    const SpawnOptions& options = {}) const;
  /// @copydoc Requests::remove
  void remove(const std::string& name) const;
  /// @param name of a model
  /// @param position m, world
  /// @param orientation to world
  void set_pose(const std::string& name, const Vector3& position,
                const Quaternion& orientation) const;
  /// @param name of a model
  /// @param x m, world
  /// @param y m, world
  /// @param heading rad
  /// @param z m, world
  void set_pose(const std::string& name, double x, double y, double heading = 0.0,
                double z = 0.0) const;
  /// Saves the state as an Engine does, in the server's folder for snapshots
  /// (LaunchOptions::snapshots).
  /// @param name of the snapshot
  /// @return for restore()
  [[nodiscard]] State save(const std::string& name = "saved") const {
    State saved = snapshot(name);
    saved.name = name;
    return saved;
  }
  /// @copydoc Requests::restore
  State restore(const std::string& name) const;
  /// Restores a state that save() returned.
  /// @param saved by save()
  /// @return the state as it is then
  State restore(const State& saved) const { return restore(saved.name); }
  /// @copydoc Requests::quit
  void quit() const;
  /// @}

  /// Draws in the world; the web console and the log show it.
  /// @param layer a name of your own; the markers replace all earlier ones of the layer
  /// @param markers the drawing; none empties the layer
  /// @param frame a robot, with whose base_link it moves; "": the world
  /// @throws std::invalid_argument for more than a message holds; NoServer
  void markers(const std::string& layer, const std::vector<Marker>& markers = {},
               const std::string& frame = "") const;

  /// Sends a message to the server and to all listeners at url().
  /// @param channel such as "p3at/velocity"; in lockstep commands belong to step()
  /// @param bytes LCM's encoding of it
  /// @throws NoServer; Error for a message that is too large
  void publish(const std::string& channel, const std::vector<uint8_t>& bytes) const;
  /// The same with an object of a class that lcm-gen made.
  /// @param channel as above
  /// @param message any
  template <class Message, class = decltype(&Message::getHash)>
  void publish(const std::string& channel, const Message& message) const {
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    publish(channel, bytes);
  }

  /// Ends repeated commands, and a server that launch() started; a second time nothing. In a
  /// callback it returns at once, and the end follows by itself; a second call, or the destructor,
  /// waits for it.
  /// @throws what a callback threw and no call has thrown since; while another exception is on its
  /// way it prints that
  void close();
};

/// Options of connect().
struct ConnectOptions {
  std::string name;        ///< of this client; "": "client-PID"
  Duration timeout = 2.0;  ///< of real time to wait for a server
};

/// Joins a simulation that runs.
/// @param url of LCM; "": LCM_DEFAULT_URL, else LCM's default group and port with ttl 0
/// @param options this client's name, and how long to wait
/// @return the simulation
/// @throws NoServer when none answers
Simulation connect(const std::string& url = "", const ConnectOptions& options = {});

/// Not for programs.
namespace detail {
/// The program that is installed with a header of Ruedo.
/// @param header its path
/// @return its path; "" without one
std::string program_beside(const std::string& header);
}  // namespace detail

/// Options of launch(); the lists are as the options of `ruedo run`.
struct LaunchOptions {
#ifdef RUEDO_PROGRAM  // find_package(ruedo) defines it
  std::string program = RUEDO_PROGRAM;
#else
  /// the server, unless the environment's RUEDO names one; "": by the PATH, or above this program
  std::string program = detail::program_beside(__FILE__);
#endif
  int64_t seed = -1;                        ///< -1: the server's default
  double rate = 1.0;                        ///< sim time per real time; kFast: as fast as it goes
  int lockstep = 0;                         ///< number of clients that the run waits for
  std::vector<std::string> spawn;           ///< models: "p3at@0,0", "p3at:NAME@X,Y,YAW"
  std::vector<std::string> disable;         ///< devices that are left out: "p3at/camera"
  std::map<std::string, Setting> settings;  ///< {{"p3at/lrf.update_rate", 20}}
  bool noise = true;                        ///< false: ideal values
  Duration duration = kForever;             ///< of sim time, after which the run ends
  bool paused = false;                      ///< starts the run paused, at step 0
  std::string record;                       ///< file of a log; "": none
  std::string snapshots;                    ///< folder for snapshot() and restore(); "": none
  std::vector<std::string> drive;           ///< by wheel joints: "rover=left_joint,right_joint"
  std::vector<std::string> fault;           ///< faults: "p3at/lrf:freeze@3"
  std::vector<std::string> plugin;          ///< shared libraries with sensors or drives
  std::vector<std::string> wait_for;        ///< where a command is due: "p3at/velocity@10"
  std::string text;               ///< the world's SDF or URDF itself, where the world is ""
  std::vector<std::string> args;  ///< further options of `ruedo run`
  std::string url;                ///< "": a local socket, which no other user of the machine
                                  ///< reads, and plain LCM programs do not know; "auto": a free
                                  ///< port for LCM
  std::string name = "client";    ///< of this client
  Duration timeout = 30.0;        ///< of real time until the world is loaded
  bool verbose = false;           ///< show what the server prints; else its warnings alone, and in
                                  ///< errors its last lines
};

/// Starts `ruedo run WORLD` and joins it. The server ends with the Simulation, and with this
/// process however that ends.
/// @param world a file, or the name of a world that comes with Ruedo; "": options.text has it
/// @param options seed, rate, robots and so on
/// @return the simulation
/// @throws LaunchError with what the server said
Simulation launch(const std::string& world, const LaunchOptions& options = {});

// ---- Recorded runs.

class LogFile;  // clients/cpp/log.cpp

/// The log of a run (`ruedo run --record`), or any other log of LCM: its messages by channel.
/// They are read from the file on demand, so that a log of any size is opened at once. Copies share
/// the file. Thread safe.
class Log {
 public:
  /// @cond
  explicit Log(std::shared_ptr<const LogFile> file) : file_(std::move(file)) {}
  /// @endcond

  /// The first call of this, count() or fault() reads the log through.
  /// @return their names, sorted
  [[nodiscard]] std::vector<std::string> channels() const;
  /// @param channel its name
  /// @return the number of its messages; 0 if the log does not have it
  [[nodiscard]] size_t count(const std::string& channel) const;
  /// @return "" if the file ends properly; else its truncation or damage, and at which byte: the
  /// messages before that are readable
  [[nodiscard]] const std::string& fault() const;

  /// The samples on a channel, in order: `log.samples<Scan>("p3at/lrf")`; RawSample has the bytes
  /// of any type.
  /// @param channel its name
  /// @return all of them
  /// @throws UnknownName, with the channels that there are; TypeMismatch; Error when the file can
  /// no longer be read
  template <class SampleType>
  [[nodiscard]] std::vector<SampleType> samples(const std::string& channel) const;
  /// Calls `use` with each sample on a channel, in order; of a log of any size one is in memory:
  /// `log.each<Scan>("p3at/lrf", [](const Scan& scan) { ... }, 10, 20)`.
  /// @param channel its name
  /// @param use what it throws ends the reading
  /// @param begin only samples from then on, s of the log's time: what comes before is not read
  /// @param end only samples up to then, s, itself included
  /// @throws as samples()
  template <class SampleType>
  void each(const std::string& channel, const std::function<void(const SampleType&)>& use,
            double begin = -std::numeric_limits<double>::infinity(),
            double end = std::numeric_limits<double>::infinity()) const;
  /// The same with objects of a class that lcm-gen made.
  /// @param channel its name
  /// @param use what it throws ends the reading
  /// @param begin s
  /// @param end s
  /// @throws as samples()
  template <class Message>
  void each_message(const std::string& channel, const std::function<void(const Message&)>& use,
                    double begin = -std::numeric_limits<double>::infinity(),
                    double end = std::numeric_limits<double>::infinity()) const {
    each<RawSample>(
        channel,
        [&](const RawSample& raw) { use(MessageStream<Message>::decoded(channel, raw.bytes)); },
        begin, end);
  }
  /// All as objects of a class that lcm-gen made.
  /// @param channel its name
  /// @return all of them
  /// @throws as samples()
  template <class Message>
  [[nodiscard]] std::vector<Message> messages(const std::string& channel) const {
    std::vector<Message> found;
    each_message<Message>(channel, [&](const Message& message) { found.push_back(message); });
    return found;
  }

 private:
  std::shared_ptr<const LogFile> file_;
};

/// @param path a file
/// @return its messages
/// @throws Error if the file cannot be read, or is not a log
Log read_log(const std::string& path);

}  // namespace ruedo::client
