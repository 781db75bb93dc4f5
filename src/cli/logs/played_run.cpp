#include "cli/logs/played_run.h"

#include <filesystem>
#include <random>

#include "base/channel_names.h"
#include "cli/logs/logged_run.h"
#include "engine/outcome.h"
#include "log/index.h"
#include "ruedo/decode.h"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

int64_t random_id() {
  std::random_device device;
  return static_cast<int64_t>(static_cast<uint64_t>(device()) << 31 | device()) | 1;
}

}  // namespace

PlayedRun::PlayedRun(const std::string& path, bus::LcmBus& bus) : bus_(bus), run_id_(random_id()) {
  if (std::filesystem::is_regular_file(path)) make_worlds(path);
  if (!worlds_) {
    bus_.keep_connected();
    return;
  }
  bus_.listen({kRequestChannel},
              [this](const std::string&, const uint8_t* data, size_t size) {
                request_t request;
                if (decode_checked(data, size, request) == DecodeFault::none &&
                    request.kind == request_t::INFO)
                  asked_ = true;
              },
              {kInfoChannel, kReplyChannel});
}

PlayedRun::~PlayedRun() { bus_.stop(); }

// Of a run of Ruedo's; any other log of LCM is played as it is.
void PlayedRun::make_worlds(const std::string& path) {
  const log::Index index(path, log::Index::Keeps::changes);
  if (!index.header()) return;
  worlds_ = std::make_unique<run::LogWorlds>(
      index, [&](const log_header_t& header) { return load_run(header, path); });
  if (!worlds_->fault().empty()) to_stderr("ruedo: {}: {}\n", path, worlds_->fault());
}

void PlayedRun::serve(SimTime time_us) {
  if (!worlds_) return;
  const auto now = std::chrono::steady_clock::now();
  const size_t scene = worlds_->number(time_us);
  if (!asked_.exchange(false) && scene == scene_ && now < next_) return;
  scene_ = scene;
  next_ = now + std::chrono::seconds(1);
  publish(worlds_->scenes()[scene].info, time_us);
}

void PlayedRun::publish(const std::vector<std::vector<uint8_t>>& parts, SimTime time_us) {
  for (const std::vector<uint8_t>& part : parts) {
    world_info_t info;
    if (decode_checked(part.data(), part.size(), info) != DecodeFault::none) continue;
    info.utime = time_us;
    info.run_id = run_id_;
    const std::vector<uint8_t> message = engine::encoded(info);
    bus_.publish(kInfoChannel, message.data(), message.size());
  }
}

void PlayedRun::end() {
  if (!worlds_) return;
  reply_t last{};
  last.run_id = run_id_;
  last.code = reply_t::ENDED;
  last.text = "the played log has ended";
  const std::vector<uint8_t> message = engine::encoded(last);
  bus_.publish(kReplyChannel, message.data(), message.size());
  bus_.flush();
}

}  // namespace ruedo::cli
