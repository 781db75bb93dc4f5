// The page's files, as they were built into the program.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ruedo::console {

struct Asset {
  const char* path;       // "/", "/main.js", ...
  const char* type;
  const uint8_t* data;    // compressed by gzip
  size_t size;
};

extern const Asset kAssets[];
extern const size_t kAssetCount;

}  // namespace ruedo::console
