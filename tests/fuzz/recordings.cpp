// Whatever bytes a recording holds: reading it ends, and touches no memory but its own. Recovering it makes a whole
// file.
#include <cstdlib>
#include <string>

#include "berth/error.hpp"
#include "recording/cdr_reader.hpp"
#include "recording/mcap_reader.hpp"
#include "recording/recover.hpp"
#include "support/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  // Behind the magic everything is open: nothing is gained by guessing that.
  std::string bytes(berth::mcap::kMagic.begin(), berth::mcap::kMagic.end());
  bytes.append(reinterpret_cast<const char*>(data), size);
  berth::test::MemoryFile file, saved;
  file.fill(bytes);
  berth::mcap::Reader reader(file.path());
  while (const berth::mcap::Message* message = reader.next()) {
    berth::CdrReader fields(message->data, message->size);
    while (fields.ok()) fields.string();
    reader.schema_of_channel(message->channel);
  }
  try {
    berth::mcap::recover(file.path(), saved.path(), "fuzz");
  } catch (const berth::Error&) {
    return 0;  // nothing whole in it
  }
  const berth::mcap::Recovery again = berth::mcap::examine(saved.path());
  if (!again.whole || again.messages == 0) std::abort();
  return 0;
}
