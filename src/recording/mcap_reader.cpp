#include "recording/mcap_reader.hpp"

namespace berth::mcap {
namespace {

constexpr std::size_t kMostAttachment = std::size_t{16} << 20;

template <class Named>
const Named* find_named(const std::vector<Named>& all, const std::string& name) {
  for (const Named& one : all) {
    if (one.name == name) return &one;
  }
  return nullptr;
}

}  // namespace

Reader::Reader(const std::string& path) : scan_(path) { ahead_ = advance(); }

const Schema* Reader::schema_of_channel(u16 channel) const {
  const auto known = definitions_.channels.find(channel);
  if (known == definitions_.channels.end()) return nullptr;
  const auto schema = definitions_.schemas.find(known->second.schema);
  return schema == definitions_.schemas.end() ? nullptr : &schema->second;
}

const Metadata* Reader::find_metadata(const std::string& name) const { return find_named(metadata_, name); }
const Attachment* Reader::find_attachment(const std::string& name) const { return find_named(attachments_, name); }

void Reader::take_side_record() {
  const Bytes& content = scan_.content();
  bool whole = definitions_.take(scan_.op(), {content.data(), content.size()});
  if (scan_.op() == Op::metadata) {
    whole = read_metadata(content, metadata_.emplace_back());
    if (!whole) metadata_.pop_back();
  } else if (scan_.op() == Op::attachment && content.size() <= kMostAttachment) {
    whole = read_attachment(content, attachments_.emplace_back());
    if (!whole) attachments_.pop_back();
  }
  if (!whole) problems_.add("the record at byte " + std::to_string(scan_.offset()) + " is damaged");
}

bool Reader::advance() {
  records_.clear();
  at_ = 0;
  while (scan_.next(problems_)) {
    loose_ = scan_.op() == Op::message;
    if (loose_) return true;
    if (scan_.op() != Op::chunk) {
      take_side_record();
      continue;
    }
    Chunk chunk;
    const std::string wrong = open_chunk(scan_.content(), codec_, chunk, records_);
    if (wrong.empty()) return true;
    problems_.add("the chunk at byte " + std::to_string(scan_.offset()) + " is passed over: " + wrong);
    records_.clear();
  }
  return false;
}

const Message* Reader::take_message(FieldReader fields) {
  message_ = message_of(fields);
  return fields.ok() ? &message_ : nullptr;
}

const Message* Reader::next() {
  for (;; ahead_ = advance()) {
    if (!ahead_) return nullptr;
    if (loose_) {
      if (at_++ > 0) continue;
      const Bytes& content = scan_.content();
      if (const Message* message = take_message({content.data(), content.size()})) return message;
      continue;
    }
    FieldReader left(records_.data() + at_, records_.size() - at_);
    for (Record record; next_record(left, record);) {
      at_ = records_.size() - left.left();
      FieldReader fields(record.content, record.size);
      if (record.op == Op::message) {
        if (const Message* message = take_message(fields)) return message;
      } else {
        definitions_.take(record.op, fields);
      }
    }
    if (at_ < records_.size()) problems_.add("the chunk at byte " + std::to_string(scan_.offset()) + " ends in damage");
  }
}

}  // namespace berth::mcap
