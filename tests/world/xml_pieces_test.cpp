// The code that counts, changes and parses an XML text sees the same elements, however it is
// written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "world/document/document.h"
#include "world/document/xml_text.h"

namespace ruedo::world {
namespace {

std::string fault_of(const std::string& text) {
  try {
    parse_document(text, "w.sdf");
    return "";
  } catch (const InputError& error) {
    return error.message();
  }
}

TEST(XmlPieces, BoundsHoldHoweverTheTextIsWritten) {
  std::string many;
  for (int i = 0; i < 65; ++i) many += " a" + std::to_string(i) + "='1'";
  const std::string element = "<model" + many + "/>";
  for (const std::string& text : {
           "<sdf>" + element + "</sdf>",
           "<?xml version='1.0' > <!-- ?><sdf>" + element + "</sdf>",
           "<!--><![CDATA[ --><sdf>" + element + "<!-- ]]> --></sdf>",
           "<sdf><model></model" + many + "></sdf>",
           "<sdf a='>'><b c='/>'>" + element + "</b></sdf>",
           "< sdf>" + element + "</sdf>",
       })
    EXPECT_THAT(fault_of(text), testing::HasSubstr("attributes; allowed are 64")) << text;
  std::string levels = "<?xml > <!-- ?>";
  for (int i = 0; i < 201; ++i) levels += "<a>";
  EXPECT_THAT(fault_of(levels), testing::HasSubstr("nested too deep"));
  EXPECT_THAT(fault_of("<?x > <!-- ?><a>" + std::string((1 << 20) + 1, 'x') + "</a>"),
              testing::HasSubstr("a text of"));
}

// The tree of elements, with their attributes.
std::string tree_of(const Element& element) {
  std::string tree = "<" + element.name;
  for (const auto& [name, value] : element.attributes) tree += " " + name + "=" + value;
  tree += ">";
  for (const auto& child : element.children) tree += tree_of(*child);
  return tree + "</>";
}

std::string tree_of(const std::string& text, const TextElement& element) {
  std::string tree = "<" + element.name;
  for (const TextElement::Attribute& each : element.attributes)
    tree += " " + each.name + "=" + text.substr(each.value, each.past - each.value);
  tree += ">";
  for (const TextElement& child : element.children) tree += tree_of(text, child);
  return tree + "</>";
}

// Texts put together at random from what means something to a parser.
TEST(XmlPieces, PlacesAreThoseOfTheParsersElements) {
  const char* const kWords[] = {
      "<a>",   "</a>", "<b>", "</b>",   "<a", "</a",         "<b ", ">",         "/>",
      " x='",  "'",    "\"",  " y=\"",  "=",  "<!--",        "-->", "<![CDATA[", "]]>",
      "<?",    "?>",   "<!",  " ",      "\n", "t",           "<",   "/",         "-",
      "<!-->", "<a/>", "z",   " z='>'", "\v", "<b c=\"<\"/>"};
  std::mt19937 random(7);
  const auto below = [&](size_t many) { return random() % many; };
  int parsed = 0;
  for (int round = 0; round < 200'000; ++round) {
    std::string text = below(4) == 0 ? "<?" : "", inside;
    if (!text.empty()) {
      for (size_t i = below(4); i > 0; --i) text += kWords[below(std::size(kWords))];
      text += "?>";
    }
    for (size_t i = 1 + below(9); i > 0; --i) inside += kWords[below(std::size(kWords))];
    text += "<r>" + inside + "</r>";
    std::unique_ptr<Element> root;
    try {
      root = parse_document(text, "");
    } catch (const InputError&) {
      continue;
    }
    ++parsed;
    ASSERT_EQ(tree_of(text, places_in(text)), tree_of(*root)) << text;
  }
  EXPECT_GT(parsed, 5'000);
}

}  // namespace
}  // namespace ruedo::world
