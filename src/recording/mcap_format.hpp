#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "berth/types.hpp"

// What MCAP files are made of (https://mcap.dev/spec): every record is an opcode, the length of its content in 8 bytes,
// and the content; numbers are little-endian, strings carry their length in 4 bytes.
namespace berth::mcap {

using u16 = std::uint16_t;
using Bytes = std::vector<u8>;

inline constexpr std::array<u8, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
/// An opcode and the length of what follows.
inline constexpr std::size_t kRecordHead = 9;

enum class Op : u8 {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  attachment = 0x09,
  attachment_index = 0x0a,
  statistics = 0x0b,
  metadata = 0x0c,
  metadata_index = 0x0d,
  summary_offset = 0x0e,
  data_end = 0x0f,
};

struct Schema {
  u16 id = 0;
  std::string name, encoding, text;
};

struct Channel {
  u16 id = 0;
  /// 0: none.
  u16 schema = 0;
  std::string topic, encoding;
  std::map<std::string, std::string> metadata;
};

/// A message; its bytes belong to whoever gave it.
struct Message {
  u16 channel = 0;
  u32 sequence = 0;
  /// ns.
  u64 log_time = 0, publish_time = 0;
  const u8* data = nullptr;
  std::size_t size = 0;
};

/// Bytes that stand in the file beside the messages.
struct Attachment {
  std::string name, media_type;
  Bytes data;
};

struct Metadata {
  std::string name;
  std::map<std::string, std::string> values;
};

/// Appends to bytes what MCAP's fields are.
class FieldWriter {
 public:
  explicit FieldWriter(Bytes& to) : to_(to) {}

  template <class Unsigned>
  void number(Unsigned value) {
    for (std::size_t i = 0; i < sizeof value; ++i) to_.push_back(static_cast<u8>(value >> 8 * i));
  }
  void bytes(const u8* data, std::size_t size) { to_.insert(to_.end(), data, data + size); }
  void string(const std::string& text) {
    number(static_cast<u32>(text.size()));
    bytes(reinterpret_cast<const u8*>(text.data()), text.size());
  }
  void map(const std::map<std::string, std::string>& values) {
    std::size_t size = 0;
    for (const auto& [key, value] : values) size += 8 + key.size() + value.size();
    number(static_cast<u32>(size));
    for (const auto& [key, value] : values) {
      string(key);
      string(value);
    }
  }

 private:
  Bytes& to_;
};

/// Reads MCAP's fields from bytes that may be anything: past their end everything is 0 or empty, and ok() is false from
/// then on.
class FieldReader {
 public:
  FieldReader(const u8* data, std::size_t size) : at_(data), left_(size) {}

  bool ok() const { return ok_; }
  std::size_t left() const { return left_; }
  const u8* rest() const { return at_; }

  template <class Unsigned>
  Unsigned number() {
    const u8* const from = take(sizeof(Unsigned));
    Unsigned value = 0;
    for (std::size_t i = 0; from != nullptr && i < sizeof value; ++i) {
      value = static_cast<Unsigned>(value | static_cast<Unsigned>(from[i]) << 8 * i);
    }
    return value;
  }
  /// Null when there are not so many.
  const u8* take(u64 size) {
    if (size > left_) {
      ok_ = false;
      left_ = 0;
      return nullptr;
    }
    const u8* const from = at_;
    at_ += size;
    left_ -= static_cast<std::size_t>(size);
    return from;
  }
  std::string string() {
    const u32 size = number<u32>();
    const u8* const from = take(size);
    return from == nullptr ? std::string() : std::string(reinterpret_cast<const char*>(from), size);
  }
  std::map<std::string, std::string> map() {
    const u32 size = number<u32>();
    const u8* const from = take(size);
    std::map<std::string, std::string> values;
    if (from == nullptr) return values;
    FieldReader inner(from, size);
    while (inner.ok() && inner.left() > 0) {
      std::string key = inner.string();
      values[std::move(key)] = inner.string();
    }
    ok_ = ok_ && inner.ok();
    return values;
  }

 private:
  const u8* at_;
  std::size_t left_;
  bool ok_ = true;
};

/// A record as it stands among those of a chunk.
struct Record {
  Op op = Op::header;
  const u8* content = nullptr;
  std::size_t size = 0;
};

/// Takes the next record off the front. False at the end, and where what is left is damaged and holds none.
inline bool next_record(FieldReader& records, Record& record) {
  if (records.left() < kRecordHead) return false;
  record.op = static_cast<Op>(records.number<u8>());
  record.size = records.number<u64>();
  record.content = records.take(record.size);
  return record.content != nullptr;
}

/// Its bytes stay where they are.
inline Message message_of(FieldReader& fields) {
  Message message;
  message.channel = fields.number<u16>();
  message.sequence = fields.number<u32>();
  message.log_time = fields.number<u64>();
  message.publish_time = fields.number<u64>();
  message.data = fields.rest();
  message.size = fields.left();
  return message;
}

inline Schema schema_of(FieldReader& fields) {
  Schema schema;
  schema.id = fields.number<u16>();
  schema.name = fields.string();
  schema.encoding = fields.string();
  schema.text = fields.string();
  return schema;
}

inline Channel channel_of(FieldReader& fields) {
  Channel channel;
  channel.id = fields.number<u16>();
  channel.schema = fields.number<u16>();
  channel.topic = fields.string();
  channel.encoding = fields.string();
  channel.metadata = fields.map();
  return channel;
}

/// The schemas and channels of a file, by their ids. Of several with one id the first holds: the format has them be the
/// same.
struct Definitions {
  std::map<u16, Schema> schemas;
  std::map<u16, Channel> channels;

  /// Takes in what a record defines. False where it is damaged; true, and nothing, of other records.
  bool take(Op op, FieldReader fields) {
    if (op == Op::schema) {
      Schema schema = schema_of(fields);
      if (fields.ok()) schemas.emplace(schema.id, std::move(schema));
    } else if (op == Op::channel) {
      Channel channel = channel_of(fields);
      if (fields.ok()) channels.emplace(channel.id, std::move(channel));
    }
    return fields.ok();
  }
};

}  // namespace berth::mcap
