// Converts yaml-cpp's nodes to elements.
#include "world/document/yaml.h"

#include <algorithm>
#include <map>

#include <yaml-cpp/yaml.h>

namespace ruedo::world {
namespace {

constexpr int kDeepest = 32;
// Aliases can refer to the same node many times, and its text.
constexpr size_t kMostNodes = 20'000, kMostBytes = 1 << 20;

struct Converter {
  const std::string& file;
  size_t nodes = 0, bytes = 0;

  void convert(const YAML::Node& node, Element& into, int depth) {
    into.source = {file, node.Mark().line + 1};
    check_depth(into.source, depth);
    count(into.source);
    if (node.IsScalar()) {
      into.text = counted(node.Scalar(), into);
    } else if (node.IsSequence()) {
      for (const YAML::Node& item : node) convert(item, child(into, "item"), depth + 1);
    } else if (node.IsMap()) {
      std::map<std::string, int> lines;  // by key
      for (const auto& entry : node) {
        const YAML::Node& value = entry.second;
        const Source source{file, entry.first.Mark().line + 1};
        const std::string key = entry.first.IsScalar() ? counted(entry.first.Scalar(), into) : "";
        const auto [first, is_new] = lines.try_emplace(key, source.line);
        if (!is_new && entry.first.IsScalar())
          throw InputError(source, "a second '" + key + "'; the first is in line " +
                                       std::to_string(first->second));
        const int levels = 1 + static_cast<int>(std::count(key.begin(), key.end(), '.'));
        check_depth(source, depth + levels);
        convert(value, place_of(key, source, into), depth + levels);
      }
    }
  }

  // The element of a map's entry. To ROS 2, "gains.arm.p: 1" is the same as {gains: {arm: {p: 1}}}.
  Element& place_of(const std::string& key, const Source& source, Element& map) {
    if (map.name != "ros__parameters") return child(map, key);
    Element* at = &map;
    size_t begin = 0;
    for (size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', begin)) {
      const std::string part = key.substr(begin, dot - begin);
      const auto known = std::find_if(at->children.begin(), at->children.end(),
                                      [&](const auto& each) { return each->name == part; });
      if (known == at->children.end()) {
        at = &child(*at, part);
        at->source = source;
        count(source);
      } else {
        at = known->get();
      }
      begin = dot + 1;
    }
    return child(*at, key.substr(begin));
  }

  static void check_depth(const Source& source, int depth) {
    if (depth > kDeepest)
      throw InputError(source,
                       "YAML that is nested more than " + std::to_string(kDeepest) + " deep");
  }

  void count(const Source& source) {
    if (++nodes > kMostNodes)
      throw InputError(source, "YAML of more than " + std::to_string(kMostNodes) + " entries");
  }

  std::string counted(const std::string& text, const Element& of) {
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
                     "is not YAML: " + error.msg);
  }
  return root;
}

}  // namespace ruedo::world
