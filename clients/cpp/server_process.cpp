// Finding the program, a free port, and the life of the server process.
#include "server_process.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "base/utf8.h"
#include "core.h"
#include "transport/address.h"

extern char** environ;

namespace ruedo::client {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostHeard = size_t{1} << 16;  // bytes of warnings that are read at once
constexpr size_t kMostWarned = 1000;            // warnings, each of which is printed once

bool is_program(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) && access(path.c_str(), X_OK) == 0;
}

// RUEDO, else the one of the installation, else the PATH, else the bin/ or build/*/bin/ of a folder
// above this program.
std::string find_ruedo(const std::string& installed) {
  if (const char* named = std::getenv("RUEDO"); named && *named) {
    if (!is_program(named))
      throw LaunchError("the environment's RUEDO is '" + std::string(named) +
                        "', which is not a program");
    return named;
  }
  if (!installed.empty() && is_program(installed)) return installed;
  std::istringstream path(std::getenv("PATH") ? std::getenv("PATH") : "");
  for (std::string folder; std::getline(path, folder, ':');) {
    if (is_program(fs::path(folder) / "ruedo")) return fs::path(folder) / "ruedo";
  }
  std::error_code error;
  for (fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path(); !folder.empty();
       folder = folder.parent_path()) {
    std::vector<fs::path> candidates{folder / "bin/ruedo", folder / "build/bin/ruedo"};
    for (const auto& build : fs::directory_iterator(folder / "build", error))
      candidates.push_back(build.path() / "bin/ruedo");
    for (const fs::path& candidate : candidates) {
      if (is_program(candidate)) return candidate;
    }
    if (folder == folder.root_path()) break;
  }
  throw LaunchError(
      "the program `ruedo` was not found: not in RUEDO, not in its installation, not on the PATH, "
      "not built beside this program "
      "(`scripts/run` builds it)");
}

FileHandle bound_socket(int type, const char* host, uint16_t port) {
  FileHandle bound(socket(AF_INET, type | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  inet_pton(AF_INET, host, &address.sin_addr);
  if (bound && bind(bound.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return bound;
  return FileHandle();
}

uint16_t port_of(const FileHandle& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

// A URL that nothing else uses. The TCP socket on the same port, kept open as `token`, keeps
// launches of any process, in any language, apart from each other.
std::string free_url(FileHandle& token) {
  for (int i = 0; i < 100; ++i) {
    token = bound_socket(SOCK_STREAM, "127.0.0.1", 0);
    if (!token) break;
    const uint16_t port = port_of(token);
    if (!has_multicast_route()) {
      token = FileHandle();  // the server itself will listen on it
      static std::once_flag said;
      std::call_once(said, [&] {
        std::fprintf(stderr,
                     "ruedo: no multicast route here: launch() speaks LCM over TCP, "
                     "LCM_DEFAULT_URL=tcpq://127.0.0.1:%d\n",
                     port);
      });
      return "tcpq://127.0.0.1:" + std::to_string(port);
    }
    if (bound_socket(SOCK_DGRAM, "0.0.0.0", port))  // else an LCM program uses the port
      return "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0";
    token = FileHandle();
  }
  throw LaunchError("no free UDP port was found in 100 tries");
}

// Python's launch() takes the same options.
void add_options(const LaunchOptions& options, std::vector<std::string>& command) {
  const auto add = [&](const char* option, const std::string& value) {
    command.insert(command.end(), {option, value});
  };
  if (options.seed >= 0) add("--seed", std::to_string(options.seed));
  std::ostringstream rate;
  rate << options.rate;
  add("--rate", std::isinf(options.rate) ? "max" : rate.str());
  if (options.lockstep != 0) add("--lockstep", std::to_string(options.lockstep));
  for (const std::string& model : options.spawn) add("--spawn", model);
  for (const std::string& device : options.disable) add("--disable", device);
  for (const auto& [key, value] : options.settings)
    add("--set", std::string(key).append("=").append(value.text()));
  if (std::isfinite(options.duration.count()))
    add("--duration", Setting(options.duration.count()).text());
  if (options.paused) command.emplace_back("--paused");
  if (!options.record.empty()) add("--record", options.record);
  if (!options.snapshots.empty()) add("--snapshots", options.snapshots);
  for (const std::string& drive : options.drive) add("--drive", drive);
  for (const std::string& fault : options.fault) add("--fault", fault);
  for (const std::string& plugin : options.plugin) add("--plugin", plugin);
  for (const std::string& input : options.wait_for) add("--wait-for", input);
  if (!options.noise) command.emplace_back("--no-noise");
  command.insert(command.end(), options.args.begin(), options.args.end());
}

// A folder for the socket, which no other user may enter.
fs::path make_folder() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  constexpr size_t kLongest = 60;  // a socket's path has 99 bytes at most
  const bool usable =
      runtime && *runtime && std::strlen(runtime) < kLongest && access(runtime, W_OK | X_OK) == 0;
  std::string name = std::string(usable ? runtime : "/tmp") + "/ruedo-XXXXXX";
  if (!mkdtemp(name.data()))
    throw LaunchError("no folder for the server's socket: " + name + ": " + std::strerror(errno));
  return name;
}

}  // namespace

std::string detail::program_beside(const std::string& header) {
  // include/ruedo/client.h
  const fs::path prefix = fs::path(header).parent_path().parent_path().parent_path();
  std::error_code error;
  const fs::path program = fs::canonical(prefix / "bin/ruedo", error);
  return !error && is_program(program) ? program.string() : "";
}

ServerProcess::ServerProcess(const std::string& world, const LaunchOptions& options) {
  if (world.empty() == options.text.empty())
    throw LaunchError("launch() needs either a world or its text");
  const std::string program = find_ruedo(options.program);
  if (options.url == "auto") {
    url_ = free_url(token_);
  } else if (options.url.empty()) {
    folder_ = make_folder();
    url_ = "unix://" + (folder_ / "bus").string();
  } else {
    url_ = options.url;
  }
  std::vector<std::string> command{
      program, "run", options.text.empty() ? world : written(options.text),
      "--lcm", url_,  "--follow-stdin"};
  // It goes with the server, even where this process is killed.
  if (!folder_.empty()) command.insert(command.end(), {"--temporary", folder_});
  add_options(options, command);
  for (const std::string& word : command) command_ += (command_.empty() ? "" : " ") + word;
  try {
    start(command, options.verbose);
    await_port(options.timeout);
  } catch (...) {
    end();
    throw;
  }
}

// The text in a file that ends with the server; its name.
std::string ServerProcess::written(const std::string& text) {
  if (folder_.empty()) folder_ = make_folder();
  const bool urdf =
      text.find("<robot") != std::string::npos && text.find("<sdf") == std::string::npos;
  const fs::path path = folder_ / (urdf ? "world.urdf" : "world.sdf");
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw LaunchError("the world's text cannot be written to " + path.string());
  return path;
}

ServerProcess::~ServerProcess() { end(); }

void ServerProcess::start(const std::vector<std::string>& command, bool verbose) {
  const FileHandle its_end = stdin_.open();
  if (!its_end) throw LaunchError(std::string("no pipe for the server: ") + std::strerror(errno));
  if (!verbose) {
    const char* folder = std::getenv("TMPDIR");
    std::string name = std::string(folder && *folder ? folder : "/tmp") + "/ruedo-XXXXXX";
    output_ = FileHandle(mkostemp(name.data(), O_CLOEXEC));
    if (output_) unlink(name.c_str());
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, its_end.get(), 0);
  if (output_) {
    posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, output_.get(), 2);
  }
  // A session of its own: Ctrl-C in a terminal reaches this process alone, which may still use the
  // server. It awaits processes of its own, whatever this one does with those.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGDEF);
  sigset_t usual;
  sigemptyset(&usual);
  sigaddset(&usual, SIGCHLD);
  posix_spawnattr_setsigdefault(&attributes, &usual);
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const int error =
      posix_spawn(&pid_, command[0].c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) {
    pid_ = -1;
    throw LaunchError(command[0] + " cannot be started: " + std::strerror(error));
  }
}

std::vector<std::string> ServerProcess::warnings() {
  std::vector<std::string> news;
  const std::unique_lock lock(mutex_, std::try_to_lock);  // end() may take a while
  if (!lock || !output_) return news;
  std::string said(kMostHeard, '\0');
  const ssize_t count = pread(output_.get(), said.data(), said.size(), heard_);
  said.resize(count > 0 ? static_cast<size_t>(count) : 0);
  said.resize(said.rfind('\n') + 1);  // whole lines
  heard_ += static_cast<off_t>(said.size());
  std::istringstream lines(said);
  for (std::string line; std::getline(lines, line);) {
    line = for_terminal(line);
    if (line.empty() || line.rfind("ruedo: info:", 0) == 0 || warned_.count(line)) continue;
    if (warned_.size() < kMostWarned) warned_.insert(line);
    news.push_back(line);
  }
  return news;
}

// A server listens on its socket or by tcpq once its world is loaded. If it ends before, connecting
// reports that.
void ServerProcess::await_port(Duration timeout) {
  const auto deadline = deadline_after(timeout);
  while (!is_served(url_) && !ended() && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (const auto how = ended()) throw LaunchError(*how);
}

bool ServerProcess::poll() {
  if (ended_ || pid_ <= 0) return true;
  int status = 0;
  const pid_t found = waitpid(pid_, &status, WNOHANG);
  if (found == pid_) status_ = status;
  // Where SIGCHLD is ignored, or the program awaits whichever of its processes ends, it is gone.
  ended_ = found == pid_ || (found < 0 && errno == ECHILD);
  return ended_;
}

std::string ServerProcess::how() const {
  if (!status_) return "exit code unknown";
  return WIFEXITED(*status_) ? "exit code " + std::to_string(WEXITSTATUS(*status_))
                             : "signal " + std::to_string(WTERMSIG(*status_));
}

std::optional<std::string> ServerProcess::ended() {
  std::lock_guard lock(mutex_);
  if (!poll()) return std::nullopt;
  const std::string said = last_lines();
  return "the server ended (" + how() + "): " + (said.empty() ? "it said nothing" : said) + "\n(`" +
         command_ + "`)";
}

bool ServerProcess::is_done() {
  const std::lock_guard lock(mutex_);
  return poll() && status_ && WIFEXITED(*status_) && WEXITSTATUS(*status_) == 0;
}

void ServerProcess::end() {
  std::lock_guard lock(mutex_);
  stdin_.close();
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (!poll()) {
    if (std::chrono::steady_clock::now() >= deadline) {
      kill(pid_, SIGKILL);  // it has just been found running: the number is still its own
      int status = 0;
      if (waitpid(pid_, &status, 0) == pid_) status_ = status;
      ended_ = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  output_ = FileHandle();
  token_ = FileHandle();
  std::error_code gone_already;
  if (!folder_.empty()) fs::remove_all(folder_, gone_already);
}

std::string ServerProcess::last_lines() const {
  if (!output_) return "";
  const off_t end = lseek(output_.get(), 0, SEEK_END);
  const off_t begin = std::max<off_t>(0, end - 4000);
  std::string text(static_cast<size_t>(end - begin), '\0');
  const ssize_t read = pread(output_.get(), text.data(), text.size(), begin);
  text.resize(read > 0 ? static_cast<size_t>(read) : 0);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  size_t from = text.size();
  for (int lines = 0; lines < 12 && from != std::string::npos && from > 0; ++lines)
    from = text.rfind('\n', from - 1);
  return from == std::string::npos ? text
                                   : text.substr(from + (from < text.size() && text[from] == '\n'));
}

}  // namespace ruedo::client
