// A state as bytes: written by one copy of a world, and read by another of the same build, model,
// seed and options.
//
// Each class that keeps something between steps has one function for both ways, which names it:
//
//   void exchange(StateArchive& archive) { archive(time_, velocity_, noises_); }
//
// Members that the constructor sets are not in it. Only the build that wrote the bytes reads them,
// and trusts them: the reader has checked their seal (system/seal.h). Lengths are checked all the
// same.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "ruedo/index.h"
#include "ruedo/pose.h"
#include "ruedo/snapshot.h"

namespace ruedo {

/// Types that are written as the bytes they consist of, beside those that C++ calls trivially
/// copyable: structs of numbers, of which Eigen says that they are not. They hold no pointer.
template <class T>
inline constexpr bool kStateBytes = false;
template <class Scalar, int rows, int columns, int options>
inline constexpr bool kStateBytes<Eigen::Matrix<Scalar, rows, columns, options>> =
    rows > 0 && columns > 0;
template <>
inline constexpr bool kStateBytes<Quat> = true;
template <>
inline constexpr bool kStateBytes<Pose> = true;
template <>
inline constexpr bool kStateBytes<Twist> = true;
template <>
inline constexpr bool kStateBytes<Contact> = true;
template <>
inline constexpr bool kStateBytes<RobotState> = true;

template <>
inline constexpr bool kStateBytes<MotionEnd> = true;

/// A state cannot be written, or the bytes are not a state.
struct ArchiveError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Writes a state, or reads one.
class StateArchive {
 public:
  /// Writes.
  StateArchive() = default;
  /// Reads.
  /// @param bytes that another one wrote; must outlive it
  explicit StateArchive(std::span<const uint8_t> bytes) : left_(bytes), reads_(true) {}

  /// Writes the values, or reads them.
  /// @param values numbers, enumerations, structs of them, classes with a function
  ///   `exchange(StateArchive&)`, and lists, pairs, sets and optional ones of these
  template <class... T>
  void operator()(T&... values) {
    (put(values), ...);
  }
  /// A list whose length does not change.
  /// @param list whose elements' values are written or read
  template <class List>
  void each(List& list) {
    size_t size = list.size();
    bytes(&size, sizeof size);
    if (size != list.size()) refuse("a list has another length");
    for (auto& value : list) put(value);
  }
  /// An object's own bytes, for other libraries' structs of numbers.
  /// @param object without pointers
  template <class T>
  void raw(T& object) {
    bytes(&object, sizeof object);
  }

  /// @return whether it reads
  bool reads() const { return reads_; }
  /// @return what was written
  const std::vector<uint8_t>& written() const { return written_; }
  /// @return whether everything was read
  bool at_end() const { return left_.empty(); }
  /// Throws ArchiveError.
  /// @param why it cannot be written, or read
  [[noreturn]] static void refuse(const std::string& why) { throw ArchiveError(why); }

 private:
  void bytes(void* data, size_t size) {
    auto* begin = static_cast<uint8_t*>(data);
    if (!reads_) {
      written_.insert(written_.end(), begin, begin + size);
      return;
    }
    if (size > left_.size()) refuse("it is cut off");
    std::memcpy(begin, left_.data(), size);
    left_ = left_.subspan(size);
  }
  template <class T>
  void put(T& value) {
    if constexpr (requires { value.exchange(*this); }) {
      value.exchange(*this);
    } else {
      static_assert(kStateBytes<T> || (std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>),
                    "its class needs exchange(StateArchive&)");
      raw(value);
    }
  }
  template <class T, size_t size>
  void put(T (&array)[size]) {
    for (T& value : array) put(value);
  }
  template <class First, class Second>
  void put(std::pair<First, Second>& pair) {
    put(pair.first);
    put(pair.second);
  }
  template <class T>
  void put(std::vector<T>& list) {
    list.resize(length(list.size()));
    for (T& value : list) put(value);
  }
  template <class ItsIndex, class T>
  void put(IndexedVector<ItsIndex, T>& list) {
    put(static_cast<std::vector<T>&>(list));
  }
  void put(Snapshot& state) {
    (*this)(state.step, state.time, state.wind, state.bodies, state.body_twists,
            state.body_accelerations, state.wheel_angles, state.wheel_rates, state.joint_positions,
            state.joint_velocities, state.joint_efforts, state.robots, state.motion_ends,
            state.contacts, state.collisions, state.moving);
    if (reads_) state.source = {};
  }
  void put(std::string& text) {
    text.resize(length(text.size()));
    bytes(text.data(), text.size());
  }
  void put(std::set<std::string>& set) {
    std::vector<std::string> list(set.begin(), set.end());
    put(list);
    if (reads_) set = {list.begin(), list.end()};
  }
  template <class T>
  void put(std::optional<T>& optional) {
    bool has = optional.has_value();
    raw(has);
    if (!has) return optional.reset();
    if (!optional) optional.emplace();
    put(*optional);
  }
  size_t length(size_t size) {  // of what is read: no element is smaller than a byte
    bytes(&size, sizeof size);
    if (reads_ && size > left_.size()) refuse("a list is longer than what is left");
    return size;
  }

  std::vector<uint8_t> written_;
  std::span<const uint8_t> left_;
  bool reads_ = false;
};

}  // namespace ruedo
