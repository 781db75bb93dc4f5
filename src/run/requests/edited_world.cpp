// A file is written beside the old one and renamed once it is on the disk.
#include "run/requests/edited_world.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "base/input_file.h"
#include "base/xml.h"
#include "ruedo/errors.h"
#include "system/file_handle.h"
#include "world/document/document.h"

namespace fs = std::filesystem;

namespace ruedo::run {
namespace {

constexpr size_t kLargest = 64u << 20;  // bytes; that is all that is ever loaded

// The bytes of a file; none where it cannot be read.
std::optional<std::string> bytes_of(const std::string& path) {
  try {
    return read_input(path, kLargest);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

// Whatever it is, a link that leads nowhere too.
bool is_there(const std::string& path) {
  struct stat info{};
  return ::lstat(path.c_str(), &info) == 0 || errno != ENOENT;
}

// Returns the error, or "". The old file stays intact until the new one is complete.
std::string write_file(const std::string& path, const std::string& bytes) {
  const fs::path folder = fs::path(path).parent_path();
  const std::string part =
      (folder / ("." + fs::path(path).filename().string() + "." + std::to_string(::getpid())))
          .string();
  ::unlink(part.c_str());  // of a process of that number that was killed
  const FileHandle file(::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!file) return std::strerror(errno);
  struct stat old{};
  bool good = write_all(file.get(), bytes.data(), bytes.size()) == bytes.size() &&
              (::stat(path.c_str(), &old) != 0 || ::fchmod(file.get(), old.st_mode & 07777) == 0) &&
              ::fsync(file.get()) == 0;
  std::string fault = good ? "" : std::strerror(errno);
  if (good && ::rename(part.c_str(), path.c_str()) != 0) {
    fault = std::strerror(errno);
    good = false;
  }
  if (!good) {
    ::unlink(part.c_str());
    return fault;
  }
  if (const FileHandle opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)); opened)
    ::fsync(opened.get());
  return "";
}

// "lab_2.sdf" of "lab.sdf", or the next number that is free.
std::string unused_copy(const std::string& file) {
  const fs::path path(file);
  for (int number = 2;; ++number) {
    const fs::path copy = path.parent_path() / (path.stem().string() + "_" +
                                                std::to_string(number) + path.extension().string());
    if (!is_there(copy.string())) return copy.string();
  }
}

// Follows symbolic links: writes the file that they lead to.
std::string full(const std::string& file) {
  if (file.empty()) return "";
  std::error_code error;
  const fs::path path = fs::weakly_canonical(fs::absolute(file), error);
  return error ? fs::absolute(file).string() : path.string();
}

std::string out_of_reach(const world::Moved& moved) {
  std::string folders, path;
  for (const std::string& folder : moved.out_of_reach) {
    folders += (folders.empty() ? "" : ", ") + folder;
    path += (path.empty() ? "" : ":") + folder;
  }
  return "there it does not find the files in " + folders +
         "; save it in the first world's folder, or one beside or in that, or set RUEDO_PATH=" +
         path + " here and wherever it is opened";
}

}  // namespace

EditedWorld::EditedWorld(const world::WorldModel& first, std::string file)
    : first_(first), file_(full(file)) {
  try {
    source_ = world::world_text_of(first);
  } catch (const InputError& error) {
    fault_ = error.what();
  }
  if (!saves()) return;
  known_ = bytes_of(file_);
  if (!fault_.empty()) return;
  const auto moved = world::moved_to(source_, first_.file, file_);  // before anything is edited
  if (!moved.out_of_reach.empty())
    throw InputError({}, "a world saved as " + file_ + ": " + out_of_reach(moved));
}

void EditedWorld::begin(std::set<std::string> put) {
  const std::lock_guard lock(mutex_);
  spawned_.clear();
  put_ = std::move(put);
}

std::set<std::string> EditedWorld::put() const {
  const std::lock_guard lock(mutex_);
  return put_;
}

void EditedWorld::spawned(const std::string& name, const spawn_request_t& body) {
  const bool named = !body.model.empty();
  const bool path = body.model.find("://") != std::string::npos ||
                    fs::path(body.model).has_extension() || fs::path(body.model).is_absolute();
  const std::lock_guard lock(mutex_);
  put_.insert(name);
  spawned_[name] = named
                       ? "<?xml version=\"1.0\"?>\n<sdf version=\"1.9\">\n<include>\n      <uri>" +
                             xml_escaped((path ? "" : "model://") + body.model) +
                             "</uri>\n    </include>\n</sdf>\n"
                       : body.text;
}

void EditedWorld::put(const std::string& name) {
  const std::lock_guard lock(mutex_);
  put_.insert(name);
}

void EditedWorld::removed(const std::string& name) {
  const std::lock_guard lock(mutex_);
  spawned_.erase(name);
  put_.erase(name);
}

const world::WorldText& EditedWorld::text() const {
  if (!fault_.empty()) throw InputError({}, fault_);
  if (!text_) text_ = std::make_unique<world::WorldText>(source_, first_);
  return *text_;
}

std::string EditedWorld::model_text(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  if (const auto at = spawned_.find(name); at != spawned_.end()) return at->second;
  try {
    return text().model_text(name);
  } catch (const InputError&) {
    return "";
  }
}

// "" or why what is on the disk must not be lost.
std::string EditedWorld::overwritten() const {
  if (known_ ? bytes_of(file_) == known_ : !is_there(file_)) return "";
  return known_ ? file_ +
                      " was changed, or removed, by another program since: keep that, and save "
                      "a copy of this world, or overwrite it"
                : file_ + " exists by now: another program made it";
}

EditedWorld::Saved EditedWorld::save(const world::WorldModel& now,
                                     const std::function<Pose(size_t)>& X_WM, How how) {
  const std::lock_guard lock(mutex_);
  if (const std::string fault = how == How::kept ? overwritten() : ""; !fault.empty())
    return {fault, "", ""};
  const std::string file = how == How::copied ? unused_copy(file_) : file_;
  std::vector<world::ModelNow> models;
  for (size_t i = 0; i < now.models.size(); ++i) {
    if (now.models[i].removed) continue;
    const std::string& name = now.models[i].name;
    const auto spawned = spawned_.find(name);
    const Pose X = now.models[i].model->path ? now.models[i].X_WM : X_WM(i);  // it goes from there
    models.push_back(
        {name, X, spawned == spawned_.end() ? "" : spawned->second, put_.contains(name)});
  }
  try {
    world::WorldText::Written written = text().with(models);
    const world::Moved moved = world::moved_to(written.text, first_.file, file_);
    written.text = moved.text;
    if (!moved.out_of_reach.empty()) written.left_out.push_back(out_of_reach(moved));
    world::parse_document(written.text, file);
    if (std::string fault = write_file(file, written.text); !fault.empty())
      return {file + " cannot be written: " + fault, "", ""};
    if (how != How::copied) known_ = std::move(written.text);
    std::string note;
    for (const std::string& sentence : written.left_out)
      note += (note.empty() ? "" : "; ") + sentence;
    return {"", note, how == How::copied ? fs::path(file).filename().string() : ""};
  } catch (const InputError& error) {
    return {error.what(), "", ""};
  }
}

}  // namespace ruedo::run
