/// @file
/// Ruedo's engine in the process of a C++17 program: copies of a world, stepped together over all
/// cores. Link with ruedo::engine.
///
/// It is the server's own code and gives the server's own bytes: copy i has the seed `seed + i`,
/// and its messages are those of `ruedo run WORLD --seed seed+i --lockstep 1` for the same commands
/// at the same steps. There is no network and no clock. SI units, radians; x ahead, y left, z up.
//
//     ruedo::EngineOptions options;
//     options.worlds = 64;
//     ruedo::Engine engine("arena", options);
//     const ruedo::Observation ranges = engine.observe("lrf.ranges");  // worlds x robots x beams
//     std::vector<double> commands(64 * 3, 0.0);  // (m/s ahead, m/s left, rad/s) each
//     engine.step(20, commands);                  // 20 steps of 5 ms
//     const float* end = ranges.end<float>(3);
//     const float nearest = *std::min_element(ranges.begin<float>(3), end);
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "ruedo/errors.h"
#include "ruedo/setting.h"

namespace ruedo {

/// The options of an Engine; the lists are as the options of `ruedo run`.
struct EngineOptions {
  int worlds = 1;     ///< copies
  uint64_t seed = 1;  ///< of copy 0; copy i has seed + i
  bool noise = true;  ///< false: sensors give their ideal values
  int threads = 0;    ///< at most so many cores; 0: all
  std::string text;   ///< the world itself, as SDF or URDF; the name is then what it is called
  std::vector<std::string> spawn;           ///< "p3at:guest@1,2,0.5"
  std::vector<std::string> drive;           ///< "rover=left_joint,right_joint"
  std::map<std::string, Setting> settings;  ///< {{"p3at/LRF.update_rate", 10}}
  std::vector<std::string> disable;         ///< "p3at/camera"
  std::vector<std::string> fault;           ///< "p3at/lrf:freeze@3"
  std::vector<std::string> plugins;         ///< files: sensors and drives of your own
};

/// A sensor of a robot.
struct EngineDevice {
  std::string robot;  ///< its robot
  std::string name;   ///< its name in the world file
  std::string kind;   ///< "lrf", "odometry", ...
};

/// The values of one field of a device's messages, of all robots that have it, in all copies: they
/// follow the runs.
///
/// A handle on memory of the engine's, which step() and reset() overwrite: copy what you keep. It
/// may outlive the engine.
class Observation {
 public:
  /// Of the values.
  enum class Type { boolean, byte, int8, int16, int32, int64, float32, float64 };

  /// @return of the values
  [[nodiscard]] Type type() const { return type_; }
  /// @return worlds, robots, then the field's own dimensions; row by row
  [[nodiscard]] const std::vector<int64_t>& shape() const { return shape_; }
  /// @return how many values a copy has
  [[nodiscard]] size_t size() const { return size_; }

  /// The values of a copy, as a span begin to end.
  /// @tparam T the C++ type of type(): float for float32, ...
  /// @param world a copy, from 0 on
  /// @throws std::invalid_argument when the values are of another type, std::out_of_range when
  /// there is no such copy
  /// @return its first value
  template <class T>
  [[nodiscard]] const T* begin(int world = 0) const {
    check(type_of<T>(), world);
    return reinterpret_cast<const T*>(bytes_.get()) + static_cast<size_t>(world) * size_;
  }
  /// As begin().
  /// @tparam T the C++ type of type()
  /// @param world a copy, from 0 on
  /// @return the place after its last value
  template <class T>
  [[nodiscard]] const T* end(int world = 0) const {
    return begin<T>(world) + size_;
  }

 private:
  friend class Engine;
  template <class T>
  static constexpr Type type_of();
  void check(Type wanted, int world) const;

  Type type_ = Type::float64;
  std::vector<int64_t> shape_;
  size_t size_ = 0;
  std::shared_ptr<const std::byte> bytes_;
};

/// A message of a copy, as a server would publish it.
struct EngineMessage {
  int world;                   ///< the copy, from 0 on
  int64_t step;                ///< of its run
  const std::string& channel;  ///< "p3at/lrf"
  const uint8_t* bytes;        ///< LCM's encoding
  size_t size;                 ///< of the bytes
};

namespace engine {
class SavedWorld;
}

/// A copy of an engine's world as it was; it does not change, and may outlive the engine.
class SavedWorld {
 public:
  /// @return the copy that it was
  [[nodiscard]] int world() const { return world_; }
  /// @return of its run, from 0 on
  [[nodiscard]] int64_t step() const { return step_; }

 private:
  friend class Engine;
  std::shared_ptr<const engine::SavedWorld> saved_;
  int world_ = 0;
  int64_t step_ = 0;
  uint64_t seed_ = 0;
};

/// Copies of one world. Move-only. One thread at a time; step() itself uses all cores.
class Engine {
 public:
  /// Computes state 0 of each copy.
  /// @param world a file, or the name of a world that comes with Ruedo or lies in a folder of
  /// RUEDO_PATH
  /// @param options how many copies, their seeds, what is changed
  /// @throws InputError for what is wrong in the file or an option: file, line, value and what is
  /// allowed
  /// @throws EnvironmentError for what the machine lacks
  explicit Engine(const std::string& world, const EngineOptions& options = {});
  /// @cond
  Engine(Engine&&) noexcept;
  Engine& operator=(Engine&&) noexcept;
  ~Engine();
  /// @endcond

  /// @return how many copies there are
  [[nodiscard]] int worlds() const;
  /// @return s
  [[nodiscard]] double step_size() const;
  /// @return the robots with a drive, in the order of the world file: the second axis of commands
  [[nodiscard]] const std::vector<std::string>& robots() const;
  /// @return the devices whose fields observe() reads
  [[nodiscard]] std::vector<EngineDevice> devices() const;
  /// @return the unsupported and the repaired elements of the world file: file, line, element, and
  /// the effect
  [[nodiscard]] const std::vector<std::string>& findings() const;

  /// Computes n states of every copy.
  /// @param n 1 or more
  /// @throws std::invalid_argument; std::runtime_error when a sensor or a drive failed
  void step(int64_t n = 1);
  /// The same after velocities for every driven robot of every copy, on the current states.
  /// @param n 1 or more
  /// @param velocities worlds x robots x (m/s ahead, m/s left, rad/s), row by row; a NaN gives no
  /// command: the earlier one holds, until the robot's watchdog
  /// @throws std::invalid_argument if it has another size
  void step(int64_t n, const std::vector<double>& velocities);

  /// A message on one of the channels that take commands ("p3at/move"), on the state that the copy
  /// is in.
  /// @param world the copy
  /// @param channel its name
  /// @param message LCM's encoding
  /// @throws InputError for a channel without commands, or bytes that do not decode
  void command(int world, const std::string& channel, const std::vector<uint8_t>& message);

  /// A field of a device, of all robots that have it.
  /// @param name "lrf.ranges", "LRF.ranges", "odometry.theta", "pose.pos"
  /// @return a handle on its values
  /// @throws InputError, with what there is
  [[nodiscard]] Observation observe(const std::string& name);

  /// Resets a copy, or all of them: what follows equals a fresh run.
  /// @param world the copy
  /// @param seed of the copy
  void reset(int world, uint64_t seed);
  void reset();  ///< with the seeds that they have

  /// The whole state of a copy, with the commands that are under way.
  /// It costs about as much as a reset, however long the copy has run.
  /// @param world the copy
  /// @throws InputError for a plugin's sensor or drive that cannot be copied
  /// @return for restore()
  [[nodiscard]] SavedWorld save(int world = 0);
  /// Restores a state of save() in copies: with the same commands they continue as the saved one
  /// did, byte for byte. They have its seed from then on.
  /// @param saved by this engine
  /// @param worlds the copies; none: the one that was saved
  /// @throws InputError for a state of another engine
  void restore(const SavedWorld& saved, const std::vector<int>& worlds = {});

  /// @param world the copy
  /// @return of its run, from 0 on
  [[nodiscard]] int64_t current_step(int world = 0) const;
  /// @param world the copy
  /// @return s of sim time
  [[nodiscard]] double time(int world = 0) const;
  /// @param world the copy
  /// @return of the whole state, bit for bit: the hash of the server's ticks
  [[nodiscard]] uint64_t state_hash(int world = 0) const;

  /// Has a function called in step() and reset() with each message, copies and messages in order.
  /// @param handler an empty one ends it
  void on_message(std::function<void(const EngineMessage&)> handler);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

template <>
constexpr Observation::Type Observation::type_of<bool>() {
  return Type::boolean;
}
template <>
constexpr Observation::Type Observation::type_of<uint8_t>() {
  return Type::byte;
}
template <>
constexpr Observation::Type Observation::type_of<int8_t>() {
  return Type::int8;
}
template <>
constexpr Observation::Type Observation::type_of<int16_t>() {
  return Type::int16;
}
template <>
constexpr Observation::Type Observation::type_of<int32_t>() {
  return Type::int32;
}
template <>
constexpr Observation::Type Observation::type_of<int64_t>() {
  return Type::int64;
}
template <>
constexpr Observation::Type Observation::type_of<float>() {
  return Type::float32;
}
template <>
constexpr Observation::Type Observation::type_of<double>() {
  return Type::float64;
}

}  // namespace ruedo
