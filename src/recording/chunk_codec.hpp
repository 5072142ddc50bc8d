#pragma once

#include <memory>

#include "recording/mcap_format.hpp"

namespace berth::mcap {

/// CRC-32 as zlib's, going on from that of the bytes before; 0 of none.
u32 crc_of(const u8* data, std::size_t size, u32 before = 0);

/// What a chunk's records are compressed with. Takes its memory when it first needs it, and keeps it.
class ChunkCodec {
 public:
  ChunkCodec();
  ~ChunkCodec();
  ChunkCodec(const ChunkCodec&) = delete;
  ChunkCodec& operator=(const ChunkCodec&) = delete;

  /// "zstd", or "" where the build has no libzstd.
  static const char* compression();
  /// Into `out`, as compression() says. Throws Error where there is no memory for it.
  void compress(const Bytes& records, Bytes& out);
  /// Of a chunk compressed that way, `size` bytes when it is whole. Says why not otherwise; empty when all is well.
  std::string decompress(const std::string& compression, const u8* data, std::size_t data_size, std::size_t size,
                         Bytes& out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth::mcap
