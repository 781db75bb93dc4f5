// Routes, the thread, and the work of each tick.
#include "console/console.h"

#include <algorithm>
#include <charconv>
#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include <pthread.h>
#include <spdlog/spdlog.h>

#include "base/json.h"
#include "base/sha256.h"
#include "base/utf8.h"
#include "base/version.h"
#include "console/assets.h"
#include "console/library.h"
#include "console/scene_data.h"
#include "console/types.h"
#include "console/viewer.h"
#include "http/web_server.h"

namespace ruedo::console {
namespace {

constexpr size_t kKeptScenes = 4;  // of a log: those requested last

http::HttpResponse not_found() {
  http::HttpResponse response;
  response.status = 404;
  response.body = http::bytes_of("There is no such page.\n");
  return response;
}

// The number after that prefix, with nothing behind it.
std::optional<size_t> number_after(std::string_view begin, std::string_view path) {
  if (!path.starts_with(begin)) return std::nullopt;
  path.remove_prefix(begin.size());
  size_t number = 0;
  const auto [end, error] = std::from_chars(path.data(), path.data() + path.size(), number);
  if (error != std::errc() || end != path.data() + path.size()) return std::nullopt;
  return number;
}

// Tells world files apart, wherever they lie, without telling a viewer where that is.
std::string key_of(const std::string& file) {
  constexpr size_t kDigits = 16;
  std::error_code error;
  const std::string path = std::filesystem::weakly_canonical(file, error).string();
  if (file.empty() || error) return "";
  return sha256(reinterpret_cast<const uint8_t*>(path.data()), path.size()).substr(0, kDigits);
}

}  // namespace

// A world as the page draws it; parts that are null have not been requested.
struct Scene {
  size_t number = 0;  // a log's scenes are numbered
  uint64_t version = 0;
  std::shared_ptr<const world::WorldModel> world;
  std::unique_ptr<SceneData> looks;
  std::unique_ptr<SceneData> shapes;  // of its collisions
};

struct Console::Impl {
  Stage stage;
  std::shared_ptr<const world::WorldModel> world;  // the running one, or the log's first
  std::deque<Scene> scenes;                        // newest first
  std::unique_ptr<Library> library;                // null: not requested yet
  std::map<size_t, http::Bytes> assets;            // those that were requested
  http::Bytes types;                               // null: not requested yet
  std::unique_ptr<http::WebServer> web;
  std::thread thread;
  std::mutex words_mutex;
  std::string words = "The server has ended.";

  http::HttpResponse get(std::string_view path);
  http::HttpResponse scene_file(std::string_view path, bool shapes);
  static http::HttpResponse file_of(const SceneData& data, std::string_view path);
  http::HttpResponse library_file(std::string_view path);
  http::HttpResponse history(std::string_view path);
  http::HttpResponse model_text(size_t index);
  static http::HttpResponse blob(http::Bytes body, const std::string& type);
  bool tick();
  Scene* scene(size_t number);
};

http::HttpResponse Console::Impl::blob(http::Bytes body, const std::string& type) {
  if (!body) return not_found();
  http::HttpResponse response;
  response.type = type;
  response.body = std::move(body);
  return response;
}

// Null if there is no such world.
Scene* Console::Impl::scene(size_t number) {
  const auto known = std::find_if(scenes.begin(), scenes.end(),
                                  [&](const Scene& each) { return each.number == number; });
  if (known != scenes.end()) return &*known;
  std::shared_ptr<const world::WorldModel> shown = stage.source->world(number);
  if (!shown) return nullptr;
  if (scenes.size() >= kKeptScenes) scenes.pop_back();
  scenes.push_front({number, stage.world_version + number, std::move(shown), nullptr, nullptr});
  return &scenes.front();
}

http::HttpResponse Console::Impl::get(std::string_view path) {
  for (size_t i = 0; i < kAssetCount; ++i) {
    const Asset& asset = kAssets[i];
    if (path != asset.path) continue;
    http::Bytes& body = assets[i];
    if (!body)
      body = std::make_shared<const std::vector<uint8_t>>(asset.data, asset.data + asset.size);
    http::HttpResponse response = blob(body, asset.type);
    response.gzip = true;
    return response;
  }
  constexpr std::string_view kHistory = "/history/";
  if (path.starts_with(kHistory)) return history(path.substr(kHistory.size()));
  if (path == "/types.json") {
    if (!types) types = http::bytes_of(types_json());
    return blob(types, "application/json");
  }
  if (path == "/header") return blob(stage.source->log_header(), "application/octet-stream");
  if (path.starts_with("/library"))
    return library_file(path.substr(std::string_view("/library").size()));
  if (const auto model = number_after("/scene/models/", path)) return model_text(*model);
  for (const std::string_view begin : {"/scene", "/collision"}) {
    if (path.starts_with(begin)) return scene_file(path.substr(begin.size()), begin[1] == 'c');
  }
  return not_found();
}

// "FIELD,FIELD.../CHANNEL": channel names contain slashes.
http::HttpResponse Console::Impl::history(std::string_view path) {
  const size_t slash = path.find('/');
  if (slash == std::string_view::npos) return not_found();
  return blob(stage.source->history(std::string(path.substr(slash + 1)),
                                    std::string(path.substr(0, slash))),
              "application/octet-stream");
}

// A file of a scene; for a log, its number comes first, as in "/3.json".
http::HttpResponse Console::Impl::scene_file(std::string_view path, bool shapes) {
  size_t number = 0;
  if (path.size() > 1 && path[0] == '/' && path[1] >= '0' && path[1] <= '9') {
    const auto [end, error] = std::from_chars(path.data() + 1, path.data() + path.size(), number);
    if (error != std::errc()) return not_found();
    path.remove_prefix(static_cast<size_t>(end - path.data()));
  }
  Scene* shown = scene(number);
  if (!shown) return not_found();
  std::unique_ptr<SceneData>& data = shapes ? shown->shapes : shown->looks;
  if (!data) {
    const auto version = static_cast<int>(shown->version);
    data = shapes ? std::make_unique<SceneData>(collision_shapes(*shown->world), version)
                  : std::make_unique<SceneData>(*shown->world, version);
  }
  return file_of(*data, path);
}

// ".json", "/meshes", "/links", "/textures/NUMBER".
http::HttpResponse Console::Impl::file_of(const SceneData& data, std::string_view path) {
  if (path == ".json") return blob(data.json, "application/json");
  if (path == "/meshes") return blob(data.meshes, "application/octet-stream");
  if (path == "/links") return blob(data.links, "application/octet-stream");
  const auto picture = number_after("/textures/", path);
  if (!picture || *picture >= data.pictures.size()) return not_found();
  return blob(data.pictures[*picture].bytes, data.pictures[*picture].type);
}

// The text with which SPAWN would create that model; "" if it has no text or was removed.
http::HttpResponse Console::Impl::model_text(size_t index) {
  if (!world || index >= world->models.size()) return not_found();
  const world::ModelInstance& model = world->models[index];
  const std::string text = model.removed ? "" : stage.source->model_text(model.name);
  return blob(http::bytes_of(text), "text/plain; charset=utf-8");
}

// "/library.json", and for each of its models "/library/NUMBER/scene" with the files of a scene.
http::HttpResponse Console::Impl::library_file(std::string_view path) {
  if (!world || stage.is_log) return not_found();
  if (!library) library = std::make_unique<Library>(world->file);
  if (path == ".json") return blob(http::bytes_of(library->list()), "application/json");
  const size_t end = path.find("/scene");
  const auto index = number_after("/", path.substr(0, end));
  const SceneData* data = index ? library->scene(*index) : nullptr;
  if (!data || end == std::string_view::npos) return not_found();
  return file_of(*data, path.substr(end + std::string_view("/scene").size()));
}

bool Console::Impl::tick() {
  const uint64_t before = stage.board.newest();
  stage.source->pump(stage.board, !stage.viewers.empty());
  for (Viewer* viewer : stage.viewers) viewer->pump();
  if (auto now = stage.source->world(0); now != world) {
    world = std::move(now);
    scenes.clear();
    ++stage.world_version;
  }
  return !stage.viewers.empty() || before != stage.board.newest();
}

Console::Console(const http::Address& address, std::unique_ptr<Source> source,
                 const std::string& mode, const std::string& title)
    : impl_(std::make_unique<Impl>()) {
  Impl& impl = *impl_;
  impl.stage.source = std::move(source);
  impl.world = impl.stage.source->world(0);
  impl.stage.is_log = mode == "log";
  JsonWriter json;
  json.open('{')
      .name("hello")
      .open('{')
      .member("mode", mode)
      .member("title", printable(title))
      .member("version", version());
  json.member("world", impl.world ? key_of(impl.world->file) : "")
      .member("info", impl.stage.source->info_channel())
      .member("fault", printable(impl.stage.source->fault()))
      .member("save", printable(impl.stage.source->save_name()))
      .member("compared", printable(impl.stage.source->compared()))
      .close('}')
      .close('}');
  impl.stage.greeting = json.text();
  const std::string token = address.loopback() ? "" : http::make_token();
  http::WebHandler handler;
  handler.get = [&impl](std::string_view path) { return impl.get(path); };
  handler.tick = [&impl] { return impl.tick(); };
  handler.end = [&impl] {
    const std::lock_guard lock(impl.words_mutex);
    JsonWriter ended;
    ended.open('{').member("ended", impl.words).close('}');
    impl.stage.farewell = ended.text();
  };
  handler.open = [&impl] { return std::make_unique<Viewer>(impl.stage); };
  impl.web = std::make_unique<http::WebServer>(
      http::WebPlace{
          .address = address, .token = token, .origins = {}, .most_sockets = kMostViewers},
      std::move(handler));
  for (const std::string& host : http::reachable_hosts(address)) {
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
  impl_->web.reset();  // its viewers first, then the stage
}

}  // namespace ruedo::console
