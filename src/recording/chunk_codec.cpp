#include "recording/chunk_codec.hpp"

#include <zlib.h>

#include <algorithm>
#include <limits>
#if BERTH_WITH_ZSTD
#include <zstd.h>
#endif

#include "berth/error.hpp"

namespace berth::mcap {

u32 crc_of(const u8* data, std::size_t size, u32 before) {
  uLong crc = before;
  while (size > 0) {
    const std::size_t part = std::min<std::size_t>(size, std::numeric_limits<int>::max());
    crc = crc32(crc, data, static_cast<uInt>(part));
    data += part;
    size -= part;
  }
  return static_cast<u32>(crc);
}

#if BERTH_WITH_ZSTD

namespace {
// Its fastest: pictures are noise, which no level makes much smaller.
constexpr int kLevel = 1;
}  // namespace

struct ChunkCodec::Impl {
  std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> deflater{nullptr, ZSTD_freeCCtx};
  std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> inflater{nullptr, ZSTD_freeDCtx};
};

const char* ChunkCodec::compression() { return "zstd"; }

void ChunkCodec::compress(const Bytes& records, Bytes& out) {
  if (!impl_->deflater) impl_->deflater.reset(ZSTD_createCCtx());
  if (!impl_->deflater) throw Error("zstd: no memory to compress with; free some");
  out.resize(ZSTD_compressBound(records.size()));
  const std::size_t size =
      ZSTD_compressCCtx(impl_->deflater.get(), out.data(), out.size(), records.data(), records.size(), kLevel);
  if (ZSTD_isError(size) != 0) throw Error(std::string("zstd: compressing failed: ") + ZSTD_getErrorName(size));
  out.resize(size);
}

std::string ChunkCodec::decompress(const std::string& compression, const u8* data, std::size_t data_size,
                                   std::size_t size, Bytes& out) {
  if (compression.empty()) {
    if (data_size != size) return "its sizes disagree";
    out.assign(data, data + data_size);
    return "";
  }
  if (compression != "zstd") return "it is compressed by '" + compression + "', which is not supported";
  // Not every writer says the size in the frame; where it is said, it must be this, before memory is taken for it.
  const unsigned long long said = ZSTD_getFrameContentSize(data, data_size);
  if (said == ZSTD_CONTENTSIZE_ERROR) return "its zstd data is damaged";
  if (said != ZSTD_CONTENTSIZE_UNKNOWN && said != size) return "its sizes disagree";
  if (!impl_->inflater) impl_->inflater.reset(ZSTD_createDCtx());
  if (!impl_->inflater) return "there is no memory to decompress it";
  out.resize(size);
  const std::size_t got = ZSTD_decompressDCtx(impl_->inflater.get(), out.data(), size, data, data_size);
  if (ZSTD_isError(got) != 0 || got != size) return "its zstd data is damaged";
  return "";
}

#else

struct ChunkCodec::Impl {};

const char* ChunkCodec::compression() { return ""; }

void ChunkCodec::compress(const Bytes& records, Bytes& out) { out = records; }

std::string ChunkCodec::decompress(const std::string& compression, const u8* data, std::size_t data_size,
                                   std::size_t size, Bytes& out) {
  if (compression == "zstd") return "it is compressed by zstd, which this build was made without (libzstd)";
  if (!compression.empty()) return "it is compressed by '" + compression + "', which is not supported";
  if (data_size != size) return "its sizes disagree";
  out.assign(data, data + data_size);
  return "";
}

#endif

ChunkCodec::ChunkCodec() : impl_(std::make_unique<Impl>()) {}
ChunkCodec::~ChunkCodec() = default;

}  // namespace berth::mcap
