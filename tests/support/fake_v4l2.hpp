#pragma once

#include <linux/videodev2.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "berth/error.hpp"
#include "berth/types.hpp"
#include "camera/v4l2_device.hpp"

namespace berth::test {

/// A frame that the fake camera is going to give.
struct FakeFrame {
  std::vector<u8> bytes;
  std::uint32_t sequence = 0;
  std::int64_t time_us = 0;
  std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
};

/// A camera that is not there, and what it is: it outlives the devices opened on it.
struct FakeV4l2 {
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_GREY};
  std::uint32_t width = 4, height = 2, stride = 0;
  std::uint32_t buffer_bytes = 64;
  /// The size and rate it goes by, whatever it is asked; 0: what it is asked.
  std::uint32_t only_width = 0, only_rate = 0;
  std::map<std::uint32_t, int> controls = {{V4L2_CID_EXPOSURE_AUTO, 3}, {V4L2_CID_EXPOSURE_ABSOLUTE, 156}};
  std::deque<FakeFrame> frames;
  /// Given again and again once there is no other.
  std::optional<FakeFrame> endless;
  /// What waiting comes to when there is no frame.
  int when_empty = ETIMEDOUT;
  /// Opening fails while this is above 0, and counts it down.
  int closed_for = 0;
  /// A request that is answered with EINVAL.
  unsigned long refused = 0;

  std::uint32_t pixelformat = V4L2_PIX_FMT_YUYV;
  int opened = 0, most_held = 0;
  bool streaming = false;
};

class FakeV4l2Device final : public V4l2Device {
 public:
  explicit FakeV4l2Device(FakeV4l2& camera) : camera_(camera) { ++camera_.opened; }
  ~FakeV4l2Device() override { camera_.streaming = false; }

  int control(unsigned long request, void* argument) override {
    if (request == camera_.refused) return EINVAL;
    switch (request) {
      case VIDIOC_QUERYCAP:
        static_cast<v4l2_capability*>(argument)->capabilities = camera_.capabilities;
        return 0;
      case VIDIOC_ENUM_FMT: {
        auto& described = *static_cast<v4l2_fmtdesc*>(argument);
        if (described.index >= camera_.formats.size()) return EINVAL;
        described.pixelformat = camera_.formats[described.index];
        return 0;
      }
      case VIDIOC_G_FMT:
        tell_format(*static_cast<v4l2_format*>(argument));
        return 0;
      case VIDIOC_S_FMT:
        take_format(*static_cast<v4l2_format*>(argument));
        return 0;
      case VIDIOC_S_PARM: {
        v4l2_fract& period = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
        if (camera_.only_rate != 0) period = {1, camera_.only_rate};
        return 0;
      }
      case VIDIOC_S_CTRL: {
        auto& control = *static_cast<v4l2_control*>(argument);
        if (camera_.controls.count(control.id) == 0) return EINVAL;
        camera_.controls[control.id] = control.value;
        return 0;
      }
      case VIDIOC_REQBUFS:
        memory_.resize(static_cast<v4l2_requestbuffers*>(argument)->count);
        return 0;
      case VIDIOC_QUERYBUF: {
        auto& buffer = *static_cast<v4l2_buffer*>(argument);
        buffer.length = camera_.buffer_bytes;
        buffer.m.offset = buffer.index * 4096;
        return 0;
      }
      case VIDIOC_QBUF:
        queued_.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_DQBUF:
        return give(*static_cast<v4l2_buffer*>(argument));
      case VIDIOC_STREAMON:
        camera_.streaming = true;
        return 0;
      default:
        return ENOTTY;
    }
  }

  void* map(std::size_t bytes, std::uint32_t offset) override {
    memory_[offset / 4096].resize(bytes);
    return memory_[offset / 4096].data();
  }

  int wait(int) override {
    if (!camera_.streaming) return EINVAL;
    return !has_frame() || queued_.empty() ? camera_.when_empty : 0;
  }

 private:
  void tell_format(v4l2_format& format) const {
    v4l2_pix_format& pix = format.fmt.pix;
    pix.width = camera_.width;
    pix.height = camera_.height;
    pix.pixelformat = camera_.pixelformat;
    pix.bytesperline = camera_.stride;
  }
  void take_format(v4l2_format& format) {
    camera_.width = camera_.only_width != 0 ? camera_.only_width : format.fmt.pix.width;
    camera_.height = format.fmt.pix.height;
    camera_.pixelformat = format.fmt.pix.pixelformat;
    tell_format(format);
  }
  int give(v4l2_buffer& buffer) {
    if (!has_frame() || queued_.empty()) return EAGAIN;
    if (camera_.frames.empty()) {
      hand_over(*camera_.endless, buffer);
    } else {
      hand_over(camera_.frames.front(), buffer);
      camera_.frames.pop_front();
    }
    return 0;
  }
  bool has_frame() const { return !camera_.frames.empty() || camera_.endless; }
  void hand_over(const FakeFrame& frame, v4l2_buffer& buffer) {
    buffer.index = queued_.front();
    queued_.erase(queued_.begin());
    buffer.length = camera_.buffer_bytes;
    buffer.bytesused = static_cast<std::uint32_t>(frame.bytes.size());
    buffer.sequence = frame.sequence;
    buffer.flags = frame.flags;
    buffer.timestamp = {frame.time_us / 1'000'000, frame.time_us % 1'000'000};
    std::memcpy(memory_[buffer.index].data(), frame.bytes.data(), frame.bytes.size());
    camera_.most_held = std::max(camera_.most_held, static_cast<int>(memory_.size() - queued_.size()));
  }

  FakeV4l2& camera_;
  std::vector<std::vector<u8>> memory_;
  std::vector<std::uint32_t> queued_;  // the oldest first
};

inline V4l2Opener opener_of(FakeV4l2& camera) {
  return [&camera](const std::string& path) -> std::unique_ptr<V4l2Device> {
    if (camera.closed_for > 0) {
      --camera.closed_for;
      throw Error(path + ": the camera cannot be opened");
    }
    return std::make_unique<FakeV4l2Device>(camera);
  };
}

}  // namespace berth::test
