#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "recording/chunk_codec.hpp"
#include "recording/mcap_format.hpp"

namespace berth::mcap {

/// Writes an MCAP file: header, attachments and metadata, chunks of messages with their indexes, and, when it is
/// finished, the summary. At any time the file is whole up to the last chunk that was ended. Every Error names the
/// file.
class Writer {
 public:
  /// Makes the file or empties it. `profile`: "ros2" where every message is one of ROS 2. Throws Error.
  Writer(const std::string& path, const std::string& profile, const std::string& library);
  /// Closes the file as it is: without finish(), what is in the open chunk is lost and there is no summary.
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// These go into the file at once, before the open chunk. Ids are the caller's; a schema's is not 0.
  void add(const Schema& schema);
  void add(const Channel& channel);
  void add(const Attachment& attachment, u64 log_time);
  void add(const Metadata& metadata);

  /// Into the open chunk. The message's channel has been added.
  void write(const Message& message);
  /// Bytes in the open chunk.
  std::size_t waiting() const { return records_.size(); }
  /// Writes the open chunk, if there is anything in it, and its indexes.
  void end_chunk();
  /// Writes a chunk of another file as it is there: its data, and the records that those decompress to.
  void copy_chunk(const std::string& compression, const u8* data, std::size_t size, const Bytes& records);
  /// Has what was written so far on the disk; not the open chunk.
  void sync();
  /// Ends the open chunk, writes the summary, has all of it on the disk and closes the file. Nothing may follow.
  void finish();
  /// After an Error: cuts the file back to its last whole record and drops what is in the open chunk, so that finish()
  /// may be tried. False when that failed, too.
  bool cut_back();

  /// Of the file so far.
  u64 bytes() const { return offset_; }
  /// In chunks that were written.
  u64 messages() const { return messages_; }
  u64 chunks() const { return chunks_.size(); }

 private:
  struct ChunkPlace {
    u64 start_time = 0, end_time = 0, offset = 0, length = 0, compressed = 0, uncompressed = 0, index_length = 0;
    std::string compression;
    std::map<u16, u64> indexes;  // of each channel, where
  };
  struct SidePlace {
    u64 offset, length, log_time, size;
    std::string name, media_type;
  };
  /// Times and offsets of a channel's messages in one chunk.
  using ChunkIndex = std::map<u16, std::vector<std::pair<u64, u64>>>;

  [[noreturn]] void fail(const std::string& what, int error) const;
  void put(const u8* data, std::size_t size);
  void put_record(Op op, const Bytes& content);
  void note_whole();
  /// Times, schemas and channels of a chunk's records, and where its messages are.
  ChunkIndex look_through(const Bytes& records, ChunkPlace& place);
  void count(const ChunkIndex& index, const ChunkPlace& place);
  void add_summary_group(Op op, const std::vector<Bytes>& contents, Bytes& summary, Bytes& offsets) const;
  Bytes summary() const;

  std::string path_;
  int file_ = -1;
  u64 offset_ = 0;
  u32 crc_ = 0;
  u64 whole_ = 0;  // where the last whole record ends, and the checksum there
  u32 whole_crc_ = 0;
  ChunkCodec codec_;
  Bytes records_, compressed_, content_;  // of the open chunk; the same as it is written; of a record being made
  Definitions definitions_;
  std::map<u16, u64> message_counts_;
  std::vector<ChunkPlace> chunks_;
  std::vector<SidePlace> attachments_, metadata_;
  u64 messages_ = 0, first_time_ = 0, last_time_ = 0;
};

}  // namespace berth::mcap
