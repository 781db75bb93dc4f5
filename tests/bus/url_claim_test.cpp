// One server per address: claims, and servers that share an address in spite of them.
#include "bus/url_claim.h"

#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bus/rival_watch.h"
#include "ruedo/errors.h"
#include "ruedo/world_info_t.hpp"

namespace ruedo::bus {
namespace {

// Tests run beside each other, each in a process: an address for each.
const std::string kAddress =
    fmt::format("239.255.{}.{}:21907", getpid() / 256 % 256, getpid() % 256);
const LcmUrl kUrl = parse_url("udpm://" + kAddress);

TEST(UrlClaim, TheSecondServerSeesTheFirst) {
  EXPECT_EQ(claimed_by(kUrl), "");
  UrlClaim first(kUrl, "pid 1, world hall");
  first.describe("pid 1, world hall, run 77");
  try {
    UrlClaim second(kUrl, "pid 2");
    FAIL();
  } catch (const EnvironmentError& error) {
    const std::string text = error.what();
    for (const char* word : {kAddress.c_str(), "pid 1", "hall", "run 77", "--lcm auto"}) {
      EXPECT_NE(text.find(word), std::string::npos) << text;
    }
  }
}

TEST(UrlClaim, AnotherPortAndAnotherSchemeAreFree) {
  UrlClaim first(kUrl, "first");
  LcmUrl other = kUrl;
  ++other.port;
  UrlClaim second(other, "second");
  UrlClaim third(parse_url("tcpq://127.0.0.1:21907"), "third");
  EXPECT_EQ(claimed_by(other), "second");
}

TEST(UrlClaim, VanishesWithItsProcess) {
  const pid_t child = fork();
  if (child == 0) {
    UrlClaim claim(kUrl, "a child");
    _Exit(claimed_by(kUrl) == "a child" ? 0 : 1);  // without a destructor
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(claimed_by(kUrl), "");
  EXPECT_NO_THROW(UrlClaim(kUrl, "the next"));
}

// A bus whose messages come from the test.
class FakeBus : public Bus {
 public:
  Handler handler;
  std::vector<std::string> channels;
  void publish(const std::string&, const uint8_t*, size_t) override {}
  void listen(const std::vector<std::string>& names, Handler to,
              const std::vector<std::string>&) override {
    channels = names, handler = std::move(to);
  }
  bool is_heard(const std::string& channel) const override { return channel == "p3at/lrf"; }
  uint64_t audience() const override { return 7; }
};

std::vector<uint8_t> info_of(int64_t run_id) {
  world_info_t info{};
  info.run_id = run_id;
  info.world = "hall\n2";
  std::vector<uint8_t> bytes(static_cast<size_t>(info.getEncodedSize()));
  info.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

TEST(RivalWatch, NamesEachRivalOnceAndNeverItself) {
  auto made = std::make_unique<FakeBus>();
  FakeBus& fake = *made;
  std::vector<std::string> said, heard;
  RivalWatch watch(std::move(made), [&](const std::string& line) { said.push_back(line); });
  watch.listen({"p3at/velocity"}, [&](const std::string& channel, const uint8_t*, size_t) {
    heard.push_back(channel);
  });
  EXPECT_EQ(fake.channels, (std::vector<std::string>{"p3at/velocity", "ruedo/info"}));
  const std::vector<uint8_t> own = info_of(11), rival = info_of(22);
  watch.publish("ruedo/info", own.data(), own.size());
  for (int i = 0; i < 3; ++i) {
    fake.handler("ruedo/info", own.data(), own.size());
    fake.handler("ruedo/info", rival.data(), rival.size());
  }
  fake.handler("p3at/velocity", rival.data(), 1);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("run 22, world hall 2; this one is run 11"), std::string::npos) << said[0];
  EXPECT_EQ(heard, std::vector<std::string>{"p3at/velocity"});
  // Messages that only look like an info, and a large number of servers.
  fake.handler("ruedo/info", rival.data(), 20);
  fake.handler("ruedo/info", info_of(33).data(), 30);
  for (int64_t id = 100; id < 200; ++id)
    fake.handler("ruedo/info", info_of(id).data(), rival.size());
  EXPECT_EQ(said.size(), 8u);
}

TEST(RivalWatch, ForwardsTheListenersOfItsBus) {
  const RivalWatch watch(std::make_unique<FakeBus>(), [](const std::string&) {});
  EXPECT_TRUE(watch.is_heard("p3at/lrf"));
  EXPECT_FALSE(watch.is_heard("p3at/camera"));
  EXPECT_EQ(watch.audience(), 7u);
}

}  // namespace
}  // namespace ruedo::bus
