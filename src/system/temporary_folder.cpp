#include "system/temporary_folder.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "ruedo/errors.h"

namespace fs = std::filesystem;

namespace ruedo {

TemporaryFolder::TemporaryFolder(const std::string& purpose) {
  std::error_code error;
  const fs::path temporary = fs::temp_directory_path(error);
  if (error) throw EnvironmentError("TMPDIR is not a folder: " + error.message());
  path_ = (temporary / ("ruedo-" + purpose + "-XXXXXX")).string();
  if (!::mkdtemp(path_.data()))
    throw EnvironmentError("no folder can be made in " + temporary.string() + ": " +
                           std::strerror(errno));
  leftover_.emplace(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

}  // namespace ruedo
