// libruedo_codecs.so, the only library that links OpenCV's codecs and the hundred libraries they
// need.
#include "model/codecs_module.h"

#include <cstdio>
#include <iostream>
#include <mutex>

#include <opencv2/imgcodecs.hpp>

namespace {

// What this thread's codecs write to stderr; null: nobody listens.
thread_local std::string* heard = nullptr;

bool hears(const char* bytes, size_t size) {
  constexpr size_t kMost = 4096;
  if (heard && heard->size() < kMost) heard->append(bytes, size);
  return heard != nullptr;
}

class Ear : public std::streambuf {
 public:
  std::streambuf* others = nullptr;

 private:
  std::streamsize xsputn(const char* bytes, std::streamsize size) override {
    return hears(bytes, static_cast<size_t>(size)) ? size : others->sputn(bytes, size);
  }
  int overflow(int c) override {
    const char byte = static_cast<char>(c);
    return hears(&byte, 1) ? c : others->sputc(byte);
  }
};

// Listens while it lives. OpenCV and libpng tell the terminal what they cannot read, in lines that
// nobody asked for; other threads write on as before. Nothing of it is freed, since one of them may
// be at it.
class Listening {
 public:
  Listening() {
    const std::lock_guard lock(mutex_);
    heard = &text;
    if (listeners_++ > 0) return;
    static std::FILE* const ear = made();
    ear_->others = std::cerr.rdbuf(ear_);
    others_ = stderr;
    if (ear) stderr = ear;
  }
  ~Listening() {
    const std::lock_guard lock(mutex_);
    heard = nullptr;
    if (--listeners_ > 0) return;
    stderr = others_;
    std::cerr.rdbuf(ear_->others);
  }
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;

  std::string text;

 private:
  static std::FILE* made() {
    const cookie_io_functions_t functions = {nullptr,
                                             [](void*, const char* bytes, size_t size) -> ssize_t {
                                               if (!hears(bytes, size))
                                                 std::fwrite(bytes, 1, size, others_);
                                               return static_cast<ssize_t>(size);
                                             },
                                             nullptr, nullptr};
    std::FILE* const ear = fopencookie(nullptr, "w", functions);
    if (ear) std::setvbuf(ear, nullptr, _IONBF, 0);
    return ear;
  }

  static inline std::mutex mutex_;
  static inline int listeners_ = 0;
  static inline std::FILE* others_ = stderr;
  static inline Ear* const ear_ = new Ear;
};

}  // namespace

void ruedo_decode_picture(const void* bytes, size_t size, int how, cv::Mat& picture) {
  const cv::Mat packed(1, static_cast<int>(size), CV_8U, const_cast<void*>(bytes));
  std::string said;
  {
    Listening listening;
    picture = cv::imdecode(packed, how);
    said = std::move(listening.text);
  }
  // Of a picture that can be read they may say that a part of it is damaged.
  if (!picture.empty()) std::fputs(said.c_str(), stderr);
}

void ruedo_encode_picture(const std::string& kind, const cv::Mat& picture,
                          std::vector<uint8_t>& bytes, const std::vector<int>& parameters) {
  cv::imencode(kind, picture, bytes, parameters);
}
