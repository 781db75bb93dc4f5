#include "console/types.h"

#include "base/json.h"
#include "base/type_files.h"

namespace ruedo::console {
namespace {

const char* name_of(Primitive primitive) {
  switch (primitive) {
    case Primitive::boolean: return "boolean";
    case Primitive::byte: return "byte";
    case Primitive::int8: return "int8_t";
    case Primitive::int16: return "int16_t";
    case Primitive::int32: return "int32_t";
    case Primitive::int64: return "int64_t";
    case Primitive::float32: return "float";
    case Primitive::float64: return "double";
    default: return "string";
  }
}

}  // namespace

std::string types_json() {
  JsonWriter json;
  json.open('{');
  for (const Schema& schema : read_schemas()) {
    json.name(schema.name).open('[');
    for (const Field& field : schema.fields) {
      json.open('{').member("name", field.name);
      json.member("type", field.type ? field.type->name : std::string(name_of(field.primitive)));
      json.name("sizes").open('[');
      for (const Dimension& dimension : field.dimensions) {
        if (dimension.counted_by.valid())
          json.value(schema.fields[dimension.counted_by].name);
        else
          json.value(dimension.size);
      }
      json.close(']').close('}');
    }
    json.close(']');
  }
  return json.close('}').text();
}

}  // namespace ruedo::console
