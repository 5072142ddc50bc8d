#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/frame.hpp"
#include "berth/image.hpp"
#include "berth/marker.hpp"

namespace berth {

/// A marker that a simulated frame shows, as it truly is.
struct TruthMarker {
  std::string family;
  int id = 0;
  double size_m = 0;
  /// Marker frame to camera frame, at mid-exposure.
  Pose pose;
  /// Paper's order (upper left of the upright marker first, counter-clockwise), px, pixel centres at integers.
  std::array<std::array<double, 2>, 4> corners = {};
  /// Share of the marker's area (quiet zone included) that is inside the image and not occluded, 0…1.
  double visible = 1;
};

/// A target of discs that a simulated frame shows, as it truly is.
struct TruthTarget {
  std::string name;
  /// Target frame to camera frame, at mid-exposure.
  Pose pose;
};

/// One frame of a source.
struct SourceFrame {
  GrayImage image;
  FrameStamp stamp;
  /// File name, or the source's own label for the frame.
  std::string label;
  /// Only simulated sources know.
  std::vector<TruthMarker> truth;
  std::vector<TruthTarget> truth_targets;
};

/// What a camera has been through since it was opened.
struct SourceHealth {
  /// Frames that the camera or its driver has taken and not handed over, by their sequence numbers.
  u64 lost = 0;
  /// Frames with data missing; they are never handed on.
  u64 incomplete = 0;
  /// Frames that were older than another one already there when they were to be handed on.
  u64 skipped = 0;
  /// Frames whose time is the last one's, or whose picture is to the last bit; they are not handed on.
  u64 repeated = 0;
  /// Frames whose time runs backwards or is ahead of what it can be; they are not handed on.
  u64 misdated = 0;
  /// Times the camera was opened again.
  u64 reopened = 0;
};

/// Where frames come from: `sim:FILE`, `dir:DIR`, `file:IMAGE`, `video:FILE`, `mcap:FILE`, `v4l2:CAMERA`,
/// `aravis:CAMERA`, `gst:PIPELINE`. Opened by the command and the Python module; an installed Berth has the interface
/// alone, for sources of one's own.
class Source {
 public:
  virtual ~Source() = default;
  /// The next frame, or none at the end. Throws Error on a frame that cannot be had; the next call goes on after it.
  virtual std::optional<SourceFrame> next() = 0;
  /// Frames in all, when known beforehand.
  virtual std::optional<std::size_t> size() const { return std::nullopt; }
  /// All 0 for files.
  virtual SourceHealth health() const { return {}; }
  /// The source's own camera, where it knows one (simulation).
  virtual std::optional<CameraModel> camera() const { return std::nullopt; }
};

}  // namespace berth
