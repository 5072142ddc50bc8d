#include "recording/mcap_records.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "berth/error.hpp"

namespace berth::mcap {
namespace {

/// Of a chunk's records, as kMostRecord.
constexpr u64 kMostChunk = u64{256} << 20;
/// A chunk's fields without the compression's name and the data.
constexpr u64 kChunkFields = 8 + 8 + 8 + 4 + 4 + 8;

std::string at_byte(u64 offset) { return "at byte " + std::to_string(offset); }

bool read_chunk(FieldReader& fields, Chunk& chunk) {
  fields.number<u64>();
  fields.number<u64>();
  chunk.records_size = fields.number<u64>();
  chunk.crc = fields.number<u32>();
  chunk.compression = fields.string();
  const u64 size = fields.number<u64>();
  chunk.data = fields.take(size);
  chunk.size = static_cast<std::size_t>(size);
  return fields.ok();
}

}  // namespace

RecordScan::RecordScan(const std::string& path) : file_(std::fopen(path.c_str(), "rb")) {
  struct stat status = {};
  if (!file_ || fstat(fileno(file_.get()), &status) != 0) {
    throw Error(path + ": the recording cannot be read (" + std::strerror(errno) +
                "); check the name and its permissions");
  }
  if (!S_ISREG(status.st_mode)) throw Error(path + ": no regular file; name an MCAP file");
  size_ = static_cast<u64>(status.st_size);
  std::array<u8, kMagic.size()> magic = {};
  if (size_ < magic.size()) {
    throw Error(path + ": " + std::to_string(size_) + " bytes are too few for an MCAP file; nothing was recorded");
  }
  if (!read_at(0, magic.data(), magic.size()) || magic != kMagic) {
    throw Error(path + ": it does not begin as MCAP files do; name a recording");
  }
  at_ = whole_ = kMagic.size();
  crc_ = crc_of(magic.data(), magic.size());
}

bool RecordScan::read_at(u64 offset, u8* to, std::size_t size) {
  // Records mostly follow each other: no seek drops what is buffered.
  if (static_cast<u64>(ftello(file_.get())) != offset &&
      fseeko(file_.get(), static_cast<off_t>(offset), SEEK_SET) != 0) {
    return false;
  }
  return std::fread(to, 1, size, file_.get()) == size;
}

bool RecordScan::next(Problems& problems) {
  while (!complete_ && at_ < size_) {
    std::array<u8, kRecordHead> head = {};
    const u64 left = size_ - at_;
    u64 length = 0;
    bool fits = left >= head.size() && read_at(at_, head.data(), head.size());
    if (fits) {
      FieldReader fields(head.data(), head.size());
      op_ = static_cast<Op>(fields.number<u8>());
      length = fields.number<u64>();
      fits = op_ != Op{} && length <= left - head.size();
    }
    if (!fits) {
      const u64 from = at_;
      if (data_ended_ || !find_chunk()) {
        at_ = size_;
        return false;
      }
      problems.add("bytes " + std::to_string(from) + " to " + std::to_string(at_) + " are damaged and passed over");
      continue;
    }
    offset_ = at_;
    at_ += head.size() + length;
    if (!data_ended_) whole_ = at_;
    if (length > kMostRecord) {
      problems.add("the record " + at_byte(offset_) + " is of " + std::to_string(length) + " bytes and passed over");
      continue;
    }
    content_.resize(static_cast<std::size_t>(length));
    if (!read_at(offset_ + head.size(), content_.data(), content_.size())) {
      problems.add("the record " + at_byte(offset_) + " cannot be read from the disk");
      at_ = size_;
      return false;
    }
    check_sum(head, problems);
    std::array<u8, kMagic.size()> magic = {};
    complete_ =
        op_ == Op::footer && size_ - at_ == magic.size() && read_at(at_, magic.data(), magic.size()) && magic == kMagic;
    return true;
  }
  return false;
}

void RecordScan::check_sum(const std::array<u8, kRecordHead>& head, Problems& problems) {
  const bool ends_summary = op_ == Op::footer, ends = op_ == Op::data_end || ends_summary;
  // The footer's own sum is of its first fields, too.
  constexpr std::size_t kFooterSummed = 16;
  if (ends_summary && content_.size() >= kFooterSummed) {
    crc_ = crc_of(content_.data(), kFooterSummed, crc_of(head.data(), head.size(), crc_));
  }
  if (!ends) {
    crc_ = crc_of(content_.data(), content_.size(), crc_of(head.data(), head.size(), crc_));
    return;
  }
  FieldReader fields(content_.data(), content_.size());
  if (ends_summary) fields.take(kFooterSummed);
  const u32 said = fields.number<u32>();
  // 0: the writer took none. What was told already need not be told again.
  if (said != 0 && said != crc_ && problems.count() == 0) {
    problems.add(std::string(ends_summary ? "the summary's" : "the data's") + " checksum does not hold: bytes before " +
                 std::to_string(at_) + " are damaged");
  }
  if (op_ == Op::data_end) {
    data_ended_ = true;
    crc_ = 0;
  }
}

bool RecordScan::looks_like_chunk(u64 offset) {
  constexpr std::size_t kName = 4;  // "zstd"
  std::array<u8, kRecordHead + kChunkFields + kName> bytes = {};
  if (size_ - offset < bytes.size() || !read_at(offset, bytes.data(), bytes.size())) return false;
  FieldReader fields(bytes.data(), bytes.size());
  const Op op = static_cast<Op>(fields.number<u8>());
  const u64 length = fields.number<u64>();
  if (op != Op::chunk || length > size_ - offset - kRecordHead || length < kChunkFields) return false;
  fields.take(8 + 8 + 8 + 4);
  const u32 name = fields.number<u32>();
  if (name > kName) return false;
  fields.take(name);
  return fields.number<u64>() == length - kChunkFields - name;
}

bool RecordScan::find_chunk() {
  std::vector<u8> block(std::size_t{1} << 16);
  for (u64 from = at_ + 1; from < size_; from += block.size()) {
    const std::size_t count = static_cast<std::size_t>(std::min<u64>(block.size(), size_ - from));
    if (!read_at(from, block.data(), count)) return false;
    for (std::size_t i = 0; i < count; ++i) {
      // The length's upper bytes are 0 in every chunk there is room for: few places are looked at closely.
      const bool may_be = block[i] == static_cast<u8>(Op::chunk) && (i + 8 >= count || block[i + 8] == 0);
      if (may_be && looks_like_chunk(from + i)) {
        at_ = from + i;
        return true;
      }
    }
  }
  return false;
}

std::string open_chunk(const Bytes& content, ChunkCodec& codec, Chunk& chunk, Bytes& records) {
  FieldReader fields(content.data(), content.size());
  if (!read_chunk(fields, chunk)) return "its fields are damaged";
  if (chunk.records_size > kMostChunk) return "it claims " + std::to_string(chunk.records_size) + " bytes";
  std::string wrong = codec.decompress(chunk.compression, chunk.data, chunk.size,
                                       static_cast<std::size_t>(chunk.records_size), records);
  if (!wrong.empty()) return wrong;
  // 0: the writer took none.
  if (chunk.crc != 0 && crc_of(records.data(), records.size()) != chunk.crc) return "its checksum does not hold";
  return "";
}

bool read_attachment(const Bytes& content, Attachment& attachment) {
  FieldReader fields(content.data(), content.size());
  fields.number<u64>();
  fields.number<u64>();
  attachment.name = fields.string();
  attachment.media_type = fields.string();
  const u64 size = fields.number<u64>();
  const u8* const data = fields.take(size);
  const std::size_t summed = content.size() - fields.left();
  const u32 crc = fields.number<u32>();
  if (!fields.ok() || (crc != 0 && crc_of(content.data(), summed) != crc)) return false;
  attachment.data.assign(data, data + size);
  return true;
}

bool read_metadata(const Bytes& content, Metadata& metadata) {
  FieldReader fields(content.data(), content.size());
  metadata.name = fields.string();
  metadata.values = fields.map();
  return fields.ok();
}

}  // namespace berth::mcap
