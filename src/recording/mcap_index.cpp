#include "recording/mcap_index.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "berth/error.hpp"

namespace berth::mcap {
namespace {

/// Of the footer: its whole record; and what of it its checksum is of.
constexpr std::size_t kFooter = kRecordHead + 20, kFooterSummed = kRecordHead + 16;

}  // namespace

IndexedFile::IndexedFile(const std::string& path, const std::function<bool(const std::string&)>& wanted)
    : path_(path), wanted_(wanted) {
  // Complains of what is no recording, in the words of whoever else reads one.
  file_bytes_ = RecordScan(path).file_bytes();
  file_.number = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file_.number < 0) {
    throw Error(path + ": the recording cannot be read (" + std::strerror(errno) + "); check its permissions");
  }
  by_index_ = take_index();
  if (by_index_) {
    complete_ = true;
    whole_bytes_ = file_bytes_;
  } else {
    scan();
  }
}

IndexedFile::OpenFile::~OpenFile() {
  if (number >= 0) close(number);
}

bool IndexedFile::read_at(u64 offset, std::size_t size, Bytes& to) const {
  to.resize(size);
  std::size_t at = 0;
  while (at < size) {
    const ssize_t got = pread(file_.number, to.data() + at, size - at, static_cast<off_t>(offset + at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += static_cast<std::size_t>(got);
  }
  return true;
}

bool IndexedFile::take_index() {
  Bytes end;
  if (file_bytes_ < 2 * kMagic.size() + kFooter) return false;
  const u64 footer_at = file_bytes_ - kMagic.size() - kFooter;
  if (!read_at(footer_at, kFooter + kMagic.size(), end)) return false;
  if (!std::equal(kMagic.begin(), kMagic.end(), end.begin() + kFooter)) return false;
  FieldReader footer(end.data(), kFooter);
  const bool is_footer = static_cast<Op>(footer.number<u8>()) == Op::footer && footer.number<u64>() == 20;
  const u64 start = footer.number<u64>();
  footer.number<u64>();
  const u32 said = footer.number<u32>();
  if (!is_footer || start < kMagic.size() || start >= footer_at || footer_at - start > kMostRecord) return false;
  Bytes summary;
  if (!read_at(start, static_cast<std::size_t>(footer_at - start), summary)) return false;
  // 0: the writer took none.
  if (said != 0 && crc_of(end.data(), kFooterSummed, crc_of(summary.data(), summary.size())) != said) return false;
  FieldReader left(summary.data(), summary.size());
  bool whole = true;
  // Channels stand before the indexes of chunks, in which their numbers are looked for.
  for (Record record; whole && next_record(left, record);) {
    FieldReader fields(record.content, record.size);
    if (record.op == Op::chunk_index) {
      whole = take_chunk_index(fields, start);
    } else {
      definitions_.take(record.op, fields);
    }
  }
  if (whole && !chunks_.empty()) return true;
  chunks_.clear();
  definitions_ = {};
  return false;
}

bool IndexedFile::take_chunk_index(FieldReader& fields, u64 summary_start) {
  fields.number<u64>();
  fields.number<u64>();
  IndexedChunk chunk;
  chunk.offset = fields.number<u64>();
  chunk.size = fields.number<u64>();
  fields.take(fields.number<u32>());
  const u64 indexes = fields.number<u64>();
  const u64 room = chunk.offset < summary_start ? summary_start - chunk.offset : 0;
  if (!fields.ok() || chunk.size > room || indexes > room - chunk.size || indexes > kMostRecord) return false;
  // In the file's order, none twice: a short file can name no more than it has.
  if (chunk.offset < index_end_) return false;
  index_end_ = chunk.offset + chunk.size + indexes;
  Bytes bytes;
  if (!read_at(chunk.offset + chunk.size, static_cast<std::size_t>(indexes), bytes)) return false;
  FieldReader left(bytes.data(), bytes.size());
  for (Record record; next_record(left, record);) {
    FieldReader entries(record.content, record.size);
    const u16 id = entries.number<u16>();
    const auto channel = definitions_.channels.find(id);
    if (record.op != Op::message_index || channel == definitions_.channels.end()) return false;
    if (!wanted_(channel->second.topic)) continue;
    std::vector<u64>& places = chunk.messages[id];
    if (entries.number<u32>() != entries.left() || entries.left() % 16 != 0) return false;
    places.reserve(entries.left() / 16);
    while (entries.left() > 0) {
      entries.number<u64>();
      places.push_back(entries.number<u64>());
    }
  }
  if (left.left() > 0) return false;
  chunks_.push_back(std::move(chunk));
  return true;
}

void IndexedFile::scan() {
  RecordScan scan(path_);
  ChunkCodec codec;
  Bytes records;
  bool has_loose = false;
  while (scan.next(problems_)) {
    const Bytes& content = scan.content();
    definitions_.take(scan.op(), {content.data(), content.size()});
    has_loose = has_loose || scan.op() == Op::message;
    if (scan.op() != Op::chunk) continue;
    Chunk chunk;
    const std::string wrong = open_chunk(content, codec, chunk, records);
    if (!wrong.empty()) {
      problems_.add("the chunk at byte " + std::to_string(scan.offset()) + " is left out: " + wrong);
      continue;
    }
    IndexedChunk found;
    found.offset = scan.offset();
    found.size = kRecordHead + content.size();
    FieldReader left(records.data(), records.size());
    u64 at = 0;
    for (Record record; next_record(left, record); at = records.size() - left.left()) {
      FieldReader fields(record.content, record.size);
      definitions_.take(record.op, fields);
      if (record.op != Op::message) continue;
      const u16 id = fields.number<u16>();
      const auto channel = definitions_.channels.find(id);
      if (fields.ok() && channel != definitions_.channels.end() && wanted_(channel->second.topic))
        found.messages[id].push_back(at);
    }
    chunks_.push_back(std::move(found));
  }
  if (has_loose) problems_.add("messages outside of chunks are left out");
  complete_ = scan.complete();
  whole_bytes_ = scan.whole_bytes();
}

std::string IndexedFile::read_chunk(std::size_t chunk, ChunkCodec& codec, Bytes& raw, Bytes& records) const {
  const IndexedChunk& place = chunks_[chunk];
  const std::string which = "the chunk at byte " + std::to_string(place.offset) + ": ";
  if (place.size < kRecordHead || place.size > kMostRecord) return which + "its length makes no sense";
  Bytes head;
  if (!read_at(place.offset, kRecordHead, head) ||
      !read_at(place.offset + kRecordHead, static_cast<std::size_t>(place.size) - kRecordHead, raw)) {
    return which + "it cannot be read from the disk";
  }
  FieldReader fields(head.data(), head.size());
  if (static_cast<Op>(fields.number<u8>()) != Op::chunk || fields.number<u64>() != raw.size()) {
    return which + "no chunk begins there";
  }
  Chunk opened;
  const std::string wrong = open_chunk(raw, codec, opened, records);
  return wrong.empty() ? wrong : which + wrong;
}

std::optional<Message> message_at(const Bytes& records, u64 offset) {
  if (offset > records.size()) return std::nullopt;
  FieldReader from(records.data() + offset, records.size() - static_cast<std::size_t>(offset));
  Record record;
  if (!next_record(from, record) || record.op != Op::message) return std::nullopt;
  FieldReader fields(record.content, record.size);
  const Message message = message_of(fields);
  if (!fields.ok()) return std::nullopt;
  return message;
}

}  // namespace berth::mcap
