// Whatever bytes a recording holds: reading it ends, and touches no memory but its own. Recovering it makes a whole
// file.
#include <string>

#include "berth/error.hpp"
#include "fuzz/targets.hpp"
#include "recording/cdr_reader.hpp"
#include "recording/mcap_index.hpp"
#include "recording/mcap_reader.hpp"
#include "recording/recover.hpp"
#include "support/memory_file.hpp"

namespace berth::fuzz {

void recording_file(const u8* bytes, std::size_t count) {
  // Behind the magic everything is open: nothing is gained by guessing that.
  std::string content(mcap::kMagic.begin(), mcap::kMagic.end());
  content.append(reinterpret_cast<const char*>(bytes), count);
  test::MemoryFile file, saved;
  file.fill(content);
  mcap::Reader reader(file.path());
  while (const mcap::Message* message = reader.next()) {
    CdrReader fields(message->data, message->size);
    while (fields.ok()) fields.string();
    reader.schema_of_channel(message->channel);
  }
  const mcap::IndexedFile index(file.path(), [](const std::string&) { return true; });
  mcap::ChunkCodec codec;
  mcap::Bytes raw, records;
  for (std::size_t i = 0; i < index.chunks().size(); ++i) {
    if (!index.read_chunk(i, codec, raw, records).empty()) continue;
    for (const auto& [channel, places] : index.chunks()[i].messages) {
      for (const u64 place : places) mcap::message_at(records, place);
    }
  }
  try {
    mcap::recover(file.path(), saved.path(), "fuzz");
  } catch (const Error&) {
    return;  // nothing whole in it
  }
  const mcap::Recovery again = mcap::examine(saved.path());
  require(again.whole && again.messages > 0, "what was recovered is a whole file");
}

}  // namespace berth::fuzz
