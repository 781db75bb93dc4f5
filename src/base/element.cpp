// Typed reads of the document tree. Numbers are read by std::from_chars, which knows no locale;
// every error says file, line, element, value and what is allowed.
#include "ruedo/element.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "base/element_watch.h"
#include "base/text.h"
#include "base/whole.h"

namespace ruedo {
namespace {

std::string in_lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

// A value in quotes, cut where it is long, and without control characters: files may hold anything.
std::string quoted(std::string_view text) {
  constexpr size_t kLongest = 60;
  std::string result = "'";
  for (const char c : text.substr(0, kLongest))
    result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  return result + (text.size() > kLongest ? "...'" : "'");
}

std::string described(const Allowed& allowed, const char* what) {
  const bool low = std::isfinite(allowed.min), high = std::isfinite(allowed.max);
  std::string text = what;
  if (low && high && !allowed.min_excluded) {
    text += " from " + shown(allowed.min) + " to " + shown(allowed.max);
  } else {
    if (low) text += (allowed.min_excluded ? " above " : " of at least ") + shown(allowed.min);
    if (high) text += (low ? " and at most " : " of at most ") + shown(allowed.max);
  }
  if (allowed.infinite) text += ", or inf";
  return text;
}

// One element's text and its name in messages: the path from the element that the caller reads.
struct Value {
  const Element& element;
  std::string_view asked, child = {};  // names

  std::string path() const {
    return std::string(asked) + (child.empty() ? "" : "/" + std::string(child));
  }

  std::string_view text() const { return trimmed(element.text); }

  template <class Error = InputError>
  [[noreturn]] void refuse(const std::string& why, std::string_view value) const {
    throw Error(element.source, "<" + path() + ">: " + quoted(value) + " " + why);
  }
  [[noreturn]] void refuse(const std::string& why) const { refuse(why, text()); }
};

enum class Reading { good, not_a_number, too_large };

// All of `text` as a number.
Reading read_number(std::string_view text, double& value) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::invalid_argument || end != text.data() + text.size())
    return Reading::not_a_number;
  if (error == std::errc::result_out_of_range) {
    const size_t e = text.find_first_of("eE");
    const bool tiny =
        e != std::string_view::npos ? text.substr(e + 1, 1) == "-" : trimmed(text).find('.') <= 2;
    if (!tiny) return Reading::too_large;
    value = 0.0;
  }
  return Reading::good;
}

double number_of(const Value& where, std::string_view text, const Allowed& allowed) {
  double value = 0.0;
  switch (read_number(text, value)) {
    case Reading::good: break;
    case Reading::too_large: where.refuse<NotFinite>("is too large for a number", text);
    case Reading::not_a_number:
      where.refuse("is not a number; allowed is " + described(allowed, "a number"), text);
  }
  if (std::isnan(value) || (std::isinf(value) && !allowed.infinite)) {
    where.refuse<NotFinite>("is not finite; allowed is " + described(allowed, "a number"), text);
  }
  if (value < allowed.min || value > allowed.max ||
      (allowed.min_excluded && value <= allowed.min)) {
    where.refuse("is not allowed; allowed is " + described(allowed, "a number"), text);
  }
  if (allowed.quantity && std::isfinite(value) && std::abs(value) > allowed.quantity->most) {
    const Quantity& of = *allowed.quantity;
    const bool vowel = std::string_view("aei").find(of.name.front()) != std::string_view::npos;
    where.refuse("is too large for a" + std::string(vowel ? "n " : " ") + std::string(of.name) +
                     "; allowed is up to " + shown(of.most) +
                     (of.unit.empty() ? "" : " " + std::string(of.unit)) +
                     (allowed.infinite ? ", or inf" : ""),
                 text);
  }
  return value;
}

int64_t integer_of(const Value& where, const Allowed& allowed) {
  std::string_view text = where.text();
  const std::string wanted = "; allowed is " + described(allowed, "a whole number");
  int64_t value = 0;
  std::string_view digits = text;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) {
    // Files also write "640.0" and "1e3".
    double number = 0.0;
    if (read_number(text, number) != Reading::good || number != std::floor(number) ||
        std::abs(number) > 0x1p53) {
      where.refuse("is not a whole number" + wanted);
    }
    value = whole(number);
  }
  const double compared = static_cast<double>(value);
  if (compared < allowed.min || compared > allowed.max ||
      (allowed.min_excluded && compared <= allowed.min)) {
    where.refuse("is not allowed" + wanted);
  }
  return value;
}

bool boolean_of(const Value& where) {
  const std::string text = in_lower_case(where.text());
  if (text == "true" || text == "1") return true;
  if (text == "false" || text == "0") return false;
  where.refuse("is neither true nor false; allowed are true, false, 1, 0");
}

// The numbers from the fourth on are of another kind in a pose.
std::vector<double> numbers_of(const Value& where, const Allowed& first_three,
                               const Allowed& others) {
  std::vector<double> values;
  std::string_view rest = where.text();
  while (!rest.empty()) {
    const size_t length = std::min(rest.find_first_of(" \t\r\n\f\v"), rest.size());
    values.push_back(
        number_of(where, rest.substr(0, length), values.size() < 3 ? first_three : others));
    rest = trimmed(rest.substr(length));
  }
  return values;
}

Vec3 vector3_of(const Value& where, const Allowed& allowed) {
  const std::vector<double> values = numbers_of(where, allowed, allowed);
  if (values.size() != 3)
    where.refuse("has " + std::to_string(values.size()) + " numbers; allowed are three");
  return {values[0], values[1], values[2]};
}

Pose pose_of(const Value& where) {
  bool degrees = false, quaternion = false;
  if (const std::string* written = where.element.attribute("degrees")) {
    const std::string value = in_lower_case(trimmed(*written));
    if (value != "true" && value != "1" && value != "false" && value != "0") {
      where.refuse("is not allowed for degrees; allowed are true and false", *written);
    }
    degrees = value == "true" || value == "1";
  }
  if (const std::string* written = where.element.attribute("rotation_format")) {
    if (*written != "euler_rpy" && *written != "quat_xyzw") {
      where.refuse("is not allowed for rotation_format; allowed are euler_rpy and quat_xyzw",
                   *written);
    }
    quaternion = *written == "quat_xyzw";
  }
  std::vector<double> v =
      numbers_of(where, Allowed::any(quantity::kLength),
                 Allowed::any(quaternion ? quantity::kFactor : quantity::kAngle));
  if (v.empty()) return {};
  if (quaternion) {
    if (degrees) where.refuse("is a quaternion, which has no degrees");
    if (v.size() != 7)
      where.refuse("has " + std::to_string(v.size()) + " numbers; allowed are x y z qx qy qz qw");
    const Quat q(v[6], v[3], v[4], v[5]);
    if (!(q.norm() > 1e-9)) where.refuse("has no rotation: its quaternion is zero");
    return {q.normalized(), {v[0], v[1], v[2]}};
  }
  if (v.size() == 5 && where.element.name == "pose")
    v.push_back(0.0);  // as in Gazebo; the reader of poses warns
  if (v.size() != 6)
    where.refuse("has " + std::to_string(v.size()) + " numbers; allowed are x y z roll pitch yaw");
  const double unit = degrees ? M_PI / 180.0 : 1.0;
  return Pose::from_xyz_rpy({v[0], v[1], v[2]}, Vec3(v[3], v[4], v[5]) * unit);
}

}  // namespace

thread_local ElementWatch* ElementWatch::watch_ = nullptr;
ElementWatch::ElementWatch() { watch_ = this; }
ElementWatch::~ElementWatch() { watch_ = nullptr; }

std::unique_ptr<Element> Element::clone() const {
  auto copy = std::make_unique<Element>();
  copy->name = name;
  copy->text = text;
  copy->attributes = attributes;
  copy->source = source;
  copy->children.reserve(children.size());
  for (const auto& each : children) copy->children.push_back(each->clone());
  return copy;
}

const std::string* Element::attribute(std::string_view key) const {
  ElementWatch::note(*this, key);
  for (const auto& [name_, value] : attributes) {
    if (name_ == key) return &value;
  }
  return nullptr;
}

const Element* Element::child(std::string_view path) const {
  const size_t slash = path.find('/');
  const std::string_view first = path.substr(0, slash);
  for (const auto& each : children) {
    if (each->name != first) continue;
    ElementWatch::note(*each);
    return slash == std::string_view::npos ? each.get() : each->child(path.substr(slash + 1));
  }
  return nullptr;
}

Element* Element::child(std::string_view path) {
  return const_cast<Element*>(static_cast<const Element&>(*this).child(path));
}

std::vector<const Element*> Element::all(std::string_view child_name) const {
  std::vector<const Element*> found;
  for (const auto& each : children) {
    if (each->name != child_name) continue;
    ElementWatch::note(*each);
    found.push_back(each.get());
  }
  return found;
}

double Element::number(std::string_view path, double fallback, Allowed allowed) const {
  const Element* found = child(path);
  if (!found) return fallback;
  const Value value{*found, name, path};
  return number_of(value, value.text(), allowed);
}

int64_t Element::integer(std::string_view path, int64_t fallback, Allowed allowed) const {
  const Element* found = child(path);
  return found ? integer_of({*found, name, path}, allowed) : fallback;
}

bool Element::boolean(std::string_view path, bool fallback) const {
  const Element* found = child(path);
  return found ? boolean_of({*found, name, path}) : fallback;
}

std::string Element::string(std::string_view path, std::string_view fallback) const {
  const Element* found = child(path);
  return std::string(found ? trimmed(found->text) : fallback);
}

Rate Element::rate(std::string_view path, Rate fallback) const {
  const Element* found = child(path);
  if (!found) return fallback;
  try {
    return Rate::parse(trimmed(found->text));
  } catch (const std::invalid_argument& error) {
    throw InputError(found->source, "<" + name + "/" + std::string(path) + ">: " + error.what());
  }
}

Vec3 Element::vector3(std::string_view path, const Vec3& fallback, Allowed allowed) const {
  const Element* found = child(path);
  return found ? vector3_of({*found, name, path}, allowed) : fallback;
}

Pose Element::pose(std::string_view path, const Pose& fallback) const {
  const Element* found = child(path);
  return found ? pose_of({*found, name, path}) : fallback;
}

std::string Element::choice(std::string_view path, std::string_view fallback,
                            const std::vector<std::string>& choices) const {
  const Element* found = child(path);
  if (!found) return std::string(fallback);
  const Value value{*found, name, path};
  const std::string text(value.text());
  if (std::find(choices.begin(), choices.end(), text) != choices.end()) return text;
  std::string list;
  for (const std::string& each : choices) list += (list.empty() ? "" : ", ") + each;
  value.refuse("is not allowed; allowed: " + list);
}

double Element::as_number(Allowed allowed) const {
  const Value value{*this, name};
  return number_of(value, value.text(), allowed);
}

int64_t Element::as_integer(Allowed allowed) const { return integer_of({*this, name}, allowed); }
bool Element::as_boolean() const { return boolean_of({*this, name}); }
Vec3 Element::as_vector3(Allowed allowed) const { return vector3_of({*this, name}, allowed); }
std::vector<double> Element::as_numbers(Allowed allowed) const {
  return numbers_of({*this, name}, allowed, allowed);
}
Pose Element::as_pose() const { return pose_of({*this, name}); }

void Element::refuse_unknown(const std::vector<std::string>& known, bool only_ruedo) const {
  for (const auto& each : children) {
    if (only_ruedo && !each->name.starts_with("ruedo:")) continue;
    if (std::find(known.begin(), known.end(), each->name) != known.end()) continue;
    const std::string near = nearest_word(each->name, known);
    std::string text = "<" + each->name + "> is not known in <" + name + ">";
    if (!near.empty()) {
      text += "; did you mean <" + near + ">?";
    } else if (!known.empty()) {
      text += "; known:";
      for (const std::string& word : known) text += " <" + word + ">";
    }
    throw InputError(each->source, text);
  }
}

}  // namespace ruedo
