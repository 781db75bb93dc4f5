#include "bridges/ros2/services/model_checks.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include <pthread.h>

#include "ruedo/errors.h"
#include "run/requests/model_worker.h"
#include "world/load_model.h"

namespace ruedo::ros2 {
namespace {

// The name of the first element, "" without one.
std::string root_of(const std::string& text) {
  for (size_t at = text.find('<'); at != text.npos; at = text.find('<', at + 1)) {
    if (text.compare(at, 4, "<!--") == 0) at = text.find("-->", at);
    if (at == text.npos) break;
    const char next = at + 1 < text.size() ? text[at + 1] : '\0';
    if (next == '?' || next == '!' || next == '-') continue;
    return text.substr(at + 1, text.find_first_of(" \t\r\n/>", at) - at - 1);
  }
  return "";
}

bool is_one_of(const std::string& word, std::initializer_list<const char*> known) {
  return std::find(known.begin(), known.end(), word) != known.end();
}

// SDF, URDF and xacro; whether they are well-formed is seen when they are read.
bool is_known_format(const std::string& file, const std::string& text) {
  if (file.empty()) return is_one_of(root_of(text), {"sdf", "gazebo", "robot", "model", "world"});
  const std::string extension = std::filesystem::path(file).extension().string();
  return is_one_of(extension, {"", ".sdf", ".urdf", ".xacro", ".xml", ".world", ".model"});
}

// The files that a model lacks, or cannot use.
Result result_of(const world::LoadedModel& loaded) {
  const auto has = [](const Finding& finding, const char* words) {
    return finding.text.find(words) != std::string::npos;
  };
  for (const Finding& finding : loaded.findings) {
    if (finding.kind != Finding::Kind::error) continue;
    const bool missing = has(finding, "is not found");
    if (missing || has(finding, "the mesh '") || has(finding, "the heightmap '"))
      return {missing ? kMissingAssets : kUnsupportedAssets,
              finding.source.str() + ": " + finding.text};
  }
  return {};
}

}  // namespace

ModelChecks::~ModelChecks() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    if (budget_) budget_->leave_off();
  }
  changed_.notify_all();
  thread_.join();
}

void ModelChecks::add(std::string uri, std::string text, std::string world_file, Then then) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() < kMostWaiting) {
      waiting_.push_back({std::move(uri), std::move(text), std::move(world_file), std::move(then)});
      if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
      changed_.notify_all();
      return;
    }
  }
  then({kFailed, "too many models are being read: ask again"}, "");
}

void ModelChecks::work() {
  pthread_setname_np(pthread_self(), "model checks");
  for (;;) {
    Order order;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return over_ || !waiting_.empty(); });
      if (over_) return;
      order = std::move(waiting_.front());
      waiting_.pop_front();
      budget_ = std::make_shared<world::LoadBudget>(run::ModelWorker::kTime,
                                                    run::ModelWorker::kMeshBytes);
    }
    Result result;
    std::string name, file;
    try {
      if (!order.uri.empty()) file = world::model_file(order.uri, order.world_file);
      result = {kParseError, ""};
      if (is_known_format(file, order.text)) {
        const world::LoadedModel loaded =
            file.empty() ? world::load_model_text(order.text, order.world_file, budget_.get())
                         : world::load_model(order.uri, order.world_file, budget_.get());
        name = loaded.name;
        result = result_of(loaded);
      } else {
        result = {kUnsupportedFormat, "the model is neither SDF nor URDF"};
      }
    } catch (const std::exception& error) {
      result = {result.code == kParseError ? kParseError : kNotFound, error.what()};
    }
    if (!budget_->fault().empty())
      result = {kFailed, "the model costs too much to be made ready: " + budget_->fault()};
    {
      const std::lock_guard lock(mutex_);
      budget_.reset();
      if (over_) return;
    }
    order.then(result, name);
  }
}

}  // namespace ruedo::ros2
