// Converts yaml-cpp's nodes to elements.
#include "model/yaml.h"

#include <map>

#include <yaml-cpp/yaml.h>

namespace ruedo::model {
namespace {

constexpr int kDeepest = 32;
// Aliases can refer to the same node many times, and its text.
constexpr size_t kMostNodes = 20'000, kMostBytes = 1 << 20;

struct Converter {
  const std::string& file;
  size_t nodes = 0, bytes = 0;

  void convert(const YAML::Node& node, Element& into, int depth) {
    into.source = {file, node.Mark().line + 1};
    if (depth > kDeepest)
      throw InputError(into.source,
                       "YAML that is nested more than " + std::to_string(kDeepest) + " deep");
    if (++nodes > kMostNodes)
      throw InputError(into.source, "YAML of more than " + std::to_string(kMostNodes) + " entries");
    if (node.IsScalar()) {
      into.text = counted(node.Scalar(), into);
    } else if (node.IsSequence()) {
      for (const YAML::Node& item : node) convert(item, child(into, "item"), depth + 1);
    } else if (node.IsMap()) {
      std::map<std::string, int> lines;  // by key
      for (const auto& entry : node) {
        const YAML::Node &key = entry.first, &value = entry.second;
        const int line = key.Mark().line + 1;
        if (key.IsScalar()) {
          const auto [first, is_new] = lines.try_emplace(counted(key.Scalar(), into), line);
          if (!is_new)
            throw InputError({file, line}, "a second '" + key.Scalar() +
                                               "'; the first is in line " +
                                               std::to_string(first->second));
        }
        convert(value, child(into, key.IsScalar() ? key.Scalar() : ""), depth + 1);
      }
    }
  }

  const std::string& counted(const std::string& text, const Element& of) {
    if ((bytes += text.size()) > kMostBytes)
      throw InputError(of.source, "YAML of more than " + std::to_string(kMostBytes >> 20) +
                                      " MiB, with each alias counted as what it stands for");
    return text;
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
