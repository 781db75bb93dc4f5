#pragma once

#include <optional>
#include <string>

#include "system/leftovers.h"

namespace ruedo {

// A new folder in the system's temporary folder; removed with its contents.
class TemporaryFolder {
 public:
  // Throws EnvironmentError.
  explicit TemporaryFolder(const std::string& purpose);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string operator/(const char* name) const { return path_ + "/" + name; }

 private:
  std::string path_;
  std::optional<Leftover> leftover_;
};

}  // namespace ruedo
