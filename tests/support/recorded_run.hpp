#pragma once

#include <string>
#include <vector>

#include "frame_json.hpp"
#include "recording/cdr_reader.hpp"
#include "recording/mcap_reader.hpp"
#include "support/scratch_folder.hpp"

namespace berth::test {

/// The scenario of a run to be recorded: a marker closed in on, small and quick. `more` of the [camera].
inline std::string small_scenario(const ScratchFolder& folder, int frames, const std::string& more = "") {
  return folder.write("s.toml",
                      "seed = 5\n[camera]\nwidth = 160\nheight = 120\nframe_rate_hz = 100\nreadout_ms = 2\n" + more +
                          "[trajectory]\nkind = \"approach\"\nframes = " + std::to_string(frames) +
                          "\nfrom_range_m = 0.6\nto_range_m = 0.4\nto_offset_m = [0.0, 0.0]\n"
                          "[[marker]]\nfamily = \"tag36h11\"\nid = 3\nsize_m = 0.1\nposition_m = [0, 0, 0]\n");
}

/// The frames' records of a recording.
inline std::vector<cli::Json> records_of(const std::string& path) {
  std::vector<cli::Json> records;
  mcap::Reader reader(path);
  while (const mcap::Message* message = reader.next()) {
    if (reader.channels().at(message->channel).topic != "/berth/record") continue;
    CdrReader fields(message->data, message->size);
    records.push_back(cli::Json::parse(fields.string()));
  }
  return records;
}

}  // namespace berth::test
