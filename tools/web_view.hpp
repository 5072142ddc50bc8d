#pragma once

#include <memory>
#include <string>

#include "frame_observer.hpp"

namespace berth::cli {

/// A run to be watched in a browser, or told afterwards as a page.
struct WebOptions {
  bool is_viewed = false;
  /// As parse_web_address takes it; empty for 127.0.0.1:8040.
  std::string address;
  /// A file whose first line lets viewers end the run; empty: they only read.
  std::string token_file;
  /// A page that is written when the run is over; empty for none.
  std::string report;
  /// As the command line names the source.
  std::string source;
  bool is_filtered = false;
};

/// The live view (docs/live-view.md): what the stream's thread does for it is to copy, now and then, a picture and some
/// numbers. `end_run` is called from another thread. Throws Error, when the address or the token cannot be had too, and
/// in a build without the view.
std::shared_ptr<FrameObserver> make_web_view(const WebOptions& options, std::ostream& people,
                                             std::function<void()> end_run);
/// The report, written by finish. Throws Error in a build without the view.
std::shared_ptr<FrameObserver> make_web_report(const WebOptions& options);

}  // namespace berth::cli
