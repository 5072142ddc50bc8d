#pragma once

#include <map>
#include <string>

#include "recording/mcap_records.hpp"

namespace berth::mcap {

/// What of a file is whole.
struct Recovery {
  /// Nothing is missing or damaged, the summary included.
  bool whole = false;
  u64 file_bytes = 0;
  /// Where the last whole record ends; behind it, nothing can be read.
  u64 whole_bytes = 0;
  u64 chunks = 0, messages = 0;
  std::map<std::string, u64> messages_by_topic;
  /// Chunks and records that are damaged in the midst of what can be read, and are left out.
  Problems problems;
};

/// Reads a file to its end, checksums included. Throws Error where it cannot be read or is no MCAP file.
Recovery examine(const std::string& path);

/// Writes all that is whole of a file to another, as a whole file: attachments, metadata, every whole chunk as it is,
/// with new indexes and a new summary. `library`: who says so in its header. Throws Error as examine, where nothing can
/// be saved, where `out` is `path` by another name, and where it cannot be written.
Recovery recover(const std::string& path, const std::string& out, const std::string& library);

}  // namespace berth::mcap
