// The page's files, as they were built into the program.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ruedo::console {

struct Asset {
  const char* path;  // "/", "/main.js", ...
  const char* type;
  const uint8_t* data;  // compressed by gzip
  size_t size;
};

extern const Asset kAssets[];
extern const size_t kAssetCount;

// The page as HTML for a file, up to where a log and the end of the body follow.
extern const uint8_t* const kShell;
extern const size_t kShellSize;

}  // namespace ruedo::console
