// The one way to write a file: whole, or not at all, and never over what was read.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace ruedo {

// Throws InputError for a file that was read (input_file.h): what is made from it would be all that
// is left of it.
void check_output(const std::string& path);

// A file that is written beside the one that it replaces, and gets its name at the end: if the disk
// is full, or the work fails or is killed, the old file stays, and no other. Devices, FIFOs and
// open descriptors (/dev/stdout) are written to as they are. An EnvironmentError names the file and
// the reason.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);  // throws as check_output(), or EnvironmentError
  ~OutputFile();                                 // removes what was not kept
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view bytes);  // throws EnvironmentError
  void keep();                         // it is whole; throws as the constructor
  // Where it is until then, for a program that writes it in our place.
  const std::string& part() const { return part_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void open(int descriptor);
  int open_part();  // < 0: errno says why
  void name();
  void take_over_rights() const;
  bool copy() const;
  [[noreturn]] void fail(int reason) const;

  const std::string path_;
  std::filesystem::file_status before_;  // of what was there
  std::string target_;                   // a symbolic link stays one
  std::string part_;
  bool is_named_ = true;  // the part is seen in a folder
  std::unique_ptr<std::FILE, Close> file_;
  bool kept_ = false;
};

// At once. Throws as OutputFile.
void write_file(const std::string& path, std::string_view bytes);

}  // namespace ruedo
