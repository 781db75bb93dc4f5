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
#include <filesystem>
#include <map>
#include <memory>

#include "base/big_endian.h"
#include "base/input_file.h"
#include "base/lcm_log.h"
#include "base/type_files.h"
#include "base/wire_size.h"
#include "ruedo/errors.h"

namespace fs = std::filesystem;

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
  Tokens(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  // The next token. Throws at the end: a text ends between its types.
  std::string_view want() {
    const std::string_view token = next();
    if (token.empty()) fail("it ends within a type");
    return token;
  }

  [[noreturn]] void fail(const std::string& what) const { throw InputError(here(), what); }

  Source here() const {
    const auto line =
        1 + std::count(text_.begin(), text_.begin() + static_cast<ptrdiff_t>(at_), '\n');
    return {file_, static_cast<int>(line)};
  }

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
  const std::string& file_;
  size_t at_ = 0;
};

// A schema before the types of its members are looked up.
struct Parsed {
  Schema schema;
  Source source;
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

// Whether the field may be the length of others.
bool counts(const Field& field) {
  return field.dimensions.empty() &&
         (field.primitive == Primitive::int8 || field.primitive == Primitive::int16 ||
          field.primitive == Primitive::int32 || field.primitive == Primitive::int64);
}

// Reads `name[size][count];` after a type; true when another name follows a comma.
bool parse_member(Tokens& tokens, std::string_view type, Parsed& parsed) {
  Field field;
  field.name = tokens.want();
  field.primitive = primitive_of(type);
  parsed.hash = mix(parsed.hash, field.name);
  if (field.primitive != Primitive::none) parsed.hash = mix(parsed.hash, type);

  std::vector<std::string_view> sizes;
  std::string_view token = tokens.want();
  for (; token == "["; token = tokens.want()) {
    if (sizes.size() == kMostTypeDimensions)
      tokens.fail("'" + field.name + "' has more than " + std::to_string(kMostTypeDimensions) +
                  " dimensions");
    sizes.push_back(tokens.want());
    if (tokens.want() != "]") tokens.fail("the dimension of '" + field.name + "' has no ]");
  }
  if (token != "," && token != ";")
    tokens.fail("'" + std::string(token) + "' stands behind '" + field.name +
                "'; allowed are [, \",\" and ;");
  parsed.hash = mix(parsed.hash, static_cast<uint8_t>(sizes.size()));
  for (const std::string_view size : sizes) {
    Dimension dimension;
    const bool fixed = std::isdigit(static_cast<unsigned char>(size.front())) != 0;
    if (fixed) {
      const auto [end, error] =
          std::from_chars(size.data(), size.data() + size.size(), dimension.size);
      if (error != std::errc() || end != size.data() + size.size())
        tokens.fail("the length '" + std::string(size) + "' of '" + field.name +
                    "' is not a whole number");
    } else {
      const auto& fields = parsed.schema.fields;
      const auto counter = std::find_if(fields.begin(), fields.end(),
                                        [&](const Field& f) { return f.name == size; });
      if (counter == fields.end() || !counts(*counter))
        tokens.fail("the length '" + std::string(size) + "' of '" + field.name +
                    "' is not a field before it that is one int8_t, int16_t, int32_t or int64_t");
      dimension.counted_by = FieldIndex(counter - fields.begin());
    }
    parsed.hash = mix(mix(parsed.hash, static_cast<uint8_t>(fixed ? 0 : 1)), size);
    field.dimensions.push_back(dimension);
  }
  if (parsed.schema.fields.size() == kMostTypeFields)
    tokens.fail("'" + parsed.schema.name + "' has more than " + std::to_string(kMostTypeFields) +
                " fields");
  parsed.schema.fields.push_back(std::move(field));
  parsed.type_names.emplace_back(type);
  return token == ",";
}

void parse_file(std::string_view text, const std::string& file, std::deque<Parsed>& all) {
  if (text.find('\0') != std::string_view::npos)
    throw InputError({file}, "contains a zero byte: it is not a text");
  Tokens tokens(text, file);
  const size_t before = all.size();
  for (std::string_view token = tokens.next(); !token.empty(); token = tokens.next()) {
    if (token != "struct") continue;
    Parsed parsed;
    parsed.source = tokens.here();
    parsed.schema.name = tokens.want();
    if (tokens.want() != "{") tokens.fail("'" + parsed.schema.name + "' has no {");
    for (token = tokens.want(); token != "}"; token = tokens.want()) {
      if (token == "const") {
        while (tokens.want() != ";") {
        }
        continue;
      }
      while (parse_member(tokens, token, parsed)) {
      }
    }
    all.push_back(std::move(parsed));
  }
  if (all.size() == before) throw InputError({file}, "holds no message type: no struct of LCM's");
}

// Logs have the same ending as types, and lie in the same folders.
bool is_log(const std::string& path) {
  const InputFile input = open_to_look(path);
  std::array<uint8_t, sizeof kLogSync> begin{};
  return std::fread(begin.data(), 1, begin.size(), input.file.get()) == begin.size() &&
         read_big_endian<uint32_t>(begin.data()) == kLogSync;
}

constexpr size_t kCountless = size_t{1} << 62;

size_t saturating_sum(size_t a, size_t b) { return a < kCountless - b ? a + b : kCountless; }
size_t saturating_product(size_t a, size_t b) {
  return b == 0 || a < kCountless / b ? a * b : kCountless;
}

// The fewest bytes that a field takes on the wire, with all of its elements.
size_t least_bytes(const Field& field) {
  size_t bytes = least_size(field);
  for (const Dimension& d : field.dimensions)
    bytes = saturating_product(bytes, d.counted_by.valid() ? 0 : static_cast<size_t>(d.size));
  return bytes;
}

// Ruedo's types, or a user's, which may hold some of Ruedo's.
class Registry {
 public:
  // texts: of .lcm files, each with its name. Throws InputError.
  Registry(const std::vector<std::pair<std::string, std::string>>& texts, const Registry* others) {
    std::deque<Parsed> parsed;
    for (const auto& [file, text] : texts) parse_file(text, file, parsed);
    std::sort(parsed.begin(), parsed.end(),
              [](const Parsed& a, const Parsed& b) { return a.schema.name < b.schema.name; });
    for (const Parsed& p : parsed) schemas_.push_back(p.schema);
    for (size_t i = 0; i < schemas_.size(); ++i) {
      for (size_t f = 0; f < schemas_[i].fields.size(); ++f) {
        Field& field = schemas_[i].fields[f];
        const std::string_view type = without_package(parsed[i].type_names[f]);
        if (field.primitive != Primitive::none) continue;
        field.type = find(type);
        if (field.type == nullptr && others != nullptr) field.type = others->find(type);
        if (field.type == nullptr)
          wrong(parsed[i], "'" + field.name + "' is of the type '" + parsed[i].type_names[f] +
                               "', which is in no .lcm file that was read");
      }
    }
    std::vector<Extent> extents(schemas_.size());
    for (Schema& schema : schemas_) {
      measure(schema, parsed, extents, 0);
      by_fingerprint_.emplace(schema.fingerprint, &schema);
    }
  }

  const Schema* find(std::string_view name) const {
    const auto at =
        std::lower_bound(schemas_.begin(), schemas_.end(), name,
                         [](const Schema& s, std::string_view n) { return s.name < n; });
    return at != schemas_.end() && at->name == name ? &*at : nullptr;
  }
  const Schema* find(int64_t fingerprint) const {
    const auto at = by_fingerprint_.find(fingerprint);
    return at == by_fingerprint_.end() ? nullptr : at->second;
  }
  std::span<const Schema> schemas() const { return schemas_; }

 private:
  static std::string_view without_package(std::string_view type) {
    return type.substr(type.rfind('.') + 1);
  }

  // How large a type is with all that it holds.
  struct Extent {
    enum { unknown, under_way, known } state = unknown;
    size_t fields = 0;
    int height = 0;  // of structs in structs
  };

  // Fills in the fingerprint, LCM's hash of a type, and what its values take at least; those of
  // another registry's types are known. Each type is measured once, however many hold it.
  Extent measure(Schema& schema, const std::deque<Parsed>& parsed, std::vector<Extent>& extents,
                 int depth) {
    const auto at = static_cast<size_t>(&schema - schemas_.data());
    Extent& extent = extents[at];
    if (extent.state == Extent::known) return extent;
    if (extent.state == Extent::under_way)
      wrong(parsed[at], "it holds itself, which cannot be read");
    if (depth > kMostTypeDepth) too_deep(parsed[at]);
    extent.state = Extent::under_way;
    uint64_t hash = parsed[at].hash;
    for (const Field& field : schema.fields) {
      if (field.type != nullptr) {
        if (Schema* own = own_of(field.type)) {
          const Extent held = measure(*own, parsed, extents, depth + 1);
          extent.fields += held.fields;
          extent.height = std::max(extent.height, held.height + 1);
          if (extent.height > kMostTypeDepth) too_deep(parsed[at]);
        }
        if (field.type->least_bytes == 0)
          wrong(parsed[at], "'" + field.name + "' is of the type '" + field.type->name +
                                "', which holds nothing, and cannot be read");
        hash += static_cast<uint64_t>(field.type->fingerprint);
      }
      if (++extent.fields > kMostTypeFields)
        wrong(parsed[at], "it has, with the types that it holds, more than " +
                              std::to_string(kMostTypeFields) + " fields");
      schema.least_bytes = saturating_sum(schema.least_bytes, least_bytes(field));
    }
    schema.fingerprint = static_cast<int64_t>((hash << 1) + (hash >> 63));
    extent.state = Extent::known;
    return extent;
  }

  [[noreturn]] static void wrong(const Parsed& type, const std::string& what) {
    throw InputError(type.source, "the type '" + type.schema.name + "': " + what);
  }
  [[noreturn]] static void too_deep(const Parsed& type) {
    wrong(type,
          "it holds structs in structs more than " + std::to_string(kMostTypeDepth) + " deep");
  }

  // null: another registry's.
  Schema* own_of(const Schema* schema) {
    const bool own = schema >= schemas_.data() && schema < schemas_.data() + schemas_.size();
    return own ? schemas_.data() + (schema - schemas_.data()) : nullptr;
  }

  std::vector<Schema> schemas_;  // by name
  std::map<int64_t, const Schema*> by_fingerprint_;
};

const Registry& registry() {
  static const Registry kRegistry(
      [] {
        std::vector<std::pair<std::string, std::string>> texts;
        for (size_t i = 0; i < kLcmSourceCount; ++i) texts.emplace_back("proto", kLcmSources[i]);
        return texts;
      }(),
      nullptr);
  return kRegistry;
}

// Of the user's .lcm files; null before read_types().
std::unique_ptr<const Registry>& own_registry() {
  static std::unique_ptr<const Registry> own;
  return own;
}

}  // namespace

const Schema* find_schema(std::string_view name) { return registry().find(name); }

const Schema* find_schema(int64_t fingerprint) {
  const Schema* found = registry().find(fingerprint);
  return found != nullptr || !own_registry() ? found : own_registry()->find(fingerprint);
}

void read_types(const std::vector<std::string>& places) {
  std::vector<std::pair<std::string, std::string>> texts;
  for (const std::string& place : places) {
    std::vector<fs::path> files;
    std::error_code error;
    if (fs::is_directory(place, error)) {
      for (const auto& entry : fs::directory_iterator(place, error)) {
        if (entry.path().extension() == ".lcm" && !is_log(entry.path().string()))
          files.push_back(entry.path());
      }
      if (error || files.empty())
        throw InputError({place}, "the folder has no .lcm file of message types");
      std::sort(files.begin(), files.end());
    } else {
      files.emplace_back(place);
    }
    for (const fs::path& file : files)
      texts.emplace_back(file.string(), read_input(file.string(), kMostTypeBytes));
  }
  if (!texts.empty()) own_registry() = std::make_unique<const Registry>(texts, &registry());
}

std::span<const Schema> schemas() { return registry().schemas(); }

std::span<const Schema> read_schemas() {
  return own_registry() ? own_registry()->schemas() : std::span<const Schema>();
}

}  // namespace ruedo
