// Restores the log from a ROS 2 bag that `ruedo export --ros2` made, for all that reads logs.
//
// The topics give scans and pictures; the rest, and the world's files, lie in the bag beside them
// (Rosbag).
#pragma once

#include <optional>
#include <string>

#include "system/temporary_folder.h"

namespace ruedo::ros2 {

class BagLog {
 public:
  // path: a bag's folder, or its MCAP file, whose log is then written into a folder of its own; of
  // anything else ("" too) path() is that path. Throws InputError for a bag that is damaged, or
  // that has no scene; EnvironmentError where nothing can be written.
  explicit BagLog(const std::string& path);

  const std::string& path() const { return log_; }

 private:
  void restore(const std::string& file, const std::string& name);
  void join(const std::string& rest, const std::string& file);

  std::string log_;
  std::optional<TemporaryFolder> folder_;
};

}  // namespace ruedo::ros2
