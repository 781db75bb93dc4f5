// Routes, the thread, and what is looked at once a tick.
#include "console/console.h"

#include <atomic>
#include <charconv>
#include <chrono>
#include <mutex>
#include <thread>

#include <pthread.h>
#include <spdlog/spdlog.h>

#include "console/assets.h"
#include "console/scene_data.h"
#include "console/viewer.h"
#include "console/web_server.h"
#include "core/json.h"
#include "core/utf8.h"
#include "core/version.h"

namespace ruedo::console {
namespace {

constexpr auto kPlaybackPeriod = std::chrono::milliseconds(100);

Bytes bytes_of(std::string_view text) {
  return std::make_shared<const std::vector<uint8_t>>(text.begin(), text.end());
}

HttpResponse not_found() {
  HttpResponse response;
  response.status = 404;
  response.body = bytes_of("There is no such page.\n");
  return response;
}

}  // namespace

struct Console::Impl {
  Stage stage;
  std::shared_ptr<const model::WorldModel> world;
  std::unique_ptr<SceneData> scene;  // of that world; null: not made yet
  Playback told;                     // to the viewers
  std::chrono::steady_clock::time_point told_at;
  std::unique_ptr<WebServer> web;
  std::thread thread;
  std::mutex words_mutex;
  std::string words = "The server has ended.";

  HttpResponse get(std::string_view path);
  HttpResponse blob(Bytes body, const std::string& type);
  bool tick();
  const SceneData* current_scene();
};

HttpResponse Console::Impl::blob(Bytes body, const std::string& type) {
  if (!body) return not_found();
  HttpResponse response;
  response.type = type;
  response.body = std::move(body);
  return response;
}

const SceneData* Console::Impl::current_scene() {
  if (!world) return nullptr;
  if (!scene) scene = std::make_unique<SceneData>(*world, static_cast<int>(stage.world_version));
  return scene.get();
}

HttpResponse Console::Impl::get(std::string_view path) {
  for (size_t i = 0; i < kAssetCount; ++i) {
    const Asset& asset = kAssets[i];
    if (path != asset.path) continue;
    HttpResponse response =
        blob(std::make_shared<const std::vector<uint8_t>>(asset.data, asset.data + asset.size),
             asset.type);
    response.gzip = true;
    return response;
  }
  if (!path.starts_with("/scene")) return not_found();
  const SceneData* data = current_scene();
  if (!data) return not_found();
  if (path == "/scene.json") return blob(bytes_of(data->json), "application/json");
  if (path == "/scene/meshes") return blob(data->meshes, "application/octet-stream");
  if (path == "/scene/links") return blob(data->links, "application/octet-stream");
  constexpr std::string_view kTextures = "/scene/textures/";
  if (!path.starts_with(kTextures)) return not_found();
  const std::string_view number = path.substr(kTextures.size());
  size_t index = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), index);
  if (error != std::errc() || end != number.data() + number.size() ||
      index >= data->pictures.size())
    return not_found();
  return blob(data->pictures[index].bytes, data->pictures[index].type);
}

bool Console::Impl::tick() {
  const uint64_t before = stage.board.newest();
  stage.source->pump(stage.board, stage.viewers > 0);
  if (auto now = stage.source->world(); now != world) {
    world = std::move(now);
    scene.reset();
    ++stage.world_version;
  }
  if (const Playback* playback = stage.source->playback(); playback && *playback != told) {
    // A time that goes on is told now and then, and everything else at once.
    const auto now = std::chrono::steady_clock::now();
    Playback but_for_time = *playback;
    but_for_time.now_s = told.now_s;
    if (but_for_time != told || now - told_at >= kPlaybackPeriod) {
      told = *playback;
      told_at = now;
      ++stage.playback_version;
    }
  }
  return stage.viewers > 0 || before != stage.board.newest();
}

Console::Console(const Address& address, std::unique_ptr<Source> source, const std::string& mode,
                 const std::string& title)
    : impl_(std::make_unique<Impl>()) {
  Impl& impl = *impl_;
  impl.stage.source = std::move(source);
  impl.world = impl.stage.source->world();
  JsonWriter json;
  json.open('{')
      .name("hello")
      .open('{')
      .member("mode", mode)
      .member("title", printable(title))
      .member("version", version());
  json.member("info", impl.stage.source->info_channel())
      .member("fault", printable(impl.stage.source->fault()))
      .close('}')
      .close('}');
  impl.stage.greeting = json.text();
  const std::string token = address.loopback() ? "" : make_token();
  WebHandler handler;
  handler.get = [&impl](std::string_view path) { return impl.get(path); };
  handler.tick = [&impl] { return impl.tick(); };
  handler.end = [&impl] {
    const std::lock_guard lock(impl.words_mutex);
    JsonWriter ended;
    ended.open('{').member("ended", impl.words).close('}');
    impl.stage.farewell = ended.text();
  };
  handler.open = [&impl]() -> std::unique_ptr<Connection> {
    if (impl.stage.viewers >= kMostViewers) return nullptr;
    return std::make_unique<Viewer>(impl.stage);
  };
  impl.web = std::make_unique<WebServer>(
      WebPlace{.address = address, .token = token, .origins = {}}, std::move(handler));
  for (const std::string& host : reachable_hosts(address)) {
    urls_.push_back("http://" + host + ":" + std::to_string(impl.web->port()) + "/" +
                    (token.empty() ? "" : "?token=" + token));
  }
  impl.thread = std::thread([&impl] {
    pthread_setname_np(pthread_self(), "console");
    try {
      impl.web->run();
    } catch (const std::exception& error) {
      spdlog::error("the console has ended: {}", error.what());
    }
  });
}

void Console::end(const std::string& words) {
  const std::lock_guard lock(impl_->words_mutex);
  impl_->words = words;
}

Console::~Console() {
  impl_->web->stop();
  impl_->thread.join();
  impl_->web.reset();  // its viewers, before the stage
}

}  // namespace ruedo::console
