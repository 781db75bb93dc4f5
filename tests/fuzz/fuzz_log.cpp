// Logs. If the first byte is 0, the rest is a file; otherwise it is the body of the log's header,
// ruedo/header, whose files are looked for.
#include <cstring>
#include <string>
#include <vector>

#include "base/lcm_log.h"
#include "budget.h"
#include "log/header.h"
#include "log/index.h"
#include "log/reader.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/log_header_t.hpp"
#include "scratch_file.h"

namespace {

void append(std::vector<uint8_t>& out, uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<uint8_t>(value >> (8 * i)));
}

// An event of an LCM log, with the type's fingerprint before the bytes.
std::vector<uint8_t> as_header(const uint8_t* data, size_t size) {
  const std::string channel = "ruedo/header";
  std::vector<uint8_t> event;
  append(event, ruedo::kLogSync, 4);
  append(event, 0, 8);
  append(event, 0, 8);
  append(event, channel.size(), 4);
  append(event, size + 8, 4);
  event.insert(event.end(), channel.begin(), channel.end());
  append(event, static_cast<uint64_t>(ruedo::log_header_t::getHash()), 8);
  event.insert(event.end(), data, data + size);
  return event;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const ScratchFolder folder;
  if (size < 1) return 0;
  const Budget budget;
  const std::vector<uint8_t> bytes =
      data[0] == 0 ? std::vector<uint8_t>(data + 1, data + size) : as_header(data + 1, size - 1);
  const std::string path = folder.write("run.log", bytes.data(), bytes.size());
  try {
    const ruedo::log::Index index(path);
    if (index.header()) ruedo::log::check_files(*index.header(), path);
    ruedo::log::Reader reader(path);
    for (ruedo::log::Event event; reader.next(event);) {
    }
  } catch (const ruedo::InputError&) {
  }
  return 0;
}
