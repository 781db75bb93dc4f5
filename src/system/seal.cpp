// The key is written into a file of its own and then linked to its name: two processes that make
// one at the same time have the same key in the end.
#include "system/seal.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <openssl/crypto.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/input_file.h"
#include "base/sha256.h"
#include "ruedo/errors.h"
#include "system/file_handle.h"

namespace ruedo {
namespace {

namespace fs = std::filesystem;

using Key = std::array<uint8_t, 32>;

// "": the user has no home.
fs::path folder_of_key() {
  const char* const state = std::getenv("XDG_STATE_HOME");
  if (state && *state == '/') return fs::path(state) / "ruedo";
  const char* const home = std::getenv("HOME");
  return home && *home == '/' ? fs::path(home) / ".local/state/ruedo" : fs::path();
}

std::optional<Key> read_key(const fs::path& path) {
  try {
    const InputFile input = open_input(path.string());
    struct stat status{};
    Key key{};
    const bool own = ::fstat(::fileno(input.file.get()), &status) == 0 &&
                     status.st_uid == ::geteuid() && (status.st_mode & 077) == 0 &&
                     input.size == static_cast<int64_t>(key.size());
    const bool whole = own && std::fread(key.data(), 1, key.size(), input.file.get()) == key.size();
    return whole ? std::optional(key) : std::nullopt;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void make_key(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  Key key{};
  if (::getrandom(key.data(), key.size(), 0) != static_cast<ssize_t>(key.size())) return;
  std::string part = path.string() + "-XXXXXX";
  const FileHandle file(::mkstemp(part.data()));  // 0600
  if (!file) return;
  const bool whole =
      write_all(file.get(), key.data(), key.size()) == key.size() && ::fsync(file.get()) == 0;
  if (whole) static_cast<void>(::link(part.c_str(), path.c_str()));  // unless there is one by now
  ::unlink(part.c_str());
}

}  // namespace

std::optional<Seal> seal_of(std::span<const uint8_t> bytes) {
  const fs::path folder = folder_of_key();
  if (folder.empty()) return std::nullopt;
  std::optional<Key> key = read_key(folder / "key");
  if (!key) {
    make_key(folder / "key");
    key = read_key(folder / "key");
  }
  return key ? std::optional(hmac_sha256(*key, bytes)) : std::nullopt;
}

bool is_sealed(std::span<const uint8_t> bytes, std::span<const uint8_t> seal) {
  const fs::path folder = folder_of_key();
  const std::optional<Key> key = folder.empty() ? std::nullopt : read_key(folder / "key");
  if (!key || seal.size() != std::tuple_size_v<Seal>) return false;
  const Seal right = hmac_sha256(*key, bytes);
  return CRYPTO_memcmp(right.data(), seal.data(), seal.size()) == 0;
}

}  // namespace ruedo
