#pragma once

#include <map>
#include <string>
#include <vector>

#include "recording/mcap_records.hpp"

namespace berth::mcap {

/// The messages of an MCAP file in the order in which they were written, of every chunk that is whole. Nothing but the
/// file's records is needed, so that a recording that is cut off, or still being written, is read like any other.
class Reader {
 public:
  /// Reads what stands before the first messages. Throws Error as RecordScan does.
  explicit Reader(const std::string& path);

  /// Valid until the next call; null at the end.
  const Message* next();

  /// Of what was read so far: channels and schemas by their ids, metadata, attachments (but those above 16 MiB).
  const std::map<u16, Channel>& channels() const { return definitions_.channels; }
  const Schema* schema_of_channel(u16 channel) const;
  const std::vector<Metadata>& metadata() const { return metadata_; }
  const Metadata* find_metadata(const std::string& name) const;
  const std::vector<Attachment>& attachments() const { return attachments_; }
  const Attachment* find_attachment(const std::string& name) const;

  /// Damage found so far. At the end: whether the file is whole as well, with its summary.
  const Problems& problems() const { return problems_; }
  bool complete() const { return scan_.complete(); }
  u64 whole_bytes() const { return scan_.whole_bytes(); }
  u64 file_bytes() const { return scan_.file_bytes(); }

 private:
  /// Goes on to the next chunk or message outside of one; false at the end.
  bool advance();
  void take_side_record();
  const Message* take_message(FieldReader fields);

  RecordScan scan_;
  ChunkCodec codec_;
  Problems problems_;
  Bytes records_;
  std::size_t at_ = 0;  // in records_
  bool ahead_ = false;  // advance() went on and nothing of it was given yet
  bool loose_ = false;  // the scan's record is a message
  Message message_;
  Definitions definitions_;
  std::vector<Metadata> metadata_;
  std::vector<Attachment> attachments_;
};

}  // namespace berth::mcap
