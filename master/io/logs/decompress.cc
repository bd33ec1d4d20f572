#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include "common/trials/text/csv.h"
#include "master/io/logs/bags.h"

namespace gapfarm {
namespace {

constexpr std::uint64_t kMostBytes = 1ull << 30;
// Logs of numbers pack ten times; more than this is a broken size and not worth the memory.
constexpr std::uint64_t kMostRatio = 5000;

bool unpack_lz4(std::string_view bytes, std::string& to) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) return false;
  std::size_t in = 0, out = 0, hint = 1;
  while (hint != 0 && in < bytes.size()) {
    std::size_t room = to.size() - out, rest = bytes.size() - in;
    hint = LZ4F_decompress(context, to.data() + out, &room, bytes.data() + in, &rest, nullptr);
    if (LZ4F_isError(hint) || (room == 0 && rest == 0)) break;
    in += rest;
    out += room;
  }
  const bool fine = !LZ4F_isError(hint) && out == to.size();
  LZ4F_freeDecompressionContext(context);
  return fine;
}

bool unpack_bz2(std::string_view bytes, std::string& to) {
  auto size = static_cast<unsigned>(to.size());
  // bzlib takes what it reads as char*.
  const int code = BZ2_bzBuffToBuffDecompress(to.data(), &size, const_cast<char*>(bytes.data()),
                                              static_cast<unsigned>(bytes.size()), 0, 0);
  return code == BZ_OK && size == to.size();
}

bool unpack_zstd(std::string_view bytes, std::string& to) {
  const std::size_t size = ZSTD_decompress(to.data(), to.size(), bytes.data(), bytes.size());
  return !ZSTD_isError(size) && size == to.size();
}

}  // namespace

Result<std::string> decompress(std::string_view bytes, const std::string& how, std::uint64_t size) {
  if (how.empty() || how == "none") return std::string(bytes);
  const bool lz4 = how == "lz4", bz2 = how == "bz2", zstd = how == "zstd";
  if (!lz4 && !bz2 && !zstd) {
    return Error{"found a chunk packed by " + quoted_word(how) +
                 ", expected none, bz2, lz4 or zstd"};
  }
  if (size > kMostBytes || size > (bytes.size() + 64) * kMostRatio) {
    return Error{"found a chunk of " + std::to_string(bytes.size()) +
                 " bytes that claims to hold " + std::to_string(size) +
                 ", expected at most 1 GiB and " + std::to_string(kMostRatio) +
                 " times its own size"};
  }
  std::string to(size, '\0');
  const bool fine = lz4   ? unpack_lz4(bytes, to)
                    : bz2 ? unpack_bz2(bytes, to)
                          : unpack_zstd(bytes, to);
  if (fine) return to;
  return Error{"found a chunk that " + how + " does not unpack to its " + std::to_string(size) +
               " bytes, expected whole chunks"};
}

}  // namespace gapfarm
