#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "berth/detector.hpp"
#include "frame/marker_plan.hpp"
#include "frame/quads.hpp"

namespace berth {

class DiscFinder;

/// One search's results on the host: in the device's memory where the host reaches it, downloaded otherwise.
class SearchResult {
 public:
  /// `with_points`: the contours' points too.
  SearchResult(const MarkerSearch& search, bool with_points);
  void download(Stream& stream);

  /// How many slots the frame has filled, and how many there are.
  int slots() const;
  int capacity() const { return search_.geometry.max_contours; }
  /// Whether slot i holds a quadrilateral; `found` tells whether it has four corners.
  bool quad(int i, QuadCandidate& candidate, bool& found) const;
  /// Gives the outlines of dark regions to `finder`; only where the points are there.
  void add_outlines(DiscFinder& finder) const;
  void note_capacities(CapacityUse* use) const;
  std::size_t host_bytes() const { return (contours_.size() + quads_.size() + edges_.size() + points_.size()) * 4; }

 private:
  const u32* header() const;

  const MarkerSearch& search_;
  std::vector<u32> contours_;
  std::vector<s32> quads_;
  std::vector<s32> edges_;
  std::vector<u32> points_;
};

/// The device's part of a Detector: the plan, its stream, and where one frame's pixels and results lie. Several on one
/// backend have as many frames in flight. All memory is taken in the constructor.
class DeviceFrame {
 public:
  /// Runs an empty frame first where there is a driver, which may finish compiling only then. Throws Error as Detector.
  DeviceFrame(Backend& backend, int width, int height, const DetectorConfig& config);
  DeviceFrame(const DeviceFrame&) = delete;
  DeviceFrame& operator=(const DeviceFrame&) = delete;

  const MarkerGeometry& geometry() const { return plan_.geometry(); }
  /// Where the next frame is written, padded as pad_frame does: u8[padded_height, padded_width].
  u8* pixels() { return staging_.empty() ? static_cast<u8*>(plan_.frame().host()) : staging_.data(); }
  /// The frame as it was written, without its padding.
  View2D<const u8> image();

  /// Enqueues what was written to pixels(), which then stays untouched until finish.
  void submit();
  /// Waits for the frame. Returns false when the device was lost.
  bool finish();
  /// Runs the plan on whatever the buffers hold, for this thread's first touch of what operations keep by thread.
  bool warm_up();

  const std::vector<SearchResult>& searches() const { return searches_; }
  /// From submit until the device was done, as far as the host has seen: where work is done while it is enqueued, the
  /// end of submit, else that of finish. ns, monotonic.
  std::int64_t submitted_ns() const { return submitted_ns_; }
  std::int64_t done_ns() const { return done_ns_; }

  MarkerPlan& plan() { return plan_; }
  Stream& stream() { return *stream_; }
  std::size_t device_bytes() const { return plan_.device_bytes(); }
  std::size_t host_bytes() const;

 private:
  MarkerPlan plan_;
  std::unique_ptr<Stream> stream_;
  std::vector<u8> staging_;  // empty where the host reaches the device's memory
  std::vector<SearchResult> searches_;
  std::int64_t submitted_ns_ = 0, done_ns_ = 0;
};

/// The host's part of a Detector: codes, corners, poses. One frame at a time, whichever device it comes from. Allocates
/// nothing but digests once it is made.
class HostFinish {
 public:
  /// Throws Error on an unknown family, a bundle that does not hold or a bad configuration.
  HostFinish(int width, int height, const DetectorConfig& config);
  ~HostFinish();
  HostFinish(HostFinish&&) noexcept;
  HostFinish& operator=(HostFinish&&) noexcept;

  /// A result with room for all that a frame may hold.
  void reserve(const DeviceFrame& frame, FrameResult& result);
  /// Makes the result of a frame that has arrived, its stamp left alone.
  void finish(DeviceFrame& frame, FrameResult& result);
  /// The result of a frame whose device was lost.
  static void give_up(FrameResult& result);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
