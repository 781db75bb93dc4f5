// A video file, made picture by picture by ffmpeg, the program.
#pragma once

#include <sys/types.h>
#include <cstdio>
#include <string>

#include <opencv2/core.hpp>

#include "system/output_file.h"

namespace ruedo::report {

class Video {
 public:
  // Throws InputError for a name that does not end in .webm or .mp4, EnvironmentError without
  // ffmpeg, and as OutputFile. An older file stays until close().
  Video(const std::string& file, cv::Size size, double fps);
  ~Video();
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;

  // 8-bit blue, green, red, of that size. Throws EnvironmentError when the video cannot be written.
  void write(const cv::Mat& picture);
  void close();  // it is whole; throws as write()

  static void check_name(const std::string& file);  // throws InputError

 private:
  void end();
  [[noreturn]] void fail();

  std::string file_;
  OutputFile out_;
  pid_t child_ = -1;
  int status_ = 0;                   // of the child that has ended
  std::FILE* pictures_ = nullptr;    // to it
  std::FILE* complaints_ = nullptr;  // of its
};

}  // namespace ruedo::report
