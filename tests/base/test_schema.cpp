// The schemas against what lcm-gen makes of the same files, and against malformed bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include "base/big_endian.h"
#include "base/type_files.h"
#include "ruedo/camera_info_t.hpp"
#include "ruedo/contact_t.hpp"
#include "ruedo/errors.h"
#include "ruedo/image_t.hpp"
#include "ruedo/joint_state_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/pose_t.hpp"
#include "ruedo/reply_t.hpp"
#include "ruedo/schema.h"
#include "ruedo/sonar_t.hpp"
#include "ruedo/tick_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "ruedo/world_state_t.hpp"

namespace fs = std::filesystem;

namespace ruedo {
namespace {

template <class Message>
std::vector<uint8_t> encode(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

template <class Message>
void expect_lcmgens_fingerprint() {
  const Schema* schema = find_schema(Message::getTypeName());
  ASSERT_NE(schema, nullptr) << Message::getTypeName();
  EXPECT_EQ(schema->fingerprint, Message::getHash()) << schema->name;
  EXPECT_EQ(find_schema(Message::getHash()), schema);
}

TEST(Schema, FingerprintsAreLcmGens) {
  expect_lcmgens_fingerprint<camera_info_t>();
  expect_lcmgens_fingerprint<contact_t>();
  expect_lcmgens_fingerprint<image_t>();
  expect_lcmgens_fingerprint<joint_state_t>();
  expect_lcmgens_fingerprint<move_command_t>();
  expect_lcmgens_fingerprint<planar_lidar_t>();
  expect_lcmgens_fingerprint<pose_t>();
  expect_lcmgens_fingerprint<reply_t>();
  expect_lcmgens_fingerprint<sonar_t>();
  expect_lcmgens_fingerprint<tick_t>();
  expect_lcmgens_fingerprint<world_info_t>();
  expect_lcmgens_fingerprint<world_state_t>();
}

TEST(Schema, BotCoresFingerprints) {
  EXPECT_EQ(static_cast<uint64_t>(find_schema("planar_lidar_t")->fingerprint),
            0xe3d17423180b5e8dULL);
  EXPECT_EQ(static_cast<uint64_t>(find_schema("pose_t")->fingerprint), 0x2e16efb052b0105eULL);
  EXPECT_EQ(static_cast<uint64_t>(find_schema("image_t")->fingerprint), 0x14739ffe13d5f5f0ULL);
  EXPECT_EQ(static_cast<uint64_t>(find_schema("image_metadata_t")->fingerprint),
            0x9a4b634d0577fb8eULL);
}

contact_t two_contacts() {
  contact_t message;
  message.utime = 1234567;
  message.pressed = true;
  message.n = 2;
  message.points.resize(2);
  message.points[0].body = "box/link";
  message.points[1].body = "";
  message.points[1].position[2] = -0.5;
  message.points[1].depth = 0.25;
  return message;
}

TEST(Schema, VisitsEveryValueByName) {
  const auto bytes = encode(two_contacts());
  std::map<std::string, std::string> values;
  std::vector<std::string> order;
  ASSERT_TRUE(visit_message(*find_schema("contact_t"), bytes,
                            [&](const FieldPath& path, const FieldValue& value) {
                              values[path.str()] = to_string(value);
                              order.push_back(path.pattern());
                              return true;
                            }));
  EXPECT_EQ(values.size(), 3u + 2u * 9u);
  EXPECT_EQ(values["utime"], "1234567");
  EXPECT_EQ(values["pressed"], "true");
  EXPECT_EQ(values["points[0].body"], "\"box/link\"");
  EXPECT_EQ(values["points[1].body"], "\"\"");
  EXPECT_EQ(values["points[1].position[2]"], "-0.5");
  EXPECT_EQ(values["points[1].depth"], "0.25");
  EXPECT_EQ(order.front(), "utime");
  EXPECT_EQ(order.back(), "points.depth");
}

TEST(Schema, AVisitorMayEndEarly) {
  const auto bytes = encode(two_contacts());
  int calls = 0;
  EXPECT_TRUE(visit_message(*find_schema("contact_t"), bytes,
                            [&](const FieldPath&, const FieldValue&) { return ++calls < 4; }));
  EXPECT_EQ(calls, 4);
}

TEST(Schema, RefusesAnythingButOneWholeMessage) {
  const Schema& schema = *find_schema("contact_t");
  const auto good = encode(two_contacts());
  ASSERT_TRUE(well_formed(schema, good));
  for (size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(well_formed(schema, std::span(good).first(size))) << size;
  }
  auto longer = good;
  longer.push_back(0);
  EXPECT_FALSE(well_formed(schema, longer));
  auto other = good;
  other[3] ^= 1;
  EXPECT_FALSE(well_formed(schema, other)) << "another fingerprint";
  // n is at 8 (fingerprint) + 8 (utime) + 1 (pressed).
  for (const uint8_t top : {0x7f, 0x80, 0xff}) {
    auto lying = good;
    lying[17] = top;
    EXPECT_FALSE(well_formed(schema, lying)) << "length with the top byte " << int{top};
  }
  auto unterminated = good;
  unterminated[21 + 4 + 8] = 'x';
  EXPECT_FALSE(well_formed(schema, unterminated));
  auto cut = good;
  cut[21 + 4 + 2] = 0;
  EXPECT_FALSE(well_formed(schema, cut)) << "a zero within a string";
}

// Every single-byte change must be handled (the sanitizers watch), and the two walks must agree.
TEST(Schema, SurvivesEveryByteChange) {
  const Schema& schema = *find_schema("contact_t");
  const auto good = encode(two_contacts());
  for (size_t at = 0; at < good.size(); ++at) {
    for (const uint8_t value : {0x00, 0x01, 0x7f, 0x80, 0xff}) {
      auto bytes = good;
      bytes[at] = value;
      const bool visited =
          visit_message(schema, bytes, [](const FieldPath&, const FieldValue&) { return true; });
      EXPECT_EQ(visited, well_formed(schema, bytes)) << at;
    }
  }
}

// However many rows of nothing there are, they are not counted one by one: these would take hours.
TEST(Schema, EmptyRowsTakeNoTime) {
  const fs::path file = fs::path(testing::TempDir()) / "rows_t.lcm";
  std::ofstream(file) << "struct rows_t { int32_t a; int32_t b; int32_t c; double value[a][b][c];"
                         " int8_t last; byte room[16000000]; }";
  read_types({file});
  ASSERT_EQ(read_schemas().size(), 1u);
  const Schema& schema = read_schemas()[0];
  std::vector<uint8_t> bytes(8 + 3 * 4 + 1 + 16'000'000);
  write_big_endian(bytes.data(), schema.fingerprint);
  for (const int at : {8, 12}) write_big_endian(bytes.data() + at, int32_t{1'000'000});
  bytes[20] = 42;
  EXPECT_TRUE(well_formed(schema, bytes));
  size_t values = 0;
  EXPECT_TRUE(visit_message(schema, bytes, [&](const FieldPath& path, const FieldValue& value) {
    EXPECT_EQ(path.pattern(), std::vector<std::string>({"a", "b", "c", "last", "room"})[values]);
    EXPECT_TRUE(values != 3 || to_string(value) == "42");
    return ++values < 5;
  }));
  EXPECT_EQ(values, 5u);
}

// Those that hold much for few bytes, for which each reader would have to look far.
TEST(Schema, AMessageHasFewFieldsForItsBytes) {
  std::string text = "struct hollow_t { int32_t n;";
  for (int i = 0; i < 1000; ++i) text += " int8_t a" + std::to_string(i) + "[n];";
  const fs::path file = fs::path(testing::TempDir()) / "hollow_t.lcm";
  std::ofstream(file) << text + " }\nstruct hollows_t { int32_t m; hollow_t each[m]; }";
  read_types({file});
  const auto schema = std::find_if(read_schemas().begin(), read_schemas().end(),
                                   [](const Schema& each) { return each.name == "hollows_t"; });
  const auto message = [&](int32_t count) {
    std::vector<uint8_t> bytes(8 + 4 + static_cast<size_t>(count) * 4);
    write_big_endian(bytes.data(), schema->fingerprint);
    write_big_endian(bytes.data() + 8, count);
    return bytes;
  };
  // 2 + 1001 n fields, of which 10 000 + 16 (12 + 4 n) are allowed
  const auto all = [](const FieldPath&, const FieldValue&) { return true; };
  EXPECT_TRUE(well_formed(*schema, message(10)));
  EXPECT_TRUE(visit_message(*schema, message(10), all));
  EXPECT_FALSE(well_formed(*schema, message(11)));
  EXPECT_FALSE(visit_message(*schema, message(11), all));
}

// One clear error, with the place.
TEST(Schema, RefusesTypesThatNoReaderReadsAlike) {
  const fs::path file = fs::path(testing::TempDir()) / "bad_t.lcm";
  const std::string no_counter =
      " is not a field before it that is one int8_t, int16_t, int32_t or int64_t";
  std::string dimensions = "struct a_t {\n int8_t x";
  for (int i = 0; i < 17; ++i) dimensions += "[1]";
  using namespace std::string_literals;
  const std::pair<std::string, std::string> cases[] = {
      {"struct a_t {\n int64_t k[2];\n byte x[k]; }", ":3: the length 'k' of 'x'" + no_counter},
      {"struct a_t {\n double k;\n byte x[k]; }", ":3: the length 'k' of 'x'" + no_counter},
      {"struct a_t {\n string k;\n byte x[k]; }", ":3: the length 'k' of 'x'" + no_counter},
      {"struct a_t {\n boolean k;\n byte x[k]; }", ":3: the length 'k' of 'x'" + no_counter},
      {"struct a_t {\n a_t k;\n byte x[k]; }", ":3: the length 'k' of 'x'" + no_counter},
      {dimensions + "; }", ":2: 'x' has more than 16 dimensions"},
      {"\nstruct a_t { b_t x; }",
       ":2: the type 'a_t': 'x' is of the type 'b_t', which is in no .lcm file that was read"},
      {"\nstruct a_t { int32_t n; a_t x[n]; }",
       ":2: the type 'a_t': it holds itself, which cannot be read"},
      {"struct a_t { int8_t x\0; }"s, ": contains a zero byte: it is not a text"}};
  for (const auto& [text, why] : cases) {
    std::ofstream(file, std::ios::binary) << text;
    try {
      read_types({file});
      ADD_FAILURE() << text;
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(), file.string() + why) << text;
    }
  }
}

}  // namespace
}  // namespace ruedo
