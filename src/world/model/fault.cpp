// The kinds of faults, and --fault.
#include "world/model/fault.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "ruedo/element.h"

namespace ruedo::world {
namespace {

constexpr double kLongest_s = 1e6, kLongestDelay_s = 60.0, kFarthest_m = 1e6;
constexpr double kLargestSeed = 1e15;  // every whole number up to it is a double

// The two ways of writing a fault: with the time at which it begins, or without.
struct Form {
  const char *name, *time, *example_time;
};
constexpr Form kOption{"--fault", "@SECONDS", "@3"}, kFromNow{"fault", "", ""};

struct Written {
  const std::string& text;
  const Form& form;

  std::string place() const { return fmt::format("{} '{}'", form.name, text); }
  [[noreturn]] void refuse(const std::string& why) const {
    throw InputError(
        {}, fmt::format("{}: {}it looks like ROBOT/DEVICE:KIND{}[,for=S][,value=V][,...], for "
                        "example p3at/lrf:freeze{},for=2",
                        place(), why, form.time, form.example_time));
  }
};

struct Detail {
  const char* name;
  double Fault::* value;
  double usual;
};
constexpr Detail kDetails[] = {
    {"for", &Fault::duration_s, 0.0}, {"value", &Fault::value, 0.0}, {"from", &Fault::from, 0.0},
    {"to", &Fault::to, 1.0},          {"x", &Fault::x, 0.0},         {"y", &Fault::y, 0.0},
    {"heading", &Fault::heading, 0.0}};

bool has_detail(const FaultKind& kind, const std::string& name) {
  const bool is_kidnapped = kind.name == "kidnapped";
  if (name == "for") return kind.of != FaultKind::Of::world && !is_kidnapped;
  if (name == "value") return kind.least < kind.most;
  return name == "from" || name == "to" ? kind.name == "blocked" : is_kidnapped;
}

// Null: of any kind.
std::string details_of(const FaultKind* kind) {
  std::vector<std::string> names;
  for (const Detail& each : kDetails) {
    if (!kind || has_detail(*kind, each.name)) names.emplace_back(each.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

double read_number(const Written& written, const std::string& part) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
  if (error != std::errc() || end != part.data() + part.size() || !std::isfinite(value))
    written.refuse("'" + part + "' is not a number; ");
  return value;
}

}  // namespace

const std::vector<FaultKind>& fault_kinds() {
  using Of = FaultKind::Of;
  static const std::vector<FaultKind> kinds{
      {"dropout", Of::device, 0, 0, ""},
      {"freeze", Of::device, 0, 0, ""},
      {"lag", Of::device, 1e-6, kLongestDelay_s, "s"},
      {"bias", Of::device, -1e6, 1e6, "added to what it measures, SI"},
      {"scale", Of::device, -1e3, 1e3, "times what it measures"},
      {"blocked", Of::device, 0, 1e6, "m, the range that the blocked rays measure"},
      {"clock_drift", Of::device, -1, 1, "s a second"},
      {"encoder_stuck", Of::wheels, 0, 0, ""},
      {"wheel_slip", Of::wheels, 0.01, 0.95, "part of the wheels' turning that moves nothing"},
      {"weak_motor", Of::wheels, 0, 1, "part of the commanded speed that is left"},
      {"commands_lost", Of::robot, 1e-6, 1, "probability"},
      {"commands_late", Of::robot, 1e-6, kLongestDelay_s, "s"},
      {"commands_doubled", Of::robot, 1e-6, kLongestDelay_s, "s until the second"},
      {"kidnapped", Of::robot, 0, 0, ""},
      {"reseeded", Of::world, 0, kLargestSeed, "the seed"},
  };
  return kinds;
}

const FaultKind* find_fault_kind(const std::string& name) {
  const auto& kinds = fault_kinds();
  const auto found = std::find_if(kinds.begin(), kinds.end(),
                                  [&](const FaultKind& kind) { return kind.name == name; });
  return found == kinds.end() ? nullptr : &*found;
}

std::string check_fault(const Fault& fault) {
  const FaultKind* kind = find_fault_kind(fault.kind);
  if (!kind) {
    std::vector<std::string> names;
    for (const FaultKind& one : fault_kinds()) names.push_back(one.name);
    const std::string near = nearest_word(fault.kind, names);
    return fmt::format("kind '{}' is not allowed; allowed are {}{}", fault.kind,
                       fmt::join(names, ", "),
                       near.empty() ? "" : "; did you mean '" + near + "'?");
  }
  const auto is_time = [](double s) { return s >= 0.0 && s <= kLongest_s; };
  if (!is_time(fault.at_s))
    return fmt::format("its time {} is not allowed; allowed are 0 to {:g} s", fault.at_s,
                       kLongest_s);
  if (!is_time(fault.duration_s))
    return fmt::format("its duration {} is not allowed; allowed are 0 (to the end) to {:g} s",
                       fault.duration_s, kLongest_s);
  if (kind->least < kind->most && !(fault.value >= kind->least && fault.value <= kind->most)) {
    return fmt::format("value {} of {} is not allowed; allowed are {:g} to {:g} ({})", fault.value,
                       kind->name, kind->least, kind->most, kind->meaning);
  }
  if (kind->least == kind->most && fault.value != 0.0)
    return fmt::format("value {} of {} is not allowed; it takes none", fault.value, kind->name);
  if (kind->of == FaultKind::Of::device && fault.target.empty())
    return kind->name + " needs a device";
  if (kind->of == FaultKind::Of::wheels && fault.target != "" && fault.target != "left" &&
      fault.target != "right") {
    return fmt::format(
        "target '{}' of {} is not allowed; allowed are left, right, or none for both", fault.target,
        kind->name);
  }
  if (kind->of == FaultKind::Of::world && fault.value != std::floor(fault.value))
    return fmt::format("value {} of {} is not allowed; a seed is a whole number", fault.value,
                       kind->name);
  if (kind->of == FaultKind::Of::world && fault.duration_s > 0.0)
    return kind->name + " has no duration: it lasts until the next";
  if (kind->name == "kidnapped" && fault.duration_s > 0.0)
    return kind->name + " has no duration: it is done at once";
  if ((kind->of == FaultKind::Of::robot || kind->of == FaultKind::Of::world) &&
      !fault.target.empty())
    return fmt::format("{} has no target, and '{}' is one", kind->name, fault.target);
  for (const Detail& each : kDetails) {
    if (fault.*each.value != each.usual && !has_detail(*kind, each.name))
      return fmt::format("'{}' of {} is not allowed; allowed are {}", each.name, kind->name,
                         details_of(kind));
  }
  if (!(fault.from >= 0.0 && fault.from < fault.to && fault.to <= 1.0)) {
    return fmt::format(
        "from {} to {} is not allowed; allowed are parts of the field of view, 0 to 1, the smaller "
        "first",
        fault.from, fault.to);
  }
  if (!(std::abs(fault.x) <= kFarthest_m && std::abs(fault.y) <= kFarthest_m &&
        std::isfinite(fault.heading)))
    return fmt::format(
        "the place {} {} {} is not allowed; allowed are x and y within {} m, and a finite heading",
        fault.x, fault.y, fault.heading, kFarthest_m);
  return "";
}

namespace {

// "NAME=VALUE,..."
void read_details(const Written& written, std::string details, Fault& fault) {
  const FaultKind* kind = find_fault_kind(fault.kind);
  std::vector<std::string> given;
  for (details += ','; !details.empty(); details.erase(0, details.find(',') + 1)) {
    const std::string part = details.substr(0, details.find(','));
    const size_t equals = part.find('=');
    if (equals == std::string::npos) written.refuse("'" + part + "' is not NAME=VALUE; ");
    const std::string name = part.substr(0, equals);
    const auto detail = std::find_if(std::begin(kDetails), std::end(kDetails),
                                     [&](const Detail& each) { return each.name == name; });
    if (detail == std::end(kDetails) || (kind && !has_detail(*kind, name)))
      written.refuse("'" + name + "'" + (kind ? " of " + kind->name : "") +
                     " is not allowed; allowed are " + details_of(kind) + "; ");
    if (std::find(given.begin(), given.end(), name) != given.end())
      written.refuse("'" + name + "' is given twice; ");
    given.push_back(name);
    fault.*detail->value = read_number(written, part.substr(equals + 1));
  }
}

// Of text up to "@SECONDS", or up to the details where the form has no time.
Fault parse(const Written& written) {
  const std::string& text = written.text;
  const bool has_time = &written.form == &kOption;
  const size_t end =
      std::min(text.find(',', has_time ? std::min(text.find('@'), text.size()) : 0), text.size());
  const size_t at = text.substr(0, end).find('@');
  if (has_time && at == std::string::npos) written.refuse("");
  if (!has_time && at != std::string::npos)
    written.refuse("'" + text.substr(at, end - at) +
                   "' is not allowed: the fault begins when it is set; ");
  const size_t colon = text.rfind(':', std::min(at, end));
  if (colon == std::string::npos) written.refuse("");
  Fault fault;
  fault.robot = text.substr(0, colon);
  fault.kind = text.substr(colon + 1, std::min(at, end) - colon - 1);
  if (const size_t slash = fault.robot.find('/'); slash != std::string::npos) {
    fault.target = fault.robot.substr(slash + 1);
    fault.robot.resize(slash);
  }
  if (has_time) fault.at_s = read_number(written, text.substr(at + 1, end - at - 1));
  if (end < text.size()) read_details(written, text.substr(end + 1), fault);
  fault.source = {written.place(), 0};
  if (const std::string why = check_fault(fault); !why.empty()) throw InputError(fault.source, why);
  if (!fault.robot.empty() && find_fault_kind(fault.kind)->of == FaultKind::Of::world)
    throw InputError(fault.source,
                     fmt::format("{} is of the world, not of the robot '{}'; it looks like :{}{},"
                                 "value=SEED",
                                 fault.kind, fault.robot, fault.kind, written.form.time));
  return fault;
}

}  // namespace

Fault parse_fault(const std::string& text) { return parse({text, kOption}); }

Fault parse_fault_from_now(const std::string& text) { return parse({text, kFromNow}); }

}  // namespace ruedo::world
