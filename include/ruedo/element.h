// The document tree that a world or robot file becomes: elements that know their file and line, and
// typed reads whose errors name file, line, element, value and what is allowed.
//
// A sensor or a drive gets its own element and reads its configuration from it, so that the world
// reader need not know any sensor. Reads are const and safe from many threads; nothing here parses
// XML.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "ruedo/errors.h"
#include "ruedo/pose.h"
#include "ruedo/quantity.h"
#include "ruedo/sim_time.h"

namespace ruedo {

/// An interval of allowed numbers of a quantity, for reads and their error messages. However the
/// interval lies, more than the quantity's maximum is refused. Infinity is refused unless
/// or_infinite() lets it in ("inf" and "-inf", as SDF writes the limits of a joint); NaN always is.
struct Allowed {
  double min = -std::numeric_limits<double>::infinity();  ///< the lowest number allowed
  double max = std::numeric_limits<double>::infinity();   ///< the highest number allowed
  bool min_excluded = false;                              ///< true: the value must be above min
  bool infinite = false;               ///< true: infinity is a value, where min and max admit it
  const Quantity* quantity = nullptr;  ///< null: min and max say it all

  /// @return the same, with infinity
  Allowed or_infinite() const { return {min, max, min_excluded, true, quantity}; }
  /// @param of the quantity
  /// @return every value of it
  static Allowed any(const Quantity& of) { return {.quantity = &of}; }
  /// @param of the quantity
  /// @return values above 0
  static Allowed positive(const Quantity& of) {
    return {.min = 0.0, .min_excluded = true, .quantity = &of};
  }
  /// @param of the quantity
  /// @return values from 0
  static Allowed not_negative(const Quantity& of) { return {.min = 0.0, .quantity = &of}; }
  /// @param low the lowest number allowed
  /// @param high the highest number allowed
  /// @return the closed interval
  static Allowed between(double low, double high) { return {.min = low, .max = high}; }
};

/// An element of a file, with its children.
///
/// Reads take the path of a child: its name, or several with '/' between them, "scan/horizontal".
/// Of several children of one name the first is read. Without one, the read returns its fallback.
/// Reads throw InputError for a value that is not of the type (trailing characters, NaN and
/// infinity included) or not allowed. Numbers are read the same in every locale: "1,5" is refused.
class Element {
 public:
  std::string name;  ///< as written, with its prefix: "link", "ruedo:drive"
  std::string text;  ///< without surrounding white space
  std::vector<std::pair<std::string, std::string>> attributes;  ///< keys and values, as written
  std::vector<std::unique_ptr<Element>> children;               ///< in the order of the file
  Source source;                                                ///< where it begins

  Element() = default;
  /// @return a copy, with all that is below it
  std::unique_ptr<Element> clone() const;

  /// @param key of an attribute
  /// @return its value; null when it is absent
  const std::string* attribute(std::string_view key) const;
  /// @param path of a child
  /// @return the first one there; null without one
  const Element* child(std::string_view path) const;
  /// @param path of a child
  /// @return the first one there; null without one
  Element* child(std::string_view path);
  /// @param child_name without a path
  /// @return the children of that name, in the order of the file
  std::vector<const Element*> all(std::string_view child_name) const;
  /// @param path of a child
  /// @return whether it is there
  bool has(std::string_view path) const { return child(path) != nullptr; }

  /// @param path of a child
  /// @param fallback where it is absent
  /// @param allowed its values
  /// @return the child's text as a number
  /// @throws InputError for other text, or for a value that is not allowed
  double number(std::string_view path, double fallback, Allowed allowed) const;
  /// @param path of a child
  /// @param fallback where it is absent
  /// @param allowed its values
  /// @return the child's text as a whole number
  /// @throws InputError for other text, or for a value that is not allowed
  int64_t integer(std::string_view path, int64_t fallback, Allowed allowed) const;
  /// @param path of a child
  /// @param fallback where it is absent
  /// @return whether the child's text is true or 1, not false or 0
  /// @throws InputError if it is another text
  bool boolean(std::string_view path, bool fallback) const;
  /// @param path of a child
  /// @param fallback where it is absent
  /// @return the child's text
  std::string string(std::string_view path, std::string_view fallback) const;
  /// @param path of a child
  /// @param fallback where it is absent
  /// @return the child's text as a rate in Hz
  /// @throws InputError if it is not a rate
  Rate rate(std::string_view path, Rate fallback) const;
  /// @param path of a child
  /// @param fallback where it is absent
  /// @param allowed the values of each number
  /// @return the child's text as three numbers
  /// @throws InputError when it is not, or one is not allowed
  Vec3 vector3(std::string_view path, const Vec3& fallback, Allowed allowed) const;
  /// @param path of a child
  /// @param fallback where it is absent
  /// @return the child's text as a pose: "x y z roll pitch yaw", with degrees="true" in degrees
  /// @throws InputError if it is not a pose
  Pose pose(std::string_view path, const Pose& fallback = {}) const;
  /// @param path of a child
  /// @param fallback where it is absent
  /// @param choices the allowed texts
  /// @return the child's text
  /// @throws InputError that lists the choices, if it is another text
  std::string choice(std::string_view path, std::string_view fallback,
                     const std::vector<std::string>& choices) const;

  /// @param allowed its values
  /// @return this element's own text as a number
  /// @throws InputError for other text, or for a value that is not allowed
  double as_number(Allowed allowed) const;
  /// @param allowed its values
  /// @return this element's own text as a whole number
  /// @throws InputError for other text, or for a value that is not allowed
  int64_t as_integer(Allowed allowed) const;
  /// @return whether this element's own text is true or 1, not false or 0
  /// @throws InputError if it is another text
  bool as_boolean() const;
  /// @param allowed the values of each number
  /// @return this element's own text as three numbers
  /// @throws InputError when it is not, or one is not allowed
  Vec3 as_vector3(Allowed allowed) const;
  /// @param allowed the values of each number
  /// @return this element's own text as numbers with white space between them
  /// @throws InputError when it is not, or one is not allowed
  std::vector<double> as_numbers(Allowed allowed) const;
  /// @return this element's own text as a pose, as pose() reads it
  /// @throws InputError if it is not a pose
  Pose as_pose() const;

  /// Refuses children that are not read.
  /// @param known names of children that are read
  /// @param only_ruedo checks only children of the ruedo: namespace
  /// @throws InputError that names the child, and the nearest known name
  void refuse_unknown(const std::vector<std::string>& known, bool only_ruedo = true) const;

  /// Refuses this element.
  /// @param what was found, and what is allowed
  /// @throws InputError always, with this element's place and name before the text
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(source, "<" + name + ">: " + what);
  }
};

/// For "did you mean".
/// @param word as written
/// @param known words
/// @return the one of them nearest to the word by edit distance; "" when none is near
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

}  // namespace ruedo
