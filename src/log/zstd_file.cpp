#include "log/zstd_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <zstd.h>

#include "base/input_file.h"
#include "ruedo/errors.h"
#include "system/output_file.h"

namespace ruedo::log {
namespace {

constexpr int kLevel = 1;  // as a bag's chunks

// The next part of at most `left` bytes.
ZSTD_inBuffer read_part(const InputFile& in, const std::string& path, std::vector<char>& part,
                        uint64_t& left) {
  const size_t count = std::min<uint64_t>(left, part.size());
  if (std::fread(part.data(), 1, count, in.file.get()) != count)
    throw InputError({path}, "became shorter while it was read");
  left -= count;
  return {part.data(), count, 0};
}

}  // namespace

void pack_file(const std::string& from, const std::string& to) {
  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  const std::unique_ptr<ZSTD_CCtx, Free> context(ZSTD_createCCtx());
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel);
  const InputFile in = open_input(from);
  OutputFile out(to);
  std::vector<char> part(ZSTD_CStreamInSize()), packed(ZSTD_CStreamOutSize());
  auto left = static_cast<uint64_t>(in.size);
  bool more = true;
  while (more) {
    ZSTD_inBuffer input = read_part(in, from, part, left);
    const ZSTD_EndDirective directive = left > 0 ? ZSTD_e_continue : ZSTD_e_end;
    do {
      ZSTD_outBuffer output{packed.data(), packed.size(), 0};
      const size_t rest = ZSTD_compressStream2(context.get(), &output, &input, directive);
      if (ZSTD_isError(rest))
        throw EnvironmentError(std::string("zstd: ") + ZSTD_getErrorName(rest));
      out.write({packed.data(), output.pos});
      more = left > 0 || rest > 0;
    } while (directive == ZSTD_e_end ? more : input.pos < input.size);
  }
  out.keep();
}

uint64_t unpack_part(const std::string& from, uint64_t offset, uint64_t size, const std::string& to,
                     uint64_t max_bytes) {
  struct Free {
    void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
  };
  const std::unique_ptr<ZSTD_DCtx, Free> context(ZSTD_createDCtx());
  const InputFile in = open_input(from);
  if (::fseeko(in.file.get(), static_cast<off_t>(offset), SEEK_SET) != 0)
    throw InputError({from}, "cannot be read: " + std::string(std::strerror(errno)));
  OutputFile out(to);
  std::vector<char> part(ZSTD_DStreamInSize()), unpacked(ZSTD_DStreamOutSize());
  size_t wanted = 1;  // 0 at a frame's end
  uint64_t written = 0;
  for (uint64_t left = size; left > 0;) {
    ZSTD_inBuffer input = read_part(in, from, part, left);
    bool full = false;  // then zstd may hold more of what it has read
    while (input.pos < input.size || full) {
      ZSTD_outBuffer output{unpacked.data(), unpacked.size(), 0};
      wanted = ZSTD_decompressStream(context.get(), &output, &input);
      if (ZSTD_isError(wanted))
        throw InputError({from}, "has an attachment that is not what was written (zstd)");
      if (output.pos > max_bytes - written)
        throw InputError({from}, fmt::format("has an attachment of more than {} bytes", max_bytes));
      out.write({unpacked.data(), output.pos});
      written += output.pos;
      full = output.pos == output.size;
    }
  }
  if (wanted != 0) throw InputError({from}, "has an attachment that is cut off (zstd)");
  out.keep();
  return written;
}

}  // namespace ruedo::log
