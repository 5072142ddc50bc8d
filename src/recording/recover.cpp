#include "recording/recover.hpp"

#include <filesystem>
#include <memory>
#include <system_error>

#include "berth/error.hpp"
#include "recording/mcap_writer.hpp"

namespace berth::mcap {
namespace {

/// Goes through a file, and copies what is whole of it where there is a writer.
class Walk {
 public:
  explicit Walk(const std::string& path) : scan_(path) {}

  Recovery run(Writer* to) {
    to_ = to;
    while (scan_.next(found_.problems)) take();
    found_.whole = scan_.complete() && found_.problems.count() == 0;
    found_.file_bytes = scan_.file_bytes();
    found_.whole_bytes = scan_.whole_bytes();
    return std::move(found_);
  }

 private:
  void take() {
    const Bytes& content = scan_.content();
    FieldReader fields(content.data(), content.size());
    bool damaged = false;
    switch (scan_.op()) {
      case Op::data_end:
        in_summary_ = true;
        break;
      case Op::schema:
        damaged = !take_schema(fields);
        break;
      case Op::channel:
        damaged = !take_channel(fields);
        break;
      case Op::message:
        damaged = !take_message(fields);
        break;
      case Op::chunk:
        take_chunk(content);
        break;
      case Op::attachment: {
        Attachment attachment;
        damaged = !read_attachment(content, attachment);
        const u64 log_time = FieldReader(content.data(), content.size()).number<u64>();
        if (!damaged && to_ != nullptr) to_->add(attachment, log_time);
        break;
      }
      case Op::metadata: {
        Metadata metadata;
        damaged = !read_metadata(content, metadata);
        if (!damaged && to_ != nullptr) to_->add(metadata);
        break;
      }
      default:
        // Indexes and summary are made anew.
        break;
    }
    if (damaged) found_.problems.add("the record at byte " + std::to_string(scan_.offset()) + " is damaged");
  }

  bool take_schema(FieldReader& fields) {
    const Schema schema = schema_of(fields);
    if (!fields.ok()) return false;
    if (definitions_.schemas.emplace(schema.id, schema).second && to_ != nullptr && !in_summary_) to_->add(schema);
    return true;
  }

  bool take_channel(FieldReader& fields) {
    const Channel channel = channel_of(fields);
    if (!fields.ok()) return false;
    if (definitions_.channels.emplace(channel.id, channel).second && to_ != nullptr && !in_summary_) to_->add(channel);
    return true;
  }

  bool take_message(FieldReader& fields) {
    const Message message = message_of(fields);
    if (!fields.ok()) return false;
    count(message.channel);
    // In a chunk of its own, or none would be found by an index.
    if (to_ != nullptr) {
      to_->write(message);
      to_->end_chunk();
    }
    return true;
  }

  void take_chunk(const Bytes& content) {
    Chunk chunk;
    const std::string wrong = open_chunk(content, codec_, chunk, records_);
    if (!wrong.empty()) {
      found_.problems.add("the chunk at byte " + std::to_string(scan_.offset()) + " is left out: " + wrong);
      return;
    }
    ++found_.chunks;
    FieldReader left(records_.data(), records_.size());
    for (Record record; next_record(left, record);) {
      FieldReader fields(record.content, record.size);
      if (record.op == Op::message) {
        const u16 channel = fields.number<u16>();
        if (fields.ok()) count(channel);
      } else {
        definitions_.take(record.op, fields);
      }
    }
    if (to_ != nullptr) to_->copy_chunk(chunk.compression, chunk.data, chunk.size, records_);
  }

  void count(u16 channel) {
    ++found_.messages;
    const auto known = definitions_.channels.find(channel);
    ++found_.messages_by_topic[known == definitions_.channels.end() ? "channel " + std::to_string(channel)
                                                                    : known->second.topic];
  }

  RecordScan scan_;
  ChunkCodec codec_;
  Writer* to_ = nullptr;
  Recovery found_;
  Bytes records_;
  Definitions definitions_;
  bool in_summary_ = false;
};

/// The header's profile; empty where it is cut or damaged.
std::string profile_of(const std::string& path) {
  RecordScan scan(path);
  Problems ignored;
  if (!scan.next(ignored) || scan.op() != Op::header) return "";
  FieldReader fields(scan.content().data(), scan.content().size());
  return fields.string();
}

}  // namespace

Recovery examine(const std::string& path) { return Walk(path).run(nullptr); }

Recovery recover(const std::string& path, const std::string& out, const std::string& library) {
  std::error_code error;
  if (std::filesystem::equivalent(path, out, error)) {
    throw Error(out + ": it is the recording itself; name another file");
  }
  Recovery found = examine(path);
  if (found.messages == 0) {
    throw Error(path + ": none of its " + std::to_string(found.file_bytes) +
                " bytes are of a whole chunk; there is nothing to recover");
  }
  Writer writer(out, profile_of(path), library);
  Walk(path).run(&writer);
  writer.finish();
  return found;
}

}  // namespace berth::mcap
