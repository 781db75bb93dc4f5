// Reads the embedded .lcm texts into schemas and computes LCM's fingerprints.
//
// The fingerprint's rules are those of lcm-gen 1.5: a hash over the members' names, primitive types
// and dimensions; a struct adds the hashes of the types it holds and is then rotated left by one
// bit.
#include "ruedo/schema.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <deque>
#include <map>
#include <stdexcept>

namespace ruedo {

// Made by CMake from proto/*.lcm.
extern const char* const kLcmSources[];
extern const size_t kLcmSourceCount;

namespace {

constexpr std::array<std::pair<std::string_view, Primitive>, 9> kPrimitives{
    {{"boolean", Primitive::boolean},
     {"byte", Primitive::byte},
     {"int8_t", Primitive::int8},
     {"int16_t", Primitive::int16},
     {"int32_t", Primitive::int32},
     {"int64_t", Primitive::int64},
     {"float", Primitive::float32},
     {"double", Primitive::float64},
     {"string", Primitive::string}}};

// Words and single punctuation characters, without comments.
class Tokens {
 public:
  explicit Tokens(std::string_view text) : text_(text) {}

  // The next token, empty at the end.
  std::string_view next() {
    skip();
    if (at_ == text_.size()) return {};
    const size_t begin = at_++;
    if (is_word(text_[begin])) {
      while (at_ < text_.size() && is_word(text_[at_])) ++at_;
    }
    return text_.substr(begin, at_ - begin);
  }

 private:
  static bool is_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == '-' ||
           c == '+';
  }
  void skip() {
    while (at_ < text_.size()) {
      if (std::isspace(static_cast<unsigned char>(text_[at_]))) {
        ++at_;
      } else if (text_.substr(at_, 2) == "//") {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (text_.substr(at_, 2) == "/*") {
        const size_t end = text_.find("*/", at_);
        at_ = end == std::string_view::npos ? text_.size() : end + 2;
      } else {
        return;
      }
    }
  }
  std::string_view text_;
  size_t at_ = 0;
};

// A schema before the types of its members are looked up.
struct Parsed {
  Schema schema;
  std::vector<std::string> type_names;  // of each field
  uint64_t hash = 0x12345678;
};

uint64_t mix(uint64_t hash, uint8_t byte) {
  return ((hash << 8) ^ static_cast<uint64_t>(static_cast<int64_t>(hash) >> 55)) + byte;
}
uint64_t mix(uint64_t hash, std::string_view text) {
  hash = mix(hash, static_cast<uint8_t>(text.size()));
  for (const char c : text) hash = mix(hash, static_cast<uint8_t>(c));
  return hash;
}

Primitive primitive_of(std::string_view type) {
  for (const auto& [name, primitive] : kPrimitives) {
    if (name == type) return primitive;
  }
  return Primitive::none;
}

// Reads `name[size][count];` after a type; true when another name follows a comma.
bool parse_member(Tokens& tokens, std::string_view type, Parsed& parsed) {
  Field field;
  field.name = tokens.next();
  field.primitive = primitive_of(type);
  parsed.hash = mix(parsed.hash, field.name);
  if (field.primitive != Primitive::none) parsed.hash = mix(parsed.hash, type);

  std::vector<std::string_view> sizes;
  std::string_view token = tokens.next();
  for (; token == "["; token = tokens.next()) {
    sizes.push_back(tokens.next());
    if (tokens.next() != "]") throw std::logic_error("bad dimension of " + field.name);
  }
  parsed.hash = mix(parsed.hash, static_cast<uint8_t>(sizes.size()));
  for (const std::string_view size : sizes) {
    Dimension dimension;
    const bool fixed = std::isdigit(static_cast<unsigned char>(size.front())) != 0;
    if (fixed) {
      std::from_chars(size.data(), size.data() + size.size(), dimension.size);
    } else {
      const auto& fields = parsed.schema.fields;
      const auto counter = std::find_if(fields.begin(), fields.end(),
                                        [&](const Field& f) { return f.name == size; });
      if (counter == fields.end()) throw std::logic_error("unknown length " + std::string(size));
      dimension.counted_by = static_cast<int>(counter - fields.begin());
    }
    parsed.hash = mix(mix(parsed.hash, static_cast<uint8_t>(fixed ? 0 : 1)), size);
    field.dimensions.push_back(dimension);
  }
  parsed.schema.fields.push_back(std::move(field));
  parsed.type_names.emplace_back(type);
  return token == ",";
}

void parse_file(std::string_view text, std::deque<Parsed>& all) {
  Tokens tokens(text);
  for (std::string_view token = tokens.next(); !token.empty(); token = tokens.next()) {
    if (token != "struct") continue;
    Parsed parsed;
    parsed.schema.name = tokens.next();
    if (tokens.next() != "{") throw std::logic_error("no body of " + parsed.schema.name);
    for (token = tokens.next(); token != "}"; token = tokens.next()) {
      if (token.empty()) throw std::logic_error("no end of " + parsed.schema.name);
      if (token == "const") {
        while (tokens.next() != ";") {
        }
        continue;
      }
      while (parse_member(tokens, token, parsed)) {
      }
    }
    all.push_back(std::move(parsed));
  }
}

struct Registry {
  std::vector<Schema> schemas;  // by name
  std::map<int64_t, const Schema*> by_fingerprint;

  Registry() {
    std::deque<Parsed> parsed;
    for (size_t i = 0; i < kLcmSourceCount; ++i) parse_file(kLcmSources[i], parsed);
    std::sort(parsed.begin(), parsed.end(),
              [](const Parsed& a, const Parsed& b) { return a.schema.name < b.schema.name; });
    for (const Parsed& p : parsed) schemas.push_back(p.schema);
    for (size_t i = 0; i < schemas.size(); ++i) {
      for (size_t f = 0; f < schemas[i].fields.size(); ++f) {
        Field& field = schemas[i].fields[f];
        if (field.primitive == Primitive::none)
          field.type = find(without_package(parsed[i].type_names[f]));
      }
    }
    for (size_t i = 0; i < schemas.size(); ++i) {
      schemas[i].fingerprint = static_cast<int64_t>(fingerprint(i, parsed));
      by_fingerprint.emplace(schemas[i].fingerprint, &schemas[i]);
    }
  }

  const Schema* find(std::string_view name) const {
    const auto at =
        std::lower_bound(schemas.begin(), schemas.end(), name,
                         [](const Schema& s, std::string_view n) { return s.name < n; });
    return at != schemas.end() && at->name == name ? &*at : nullptr;
  }

 private:
  static std::string_view without_package(std::string_view type) {
    return type.substr(type.rfind('.') + 1);
  }

  // No type of ours holds itself, so the recursion ends.
  uint64_t fingerprint(size_t index, const std::deque<Parsed>& parsed) const {
    uint64_t hash = parsed[index].hash;
    for (const Field& field : schemas[index].fields) {
      if (field.type != nullptr)
        hash += fingerprint(static_cast<size_t>(field.type - schemas.data()), parsed);
    }
    return (hash << 1) + (hash >> 63);
  }
};

const Registry& registry() {
  static const Registry kRegistry;
  return kRegistry;
}

}  // namespace

const Schema* find_schema(std::string_view name) { return registry().find(name); }

const Schema* find_schema(int64_t fingerprint) {
  const auto at = registry().by_fingerprint.find(fingerprint);
  return at == registry().by_fingerprint.end() ? nullptr : at->second;
}

std::span<const Schema> schemas() { return registry().schemas; }

}  // namespace ruedo
