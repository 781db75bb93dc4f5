// Parses the definitions once and derives everything else.
#include "bridges/ros2/messages/interfaces.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <map>
#include <set>
#include <sstream>

#include <fmt/format.h>

#include "base/sha256.h"
#include "bridges/ros2/messages/definitions.h"
#include "ruedo/element.h"
#include "ruedo/errors.h"

namespace ruedo::ros2 {
namespace {

constexpr std::array kDistros{"humble", "iron", "jazzy", "kilted", "lyrical"};

// Numbers of the types in type_description_interfaces/msg/FieldType.
const std::map<std::string, int, std::less<>> kTypeIds{
    {"int8", 2},   {"uint8", 3}, {"int16", 4},  {"uint16", 5},   {"int32", 6},
    {"uint32", 7}, {"int64", 8}, {"uint64", 9}, {"float32", 10}, {"float64", 11},
    {"char", 13},  {"bool", 15}, {"byte", 16},  {"string", 17},
};
constexpr int kNested = 1, kBoundedString = 21, kArray = 48, kBounded = 96, kSequence = 144;

using Fields = std::map<std::string, std::vector<Field>, std::less<>>;
using Texts = std::map<std::string, std::string, std::less<>>;

size_t number(const std::string& text) {
  size_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

// "geometry_msgs/Point[]", "string<=256", "float64[36]".
Field read_field(const std::string& package, std::string type, const std::string& name) {
  Field field;
  field.name = name;
  if (const size_t bracket = type.find('['); bracket != std::string::npos) {
    const std::string size = type.substr(bracket + 1, type.size() - bracket - 2);
    field.kind = size.empty()             ? Field::Kind::sequence
                 : size.starts_with("<=") ? Field::Kind::bounded
                                          : Field::Kind::array;
    field.capacity = number(field.kind == Field::Kind::bounded ? size.substr(2) : size);
    type.resize(bracket);
  }
  if (const size_t bound = type.find("<="); bound != std::string::npos) {
    field.text_capacity = number(type.substr(bound + 2));
    type.resize(bound);
  }
  const size_t slash = type.find('/');
  if (slash != std::string::npos && slash == type.rfind('/')) {
    type = type.substr(0, slash) + "/msg/" + type.substr(slash + 1);
  } else if (slash == std::string::npos && !kTypeIds.contains(type)) {
    type = package + "/msg/" + type;
  }
  field.type = type;
  return field;
}

std::vector<Field> read_fields(const std::string& name, const std::string& text) {
  const std::string package = name.substr(0, name.find('/'));
  std::vector<Field> fields;
  std::istringstream lines(text);
  std::string line, type, field;
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    if (words >> type >> field) fields.push_back(read_field(package, type, field));
  }
  return fields;
}

struct Library {
  Fields fields;
  Texts texts;

  explicit Library(Distro distro) {
    for (const Definition& each : definitions()) {
      add(each.name, distro == Distro::humble && each.humble ? each.humble : each.text);
    }
  }

  void add(const std::string& name, const std::string& text) {
    const size_t half = text.find("---\n");  // a service, or a service of an action
    if (half == std::string::npos) return put(name, text);
    put(name + "_Request", text.substr(0, half));
    put(name + "_Response", text.substr(half + 4));
    fields[name + "_Event"] = {{"service_msgs/msg/ServiceEventInfo", "info"},
                               {name + "_Request", "request", Field::Kind::bounded, 1},
                               {name + "_Response", "response", Field::Kind::bounded, 1}};
    fields[name] = {{name + "_Request", "request_message"},
                    {name + "_Response", "response_message"},
                    {name + "_Event", "event_message"}};
  }

  void put(const std::string& name, const std::string& text) {
    texts[name] = text;
    fields[name] = read_fields(name, text);
    // C has no empty structs, and so ROS has no empty messages.
    if (fields[name].empty()) fields[name] = {{"uint8", "structure_needs_at_least_one_member"}};
  }
};

const Library& library(Distro distro) {
  static const Library humble(Distro::humble), later(Distro::jazzy);
  return distro == Distro::humble ? humble : later;
}

void collect(std::string_view type, Distro distro, std::set<std::string>& used) {
  for (const Field& field : fields_of(type, distro)) {
    if (!kTypeIds.contains(field.type) && used.insert(field.type).second)
      collect(field.type, distro, used);
  }
}

// .msg's char is an unsigned byte in the description.
int type_id(const Field& field) {
  const auto known = kTypeIds.find(field.type);
  int id = known == kTypeIds.end()   ? kNested
           : field.text_capacity > 0 ? kBoundedString
           : field.type == "char"    ? kTypeIds.at("uint8")
                                     : known->second;
  switch (field.kind) {
    case Field::Kind::one: break;
    case Field::Kind::array: id += kArray; break;
    case Field::Kind::bounded: id += kBounded; break;
    case Field::Kind::sequence: id += kSequence; break;
  }
  return id;
}

// JSON as written by Python's json.dumps(): the hash is over exactly these bytes.
std::string description(std::string_view type, Distro distro) {
  std::string fields;
  for (const Field& field : fields_of(type, distro)) {
    fields += fmt::format(
        R"({}{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, "nested_type_name": "{}"}}}})",
        fields.empty() ? "" : ", ", field.name, type_id(field), field.capacity, field.text_capacity,
        kTypeIds.contains(field.type) ? "" : field.type);
  }
  return fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", type, fields);
}

std::string short_name(const std::string& type) {
  const size_t middle = type.find('/');
  return type.substr(0, middle) + type.substr(type.rfind('/'));
}

}  // namespace

Distro parse_distro(const std::string& name) {
  const auto found = std::find(kDistros.begin(), kDistros.end(), name);
  if (found == kDistros.end())
    throw InputError({}, "there is no ROS 2 release '" + name +
                             "' here: humble, iron, jazzy, kilted and lyrical are known");
  return static_cast<Distro>(found - kDistros.begin());
}

const char* name_of(Distro distro) { return kDistros[static_cast<size_t>(distro)]; }

const std::vector<Field>& fields_of(std::string_view type, Distro distro) {
  const auto found = library(distro).fields.find(type);
  assert(found != library(distro).fields.end());
  return found->second;
}

std::string full_text(std::string_view type, Distro distro) {
  const Library& known = library(distro);
  std::string text = known.texts.find(type)->second;
  std::set<std::string> used;
  collect(type, distro, used);
  for (const std::string& each : used) {
    text +=
        std::string(80, '=') + "\nMSG: " + short_name(each) + "\n" + known.texts.find(each)->second;
  }
  return text;
}

std::string type_hash(std::string_view type, Distro distro) {
  std::set<std::string> used;
  collect(type, distro, used);
  used.erase(std::string(type));
  std::string others;
  for (const std::string& each : used)
    others += (others.empty() ? "" : ", ") + description(each, distro);
  const std::string json =
      fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})",
                  description(type, distro), others);
  return "RIHS01_" + sha256(reinterpret_cast<const uint8_t*>(json.data()), json.size());
}

std::string dds_type(std::string_view type) {
  std::string name(type);
  for (size_t at = name.find('/'); at != std::string::npos; at = name.find('/'))
    name.replace(at, 1, "::");
  const size_t last = name.rfind("::");
  return name.substr(0, last) + "::dds_" + name.substr(last) + "_";
}

}  // namespace ruedo::ros2
