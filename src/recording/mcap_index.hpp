#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "recording/mcap_records.hpp"

namespace berth::mcap {

/// A chunk's record in its file, and where among the chunk's records the messages of a channel begin.
struct IndexedChunk {
  u64 offset = 0, size = 0;
  std::map<u16, std::vector<u64>> messages;
};

/// An MCAP file whose messages can be had in any order, a chunk at a time: by the file's own index, which is read
/// alone, or, where that is missing or makes no sense, by one made of every whole chunk of the file, as recover() finds
/// them.
class IndexedFile {
 public:
  /// `wanted`: the topics to look for. Throws Error where the file cannot be read or is no MCAP file.
  IndexedFile(const std::string& path, const std::function<bool(const std::string& topic)>& wanted);
  IndexedFile(const IndexedFile&) = delete;
  IndexedFile& operator=(const IndexedFile&) = delete;

  const std::vector<IndexedChunk>& chunks() const { return chunks_; }
  const std::map<u16, Channel>& channels() const { return definitions_.channels; }
  /// Whether the file's own index was used; if not, what follows says what is missing.
  bool by_index() const { return by_index_; }
  const Problems& problems() const { return problems_; }
  /// Nothing is cut off.
  bool complete() const { return complete_; }
  u64 whole_bytes() const { return whole_bytes_; }
  u64 file_bytes() const { return file_bytes_; }

  /// A chunk's records, decompressed and with their checksum looked at. Says what is wrong; empty when all is well.
  /// From any thread that brings a codec and memory of its own; `raw` is for what stands in the file.
  std::string read_chunk(std::size_t chunk, ChunkCodec& codec, Bytes& raw, Bytes& records) const;

 private:
  bool read_at(u64 offset, std::size_t size, Bytes& to) const;
  /// False where there is no index that can be gone by.
  bool take_index();
  bool take_chunk_index(FieldReader& fields, u64 summary_start);
  void scan();

  std::string path_;
  std::function<bool(const std::string&)> wanted_;
  /// Closes itself, also where the constructor throws.
  struct OpenFile {
    OpenFile() = default;
    ~OpenFile();
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;
    int number = -1;
  };
  OpenFile file_;
  std::vector<IndexedChunk> chunks_;
  Definitions definitions_;
  Problems problems_;
  bool by_index_ = false, complete_ = false;
  u64 index_end_ = 0;  // of the chunks whose index was read
  u64 whole_bytes_ = 0, file_bytes_ = 0;
};

/// The message that begins at that byte of a chunk's records; none where no message does.
std::optional<Message> message_at(const Bytes& records, u64 offset);

}  // namespace berth::mcap
