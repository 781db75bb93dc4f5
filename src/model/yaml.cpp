// Converts yaml-cpp's nodes to elements.
#include "model/yaml.h"

#include <yaml-cpp/yaml.h>

namespace ruedo::model {
namespace {

constexpr int kDeepest = 32;
constexpr size_t kMostNodes = 100'000;  // aliases can refer to the same node many times

struct Converter {
  const std::string& file;
  size_t nodes = 0;

  void convert(const YAML::Node& node, Element& into, int depth) {
    into.source = {file, node.Mark().line + 1};
    if (depth > kDeepest)
      throw InputError(into.source,
                       "YAML that is nested more than " + std::to_string(kDeepest) + " deep");
    if (++nodes > kMostNodes)
      throw InputError(into.source, "YAML of more than " + std::to_string(kMostNodes) + " entries");
    if (node.IsScalar()) {
      into.text = node.Scalar();
    } else if (node.IsSequence()) {
      for (const YAML::Node& item : node) convert(item, child(into, "item"), depth + 1);
    } else if (node.IsMap()) {
      for (const auto& entry : node)
        convert(entry.second, child(into, entry.first.IsScalar() ? entry.first.Scalar() : ""),
                depth + 1);
    }
  }

  static Element& child(Element& parent, const std::string& name) {
    parent.children.push_back(std::make_unique<Element>());
    parent.children.back()->name = name;
    return *parent.children.back();
  }
};

}  // namespace

std::unique_ptr<Element> parse_yaml(const std::string& text, const std::string& file) {
  auto root = std::make_unique<Element>();
  try {
    const YAML::Node node = YAML::Load(text);
    Converter{file}.convert(node, *root, 0);
  } catch (const YAML::Exception& error) {
    throw InputError({file, error.mark.is_null() ? 0 : error.mark.line + 1},
                     "is no YAML: " + error.msg);
  }
  return root;
}

}  // namespace ruedo::model
