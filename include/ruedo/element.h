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

// An interval of allowed numbers of a quantity, for reads and their error messages. However the
// interval lies, more than the quantity's maximum is refused. Infinity is refused unless
// or_infinite() lets it in ("inf" and "-inf", as SDF writes the limits of a joint); NaN always is.
struct Allowed {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_excluded = false;           // true: the value must be above min
  bool infinite = false;               // true: infinity is a value, where min and max admit it
  const Quantity* quantity = nullptr;  // null: min and max say it all

  Allowed or_infinite() const { return {min, max, min_excluded, true, quantity}; }
  static Allowed any(const Quantity& of) { return {.quantity = &of}; }
  static Allowed positive(const Quantity& of) {
    return {.min = 0.0, .min_excluded = true, .quantity = &of};
  }
  static Allowed not_negative(const Quantity& of) { return {.min = 0.0, .quantity = &of}; }
  static Allowed between(double low, double high) { return {.min = low, .max = high}; }
};

class Element {
 public:
  std::string name;  // as written, with its prefix: "link", "ruedo:drive"
  std::string text;  // without surrounding white space
  std::vector<std::pair<std::string, std::string>> attributes;
  std::vector<std::unique_ptr<Element>> children;
  Source source;

  Element() = default;
  std::unique_ptr<Element> clone() const;

  const std::string* attribute(std::string_view key) const;  // null when absent
  // First child of that name, null when absent. A path with '/' goes down: "scan/horizontal".
  const Element* child(std::string_view path) const;
  Element* child(std::string_view path);
  std::vector<const Element*> all(std::string_view child_name) const;
  bool has(std::string_view path) const { return child(path) != nullptr; }

  // Typed reads of the child at `path`; `fallback` when it is absent. They throw InputError for
  // what is not of the type (trailing characters, NaN and infinity included) or not allowed.
  // Numbers are read the same in every locale: "1,5" is refused.
  double number(std::string_view path, double fallback, Allowed allowed) const;
  int64_t integer(std::string_view path, int64_t fallback, Allowed allowed) const;
  bool boolean(std::string_view path, bool fallback) const;  // true, false, 1, 0
  std::string string(std::string_view path, std::string_view fallback) const;
  Rate rate(std::string_view path, Rate fallback) const;  // Hz
  Vec3 vector3(std::string_view path, const Vec3& fallback, Allowed allowed) const;
  Pose pose(std::string_view path,
            const Pose& fallback = {}) const;  // "x y z roll pitch yaw", degrees="true"
  // One of `choices`; the error lists them.
  std::string choice(std::string_view path, std::string_view fallback,
                     const std::vector<std::string>& choices) const;

  // The same reads of this element's own text.
  double as_number(Allowed allowed) const;
  int64_t as_integer(Allowed allowed) const;
  bool as_boolean() const;
  Vec3 as_vector3(Allowed allowed) const;
  std::vector<double> as_numbers(Allowed allowed) const;  // each of them
  Pose as_pose() const;

  // Refuses children (of the ruedo: namespace only, or of any) that are not in `known`, with a
  // suggestion.
  void refuse_unknown(const std::vector<std::string>& known, bool only_ruedo = true) const;

  // Throws InputError at this element.
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(source, "<" + name + ">: " + what);
  }
};

// The nearest of `known` to `word` by edit distance, or "" when none is near; for "did you mean".
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

}  // namespace ruedo
