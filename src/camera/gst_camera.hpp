#pragma once

#include <string>
#include <vector>

#include "camera/live_camera.hpp"

namespace berth {

/// A pipeline of GStreamer's as a camera.
struct GstOptions {
  /// As gst-launch-1.0 takes it, without a sink at its end.
  std::string pipeline;
  /// What its camera exposes a frame for, µs; 0: not known.
  int exposure_us = 0;
  /// Frames that are held meanwhile; the oldest makes room.
  int buffers = 4;
  int watchdog_ms = 1000;
  /// LiveOptions::repeats: decoders give the same picture again where nothing moves.
  bool repeats = true;
};

/// Options of a source's name without "gst:": "[KEY=VALUE[,KEY=VALUE...];]PIPELINE". Throws Error that names the key,
/// its value and the remedy.
GstOptions parse_gst(const std::string& text);

/// What the source is called: "gst:" and the pipeline's first element.
std::string name_of(const GstOptions& options);

/// GStreamer's names of the pixel formats that can be read.
std::vector<std::string> gst_formats();

/// Builds the pipeline, plays it and waits for its first frame. What it throws begins with name_of(options) and ": ",
/// also where Berth was built without GStreamer.
LiveCameraOpener gst_opener(const GstOptions& options);

}  // namespace berth
