#pragma once

#include <memory>
#include <string>

#include "frame_json.hpp"
#include "web_feed.hpp"
#include "web_messages.hpp"

namespace berth::cli {

/// What a server hands out of a recording; from any thread. Numbers are frames', in the file's order from 0.
class WebRecording {
 public:
  virtual ~WebRecording() = default;
  virtual std::size_t frames() const = 0;
  /// Times and samples of frames from that number on, as far as they have been read, and what is known of the whole.
  virtual Json track(std::size_t from) const = 0;
  /// All that is told of one frame. Throws Error where it is damaged.
  virtual Json frame(std::size_t number) = 0;
  /// Its picture with what is drawn on it; null where it was recorded without. Throws Error where it is damaged.
  virtual std::shared_ptr<const WebPicture> picture(std::size_t number) = 0;
};

/// A recording of `berth run`, opened by its index or, where it has none, by reading all of it. Frames can be had at
/// once; a thread of its own reads them all, once, for what is shown of the whole. Chunks are held one at a time.
class RecordedRun : public WebRecording {
 public:
  /// Throws Error where it is none, or has no frame.
  static std::unique_ptr<RecordedRun> open(const std::string& path);
  /// With `recording`: frames, and what is missing of the file in words, or null.
  virtual Json about() const = 0;
  /// What is missing of the file, in words; empty where it is whole and has its index.
  virtual const std::string& lack() const = 0;
};

}  // namespace berth::cli
