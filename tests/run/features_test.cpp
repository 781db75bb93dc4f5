// The bitmap in ruedo/info against what the server answers: a request kind is served exactly if its
// bit is set.
#include <filesystem>

#include "control_client.h"
#include "ruedo/grant_request_t.hpp"

namespace ruedo::run {
namespace {

class Features : public testing::Test, protected Controlled {
 protected:
  // Requests with an empty body: a served kind reports an error in it, or is executed.
  void expect_truth(const RunOptions& options) {
    begin(options, robot_sdf("r", 0, 0));
    if (options.lockstep.clients > 0) {  // step 0 waits for its client
      grant_request_t taking_part;
      taking_part.granted = taking_part.step_until = taking_part.received = -1;
      taking_part.ncommands = 0;
      EXPECT_EQ(ask(request_t::GRANT, engine::encoded(taking_part)).code, reply_t::OK);
    }
    const int64_t features = info().features;
    EXPECT_TRUE(features >> request_t::LEAVE & 1);
    EXPECT_TRUE(features >> request_t::QUIT & 1);
    for (int32_t kind = 0; kind < 63; ++kind) {
      if (kind == request_t::JOIN || kind == request_t::LEAVE || kind == request_t::QUIT)
        continue;  // they change the session
      const reply_t reply = ask(kind);
      EXPECT_EQ(reply.code != reply_t::NOT_SUPPORTED, (features >> kind & 1) != 0)
          << "kind " << kind << ": " << reply.text;
    }
    served_ = features;
    end();
  }

  int64_t served_ = 0;
};

TEST_F(Features, OfAPlainServer) {
  expect_truth(paused_server());
  EXPECT_TRUE(served_ >> request_t::SPAWN & 1);
  EXPECT_FALSE(served_ >> request_t::GRANT & 1);
  EXPECT_FALSE(served_ >> request_t::SNAPSHOT & 1);
}

TEST_F(Features, OfLockstep) {
  RunOptions options;
  options.lockstep.clients = 1;
  expect_truth(options);
  EXPECT_TRUE(served_ >> request_t::GRANT & 1);
  EXPECT_TRUE(served_ >> request_t::RESEND & 1);
}

TEST_F(Features, WithSnapshots) {
  RunOptions options = paused_server();
  options.snapshots =
      std::filesystem::temp_directory_path().string();  // nothing is saved: the name is missing
  expect_truth(options);
  EXPECT_TRUE(served_ >> request_t::SNAPSHOT & 1);
  EXPECT_TRUE(served_ >> request_t::RESTORE & 1);
}

}  // namespace
}  // namespace ruedo::run
