#include "recording/mcap_writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "berth/error.hpp"

namespace berth::mcap {
namespace {

Bytes content_of(const Schema& schema) {
  Bytes content;
  FieldWriter fields(content);
  fields.number(schema.id);
  fields.string(schema.name);
  fields.string(schema.encoding);
  fields.string(schema.text);
  return content;
}

Bytes content_of(const Channel& channel) {
  Bytes content;
  FieldWriter fields(content);
  fields.number(channel.id);
  fields.number(channel.schema);
  fields.string(channel.topic);
  fields.string(channel.encoding);
  fields.map(channel.metadata);
  return content;
}

void append_record(Op op, const Bytes& content, Bytes& to) {
  FieldWriter fields(to);
  fields.number(static_cast<u8>(op));
  fields.number(static_cast<u64>(content.size()));
  fields.bytes(content.data(), content.size());
}

}  // namespace

Writer::Writer(const std::string& path, const std::string& profile, const std::string& library) : path_(path) {
  file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file_ < 0) {
    throw Error(path + ": the recording cannot be written (" + std::strerror(errno) +
                "); check the folder and its permissions");
  }
  try {
    put(kMagic.data(), kMagic.size());
    content_.clear();
    FieldWriter fields(content_);
    fields.string(profile);
    fields.string(library);
    put_record(Op::header, content_);
  } catch (...) {
    close(file_);
    throw;
  }
}

Writer::~Writer() {
  if (file_ >= 0) close(file_);
}

void Writer::fail(const std::string& what, int error) const {
  throw Error(path_ + ": " + what + " failed (" + std::strerror(error) + "); " +
              (error == ENOSPC || error == EDQUOT || error == EFBIG ? "free some space" : "check the disk"));
}

void Writer::put(const u8* data, std::size_t size) {
  // The checksum before the bytes: after a failure both are cut back.
  crc_ = crc_of(data, size, crc_);
  while (size > 0) {
    const ssize_t written = ::write(file_, data, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail("writing the recording", written < 0 ? errno : EIO);
    data += written;
    size -= static_cast<std::size_t>(written);
    offset_ += static_cast<u64>(written);
  }
}

void Writer::note_whole() {
  whole_ = offset_;
  whole_crc_ = crc_;
}

void Writer::put_record(Op op, const Bytes& content) {
  Bytes head;
  FieldWriter fields(head);
  fields.number(static_cast<u8>(op));
  fields.number(static_cast<u64>(content.size()));
  put(head.data(), head.size());
  put(content.data(), content.size());
  note_whole();
}

void Writer::add(const Schema& schema) {
  put_record(Op::schema, content_of(schema));
  definitions_.schemas[schema.id] = schema;
}

void Writer::add(const Channel& channel) {
  put_record(Op::channel, content_of(channel));
  definitions_.channels[channel.id] = channel;
}

void Writer::add(const Attachment& attachment, u64 log_time) {
  content_.clear();
  FieldWriter fields(content_);
  fields.number(log_time);
  fields.number(u64{0});  // when it was made is not known
  fields.string(attachment.name);
  fields.string(attachment.media_type);
  fields.number(static_cast<u64>(attachment.data.size()));
  fields.bytes(attachment.data.data(), attachment.data.size());
  fields.number(crc_of(content_.data(), content_.size()));
  const u64 offset = offset_;
  put_record(Op::attachment, content_);
  attachments_.push_back(
      {offset, offset_ - offset, log_time, attachment.data.size(), attachment.name, attachment.media_type});
}

void Writer::add(const Metadata& metadata) {
  content_.clear();
  FieldWriter fields(content_);
  fields.string(metadata.name);
  fields.map(metadata.values);
  const u64 offset = offset_;
  put_record(Op::metadata, content_);
  metadata_.push_back({offset, offset_ - offset, 0, 0, metadata.name, ""});
}

void Writer::write(const Message& message) {
  FieldWriter fields(records_);
  fields.number(static_cast<u8>(Op::message));
  fields.number(static_cast<u64>(22 + message.size));
  fields.number(message.channel);
  fields.number(message.sequence);
  fields.number(message.log_time);
  fields.number(message.publish_time);
  fields.bytes(message.data, message.size);
}

void Writer::end_chunk() {
  if (records_.empty()) return;
  codec_.compress(records_, compressed_);
  copy_chunk(ChunkCodec::compression(), compressed_.data(), compressed_.size(), records_);
  records_.clear();
}

Writer::ChunkIndex Writer::look_through(const Bytes& records, ChunkPlace& place) {
  ChunkIndex index;
  bool any = false;
  FieldReader left(records.data(), records.size());
  u64 at = 0;
  for (Record record; next_record(left, record); at = records.size() - left.left()) {
    FieldReader fields(record.content, record.size);
    if (record.op == Op::message) {
      const u16 channel = fields.number<u16>();
      fields.number<u32>();
      const u64 time = fields.number<u64>();
      if (!fields.ok()) continue;
      index[channel].emplace_back(time, at);
      place.start_time = any ? std::min(place.start_time, time) : time;
      place.end_time = any ? std::max(place.end_time, time) : time;
      any = true;
    } else {
      definitions_.take(record.op, fields);
    }
  }
  return index;
}

void Writer::copy_chunk(const std::string& compression, const u8* data, std::size_t size, const Bytes& records) {
  ChunkPlace place;
  ChunkIndex index = look_through(records, place);
  place.offset = offset_;
  place.compression = compression;
  place.compressed = size;
  place.uncompressed = records.size();
  Bytes head;
  FieldWriter fields(head);
  fields.number(static_cast<u8>(Op::chunk));
  fields.number(static_cast<u64>(8 + 8 + 8 + 4 + 4 + compression.size() + 8 + size));
  fields.number(place.start_time);
  fields.number(place.end_time);
  fields.number(place.uncompressed);
  fields.number(crc_of(records.data(), records.size()));
  fields.string(compression);
  fields.number(static_cast<u64>(size));
  put(head.data(), head.size());
  put(data, size);
  place.length = offset_ - place.offset;
  for (const auto& [channel, messages] : index) {
    content_.clear();
    FieldWriter entries(content_);
    entries.number(channel);
    entries.number(static_cast<u32>(16 * messages.size()));
    for (const auto& [time, at] : messages) {
      entries.number(time);
      entries.number(at);
    }
    place.indexes[channel] = offset_;
    Bytes record;
    append_record(Op::message_index, content_, record);
    put(record.data(), record.size());
  }
  place.index_length = offset_ - place.offset - place.length;
  note_whole();
  count(index, place);
  chunks_.push_back(std::move(place));
}

void Writer::count(const ChunkIndex& index, const ChunkPlace& place) {
  if (index.empty()) return;
  first_time_ = messages_ == 0 ? place.start_time : std::min(first_time_, place.start_time);
  last_time_ = messages_ == 0 ? place.end_time : std::max(last_time_, place.end_time);
  for (const auto& [channel, messages] : index) {
    message_counts_[channel] += messages.size();
    messages_ += messages.size();
  }
}

void Writer::sync() {
  if (fdatasync(file_) != 0) fail("bringing the recording to the disk", errno);
}

bool Writer::cut_back() {
  records_.clear();
  offset_ = whole_;
  crc_ = whole_crc_;
  return ftruncate(file_, static_cast<off_t>(whole_)) == 0 && lseek(file_, static_cast<off_t>(whole_), SEEK_SET) >= 0;
}

void Writer::add_summary_group(Op op, const std::vector<Bytes>& contents, Bytes& summary, Bytes& offsets) const {
  if (contents.empty()) return;
  const u64 start = summary.size();
  for (const Bytes& content : contents) append_record(op, content, summary);
  Bytes offset;
  FieldWriter fields(offset);
  fields.number(static_cast<u8>(op));
  fields.number(offset_ + start);
  fields.number(static_cast<u64>(summary.size()) - start);
  append_record(Op::summary_offset, offset, offsets);
}

/// All that follows the data section, but for the closing magic.
Bytes Writer::summary() const {
  Bytes summary, offsets;
  std::vector<Bytes> group;
  for (const auto& [id, schema] : definitions_.schemas) group.push_back(content_of(schema));
  add_summary_group(Op::schema, group, summary, offsets);
  group.clear();
  for (const auto& [id, channel] : definitions_.channels) group.push_back(content_of(channel));
  add_summary_group(Op::channel, group, summary, offsets);

  Bytes statistics;
  FieldWriter counts(statistics);
  counts.number(messages_);
  counts.number(static_cast<u16>(definitions_.schemas.size()));
  counts.number(static_cast<u32>(definitions_.channels.size()));
  counts.number(static_cast<u32>(attachments_.size()));
  counts.number(static_cast<u32>(metadata_.size()));
  counts.number(static_cast<u32>(chunks_.size()));
  counts.number(first_time_);
  counts.number(last_time_);
  counts.number(static_cast<u32>(10 * message_counts_.size()));
  for (const auto& [channel, messages] : message_counts_) {
    counts.number(channel);
    counts.number(messages);
  }
  add_summary_group(Op::statistics, {statistics}, summary, offsets);

  group.clear();
  for (const ChunkPlace& chunk : chunks_) {
    FieldWriter fields(group.emplace_back());
    fields.number(chunk.start_time);
    fields.number(chunk.end_time);
    fields.number(chunk.offset);
    fields.number(chunk.length);
    fields.number(static_cast<u32>(10 * chunk.indexes.size()));
    for (const auto& [channel, at] : chunk.indexes) {
      fields.number(channel);
      fields.number(at);
    }
    fields.number(chunk.index_length);
    fields.string(chunk.compression);
    fields.number(chunk.compressed);
    fields.number(chunk.uncompressed);
  }
  add_summary_group(Op::chunk_index, group, summary, offsets);
  group.clear();
  for (const SidePlace& attachment : attachments_) {
    FieldWriter fields(group.emplace_back());
    fields.number(attachment.offset);
    fields.number(attachment.length);
    fields.number(attachment.log_time);
    fields.number(u64{0});
    fields.number(attachment.size);
    fields.string(attachment.name);
    fields.string(attachment.media_type);
  }
  add_summary_group(Op::attachment_index, group, summary, offsets);
  group.clear();
  for (const SidePlace& metadata : metadata_) {
    FieldWriter fields(group.emplace_back());
    fields.number(metadata.offset);
    fields.number(metadata.length);
    fields.string(metadata.name);
  }
  add_summary_group(Op::metadata_index, group, summary, offsets);

  const u64 offsets_start = offset_ + summary.size();
  summary.insert(summary.end(), offsets.begin(), offsets.end());
  FieldWriter footer(summary);
  footer.number(static_cast<u8>(Op::footer));
  footer.number(u64{20});
  footer.number(offset_);
  footer.number(offsets_start);
  footer.number(crc_of(summary.data(), summary.size()));
  return summary;
}

void Writer::finish() {
  end_chunk();
  Bytes data_end;
  FieldWriter(data_end).number(crc_);
  // Not by put_record: the file is not to be cut back to here.
  Bytes record;
  append_record(Op::data_end, data_end, record);
  put(record.data(), record.size());
  const Bytes end = summary();
  put(end.data(), end.size());
  put(kMagic.data(), kMagic.size());
  sync();
  const int closed = close(file_);
  file_ = -1;
  if (closed != 0) fail("closing the recording", errno);
}

}  // namespace berth::mcap
