#pragma once

#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "recording/chunk_codec.hpp"
#include "recording/mcap_format.hpp"

namespace berth::mcap {

/// No writer makes larger records; a damaged or hostile size must not take the memory.
inline constexpr u64 kMostRecord = u64{512} << 20;

/// What a file is found to lack. Damage may be anywhere: so many are kept in words, and all are counted.
class Problems {
 public:
  static constexpr std::size_t kKept = 20;
  void add(const std::string& what) {
    if (++count_ <= kKept) kept_.push_back(what);
  }
  std::size_t count() const { return count_; }
  const std::vector<std::string>& kept() const { return kept_; }

 private:
  std::vector<std::string> kept_;
  std::size_t count_ = 0;
};

/// The records of a file that may be cut off or damaged anywhere, one after the other. Behind damage that hides where
/// the next record begins, it goes on with the next chunk.
class RecordScan {
 public:
  /// Throws Error where the file cannot be read or does not begin as MCAP files do.
  explicit RecordScan(const std::string& path);

  /// The next whole record; false at the end. What is wrong goes to `problems`.
  bool next(Problems& problems);
  Op op() const { return op_; }
  const Bytes& content() const { return content_; }
  u64 offset() const { return offset_; }

  u64 file_bytes() const { return size_; }
  /// Where the last whole record of the data section ends.
  u64 whole_bytes() const { return whole_; }
  /// The file has its closing record and magic: nothing is cut off.
  bool complete() const { return complete_; }

 private:
  bool read_at(u64 offset, u8* to, std::size_t size);
  bool looks_like_chunk(u64 offset);
  /// Whether a chunk begins further on; `at_` then is there.
  bool find_chunk();

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
  /// Compares the checksum of all that was read with a record that says what it is; starts that of the summary.
  void check_sum(const std::array<u8, kRecordHead>& head, Problems& problems);

  u64 size_ = 0, at_ = 0, offset_ = 0, whole_ = 0;
  u32 crc_ = 0;  // of the section so far; says nothing once anything was passed over
  Op op_ = Op::header;
  Bytes content_;
  bool complete_ = false, data_ended_ = false;
};

/// A chunk as it stands in its record.
struct Chunk {
  u64 records_size = 0;
  u32 crc = 0;
  std::string compression;
  const u8* data = nullptr;
  std::size_t size = 0;
};

/// Decompresses a chunk record's content and checks its sum. Says what is wrong; empty when all is well.
std::string open_chunk(const Bytes& content, ChunkCodec& codec, Chunk& chunk, Bytes& records);

/// Reads an attachment record's content and checks its sum; a metadata record's. False where it is damaged.
bool read_attachment(const Bytes& content, Attachment& attachment);
bool read_metadata(const Bytes& content, Metadata& metadata);

}  // namespace berth::mcap
