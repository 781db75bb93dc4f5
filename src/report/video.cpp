#include "report/video.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "ruedo/errors.h"

namespace ruedo::report {
namespace {

// VP8 is what every browser plays of WebM, H.264 with halved colours of MP4.
std::vector<std::string> codec_of(const std::string& file) {
  if (file.ends_with(".webm"))
    return {"-c:v",      "libvpx", "-crf",      "10", "-b:v", "4M",
            "-deadline", "good",   "-cpu-used", "4",  "-f",   "webm"};
  return {"-c:v",    "libx264",   "-crf",       "20", "-pix_fmt",
          "yuv420p", "-movflags", "+faststart", "-f", "mp4"};
}

// file: by its name's end it is clear what it is; to: where it is written.
std::vector<std::string> words_of(const std::string& file, const std::string& to, cv::Size size,
                                  double fps) {
  // -xerror: without it, ffmpeg ends well where the disk is full as it writes the end.
  std::vector<std::string> words{"ffmpeg", "-nostdin", "-loglevel", "error",         "-xerror",
                                 "-y",     "-f",       "rawvideo",  "-pixel_format", "bgr24"};
  const auto add = [&](const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  add({"-video_size", fmt::format("{}x{}", size.width, size.height)});
  add({"-framerate", fmt::format("{}", fps), "-i", "pipe:0"});
  add(codec_of(file));
  add({"file:" + to});
  return words;
}

}  // namespace

void Video::check_name(const std::string& file) {
  if (!file.ends_with(".webm") && !file.ends_with(".mp4"))
    throw InputError({}, "--video " + file + ": allowed are names that end in .webm or .mp4");
}

Video::Video(const std::string& file, cv::Size size, double fps)
    : file_(std::filesystem::absolute((check_name(file), file)).string()), out_(file_) {
  std::signal(SIGPIPE, SIG_IGN);  // the exit code shows the child's end
  complaints_ = std::tmpfile();
  int ends[2];
  if (complaints_ == nullptr || ::pipe2(ends, O_CLOEXEC) != 0) {
    const int fault = errno;
    end();
    throw EnvironmentError(std::string("--video: no pipe: ") + std::strerror(fault));
  }
  pictures_ = ::fdopen(ends[1], "wb");
  std::vector<std::string> words = words_of(file_, out_.part(), size, fps);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, ::fileno(complaints_), STDERR_FILENO);
  const int fault =
      ::posix_spawnp(&child_, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[0]);
  if (fault == 0) return;
  child_ = -1;
  end();
  throw EnvironmentError("--video: ffmpeg makes videos, and cannot be started: " +
                         std::string(std::strerror(fault)) + "; apt install ffmpeg");
}

Video::~Video() { end(); }

void Video::end() {
  if (pictures_) std::fclose(std::exchange(pictures_, nullptr));
  if (child_ > 0) ::waitpid(std::exchange(child_, -1), &status_, 0);
  if (complaints_) std::fclose(std::exchange(complaints_, nullptr));
}

void Video::write(const cv::Mat& picture) {
  const size_t bytes = picture.total() * picture.elemSize();
  if (std::fwrite(picture.data, 1, bytes, pictures_) != bytes) fail();
}

void Video::close() {
  const bool written = std::fclose(std::exchange(pictures_, nullptr)) == 0;
  ::waitpid(std::exchange(child_, -1), &status_, 0);
  if (!written || !WIFEXITED(status_) || WEXITSTATUS(status_) != 0) fail();
  out_.keep();
}

// With the last line of its error output.
void Video::fail() {
  if (pictures_) std::fclose(std::exchange(pictures_, nullptr));
  if (child_ > 0) ::waitpid(std::exchange(child_, -1), &status_, 0);
  std::string why;
  std::array<char, 1024> line{};
  std::fseek(complaints_, 0, SEEK_SET);
  while (std::fgets(line.data(), line.size(), complaints_)) why = line.data();
  while (!why.empty() && why.back() == '\n') why.pop_back();
  throw EnvironmentError(file_ + ": the video cannot be written" +
                         (why.empty() ? "" : ", says ffmpeg: " + why));
}

}  // namespace ruedo::report
