#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "berth/detector.hpp"
#include "frame/search_area.hpp"

namespace berth {

/// The device's part of a Detector: the plan, its stream, and where one frame's pixels and results lie. Several on one
/// backend have as many frames in flight. All memory is taken in the constructor.
class DeviceFrame {
 public:
  /// Runs an empty frame first: drivers may finish compiling only then, and operations take what they work in.
  /// `keeps_stages`: what every window's plan writes stays until its next frame, for digests and comparisons; else
  /// windows share all that the host does not read. Throws Error as Detector.
  DeviceFrame(Backend& backend, int width, int height, const DetectorConfig& config, bool keeps_stages);
  DeviceFrame(const DeviceFrame&) = delete;
  DeviceFrame& operator=(const DeviceFrame&) = delete;

  const MarkerGeometry& geometry() const { return whole_.plan.geometry(); }
  /// Where the next frame is written, padded as pad_frame does: u8[padded_height, padded_width].
  u8* pixels() { return whole_.pixels(); }
  /// The frame as it was written, without its padding.
  View2D<const u8> image();
  /// The frame that was submitted: image(), or what submit_windows was given.
  View2D<const u8> submitted() const { return submitted_; }

  /// Enqueues what was written to pixels(), which then stays untouched until finish.
  void submit();
  /// Enqueues these windows of a frame, which may be image(), and stays untouched until the host is done with it, too.
  /// Throws Error on windows that there are not or that do not lie in the frame as they must.
  void submit_windows(View2D<const u8> frame, const std::vector<SearchWindow>& windows);
  /// Waits for the frame. Returns false when the device was lost.
  bool finish();

  /// What was submitted last: the whole frame, or windows.
  const std::vector<SearchArea*>& areas() const { return areas_; }
  bool is_whole(const SearchArea& area) const { return &area == &whole_; }
  /// The most quadrilaterals that one of the areas, and a whole frame or all windows together, can hold.
  std::size_t most_in_area() const;
  std::size_t most_in_frame() const;
  /// The same where no more windows, and no more pixels in them, are searched at a time.
  std::size_t most_in_frame(int most_windows, double most_pixels) const;
  /// From submit until the device was done, as far as the host has seen: where work is done while it is enqueued, the
  /// end of submit, else that of finish. ns, monotonic.
  std::int64_t submitted_ns() const { return submitted_ns_; }
  std::int64_t done_ns() const { return done_ns_; }

  Stream& stream() { return *stream_; }
  std::size_t device_bytes() const;
  std::size_t host_bytes() const;
  /// Adds what no frame writes, as far as the host reaches it.
  void list_constants(std::vector<ConstantMemory>& to) const;

 private:
  bool warm_up();
  void make_windows(Backend& backend, const DetectorConfig& config, bool keeps_stages);
  SearchArea& free_area(const SearchWindow& window);
  void end_submit();

  SearchArea whole_;
  std::optional<ScratchBuffers> scratch_;  // the windows'
  std::vector<std::unique_ptr<SearchArea>> windows_;
  std::optional<FrameLevels> levels_;  // where there are windows
  std::vector<SearchArea*> areas_;
  View2D<const u8> submitted_;
  std::unique_ptr<Stream> stream_;
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

  /// A result with room for `most` quadrilaterals: all that a frame may hold.
  void reserve(const DeviceFrame& frame, FrameResult& result) { reserve(frame, result, frame.most_in_frame()); }
  void reserve(const DeviceFrame& frame, FrameResult& result, std::size_t most);
  /// Makes the result of a frame that has arrived, its stamp left alone.
  void finish(DeviceFrame& frame, FrameResult& result);
  /// Adds the configuration and the tables that codes are found by.
  void list_constants(std::vector<ConstantMemory>& to) const;
  /// The result of a frame whose device was lost.
  static void give_up(FrameResult& result);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
