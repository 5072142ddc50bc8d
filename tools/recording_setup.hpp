#pragma once

#include <string>

#include "recording/mcap_reader.hpp"
#include "recording_file.hpp"
#include "stream.hpp"

namespace berth::cli {

/// All of a run's options that its results depend on, with the files that they name. Throws Error where one cannot be
/// read.
RecordingSetup describe_run(const StreamOptions& options, const std::string& source_name);

/// A folder for a recording's files, which goes with it.
class RestoredFiles {
 public:
  /// Throws Error.
  RestoredFiles();
  ~RestoredFiles();
  RestoredFiles(const RestoredFiles&) = delete;
  RestoredFiles& operator=(const RestoredFiles&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// A recorded run's options, its files written into that folder. The backend is the one that it ran on. `path`: for
/// messages. Throws Error where the recording is none of Berth's or what it says makes no sense.
StreamOptions restore_run(const mcap::Reader& recording, const std::string& path, const std::string& folder);

}  // namespace berth::cli
