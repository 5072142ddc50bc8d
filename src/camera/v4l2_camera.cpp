#include "camera/v4l2_camera.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "berth/error.hpp"
#include "camera/decoders.hpp"
#include "camera/pixel_format.hpp"

namespace berth {
namespace {

struct Format {
  std::uint32_t fourcc;
  PixelFormat layout;
};

// Best first: more grey levels do not help eight-bit kernels, so the fewest bytes that carry them; colour patterns cost
// sharpness, MJPG costs time and adds artefacts.
constexpr Format kFormats[] = {
    {V4L2_PIX_FMT_GREY, PixelFormat::mono8},    {V4L2_PIX_FMT_NV12, PixelFormat::nv12},
    {V4L2_PIX_FMT_YUYV, PixelFormat::yuyv},     {V4L2_PIX_FMT_UYVY, PixelFormat::uyvy},
    {V4L2_PIX_FMT_Y10, PixelFormat::mono10},    {V4L2_PIX_FMT_Y12, PixelFormat::mono12},
    {V4L2_PIX_FMT_Y16, PixelFormat::mono16},    {V4L2_PIX_FMT_SBGGR8, PixelFormat::bayer8},
    {V4L2_PIX_FMT_SGBRG8, PixelFormat::bayer8}, {V4L2_PIX_FMT_SGRBG8, PixelFormat::bayer8},
    {V4L2_PIX_FMT_SRGGB8, PixelFormat::bayer8}, {V4L2_PIX_FMT_BGR24, PixelFormat::bgr8},
    {V4L2_PIX_FMT_RGB24, PixelFormat::rgb8},
};

std::string text_of(std::uint32_t fourcc) {
  std::string text;
  for (int i = 0; i < 4; ++i) text += static_cast<char>(fourcc >> (8 * i) & 127);
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

v4l2_buffer capture_buffer(std::uint32_t index) {
  v4l2_buffer buffer = {};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

std::string because(int error) { return std::string(" (") + std::strerror(error) + ")"; }

}  // namespace

std::vector<std::string> v4l2_formats() {
  std::vector<std::string> names;
  for (const Format& format : kFormats) names.push_back(text_of(format.fourcc));
  names.push_back(text_of(V4L2_PIX_FMT_MJPEG));
  return names;
}

V4l2Camera::V4l2Camera(std::unique_ptr<V4l2Device> device, const V4l2Options& options)
    : device_(std::move(device)), options_(options) {
  check_capabilities();
  choose_format();
  set_size();
  set_rate();
  set_controls();
  start();
}

void V4l2Camera::fail(const std::string& what) const { throw Error(options_.path + ": " + what); }

void V4l2Camera::check_capabilities() {
  v4l2_capability known = {};
  if (const int error = device_->control(VIDIOC_QUERYCAP, &known)) {
    fail("this is no camera" + because(error) + "; ls /dev/v4l/by-path shows those there are");
  }
  const std::uint32_t can = (known.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? known.device_caps : known.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
    fail("the device gives no images (it may be the metadata of a camera); try the camera's other /dev/video");
  }
}

void V4l2Camera::choose_format() {
  std::vector<std::string> offered;
  v4l2_fmtdesc described = {};
  described.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  // Bounded, whatever the driver says.
  for (; described.index < 256 && device_->control(VIDIOC_ENUM_FMT, &described) == 0; ++described.index) {
    offered.push_back(text_of(described.pixelformat));
  }
  const auto offers = [&](const std::string& name) {
    return std::find(offered.begin(), offered.end(), name) != offered.end();
  };
  std::string all;
  for (const std::string& name : offered) all += (all.empty() ? "" : ", ") + name;
  const std::vector<std::string> known = v4l2_formats();
  const auto chosen = options_.format.empty() ? std::find_if(known.begin(), known.end(), offers)
                                              : std::find(known.begin(), known.end(), options_.format);
  if (chosen == known.end()) fail("the camera has the pixel formats " + all + ", none of which can be read");
  if (!offers(*chosen)) fail("the camera has no pixel format " + *chosen + "; it has " + all);
  const auto at = static_cast<std::size_t>(chosen - known.begin());
  fourcc_ = at < std::size(kFormats) ? kFormats[at].fourcc : std::uint32_t{V4L2_PIX_FMT_MJPEG};
}

void V4l2Camera::set_size() {
  v4l2_format format = {};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = device_->control(VIDIOC_G_FMT, &format))
    fail("the camera tells no image size" + because(error));
  if (options_.width > 0) {
    format.fmt.pix.width = static_cast<std::uint32_t>(options_.width);
    format.fmt.pix.height = static_cast<std::uint32_t>(options_.height);
  }
  format.fmt.pix.pixelformat = fourcc_;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.bytesperline = 0;
  if (const int error = device_->control(VIDIOC_S_FMT, &format)) {
    fail("the camera does not take " + text_of(fourcc_) + because(error) +
         (error == EBUSY ? "; another program has it" : "; v4l2-ctl --list-formats-ext lists what it does"));
  }
  const v4l2_pix_format& got = format.fmt.pix;
  check_image_size(got.width, got.height, options_.path);
  width_ = static_cast<int>(got.width);
  height_ = static_cast<int>(got.height);
  stride_ = got.bytesperline;
  if (got.pixelformat != fourcc_ || (options_.width > 0 && (width_ != options_.width || height_ != options_.height))) {
    fail("asked for " + std::to_string(options_.width) + "x" + std::to_string(options_.height) + " " +
         text_of(fourcc_) + ", the camera gives " + std::to_string(width_) + "x" + std::to_string(height_) + " " +
         text_of(got.pixelformat) + "; v4l2-ctl --list-formats-ext lists what it can");
  }
}

void V4l2Camera::set_rate() {
  if (!(options_.fps > 0)) return;
  constexpr std::uint32_t kParts = 1000;
  v4l2_streamparm rate = {};
  rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  rate.parm.capture.timeperframe = {kParts, static_cast<std::uint32_t>(std::lround(options_.fps * kParts))};
  const int error = device_->control(VIDIOC_S_PARM, &rate);
  if (error != 0) fail("the camera's rate cannot be set" + because(error) + "; leave fps out");
  const v4l2_fract& period = rate.parm.capture.timeperframe;
  const double fps = period.numerator == 0 ? 0 : static_cast<double>(period.denominator) / period.numerator;
  if (std::fabs(fps - options_.fps) > 0.01 * options_.fps) {
    fail("asked for " + std::to_string(options_.fps) + " frames/s, the camera gives " + std::to_string(fps) +
         "; v4l2-ctl --list-formats-ext lists the rates of each size");
  }
}

void V4l2Camera::set_controls() {
  const auto put = [&](std::uint32_t id, int value, const char* key) {
    v4l2_control control = {id, value};
    if (const int error = device_->control(VIDIOC_S_CTRL, &control)) {
      fail(std::string("the camera does not take ") + key + because(error) +
           "; v4l2-ctl --list-ctrls lists what it can");
    }
    return control.value;
  };
  if (options_.exposure_us > 0) {
    put(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, "exposure_us");
    const int hundreds = std::max(1, (options_.exposure_us + 50) / 100);
    exposure_ns_ = std::int64_t{100'000} * put(V4L2_CID_EXPOSURE_ABSOLUTE, hundreds, "exposure_us");
  }
  if (options_.gain >= 0) put(V4L2_CID_GAIN, options_.gain, "gain");
}

void V4l2Camera::start() {
  v4l2_requestbuffers request = {};
  request.count = static_cast<std::uint32_t>(options_.buffers);
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = device_->control(VIDIOC_REQBUFS, &request)) {
    fail("the camera gives no buffers" + because(error) + (error == EBUSY ? "; another program has it" : ""));
  }
  if (request.count < 2) fail("the camera gives " + std::to_string(request.count) + " buffer(s); 2 are needed");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = capture_buffer(i);
    if (const int error = device_->control(VIDIOC_QUERYBUF, &buffer)) fail("a buffer cannot be had" + because(error));
    const void* memory = device_->map(buffer.length, buffer.m.offset);
    if (memory == nullptr) fail("a buffer of " + std::to_string(buffer.length) + " bytes cannot be mapped");
    buffers_.push_back(static_cast<const u8*>(memory));
    if (const int error = device_->control(VIDIOC_QBUF, &buffer)) fail("a buffer is not taken" + because(error));
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = device_->control(VIDIOC_STREAMON, &type)) fail("the camera does not start" + because(error));
}

int V4l2Camera::take(int timeout_ms, Filled& filled) {
  if (const int error = device_->wait(timeout_ms)) return error;
  v4l2_buffer buffer = capture_buffer(0);
  const int error = device_->control(VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return ETIMEDOUT;
  if (error != 0) return error;
  if (buffer.index >= buffers_.size()) return EIO;
  filled.index = buffer.index;
  filled.sequence = buffer.sequence;
  filled.bytes = std::min(buffer.bytesused, buffer.length);
  filled.time_ns =
      std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 + std::int64_t{buffer.timestamp.tv_usec} * 1000;
  const bool is_monotonic = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  filled.clock = is_monotonic ? "monotonic" : "driver";
  filled.from_start = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  filled.damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  return 0;
}

int V4l2Camera::give_back(const Filled& filled) {
  v4l2_buffer buffer = capture_buffer(static_cast<std::uint32_t>(filled.index));
  return device_->control(VIDIOC_QBUF, &buffer);
}

bool V4l2Camera::read(const Filled& filled, View2D<u8> image) const {
  const u8* data = buffers_[filled.index];
  if (fourcc_ == V4L2_PIX_FMT_MJPEG) {
    try {
      const GrayImage decoded = decode_jpeg({data, data + filled.bytes}, options_.path);
      if (decoded.width() != width_ || decoded.height() != height_) return false;
      for (int y = 0; y < height_; ++y) {
        std::memcpy(image.row(y), decoded.view().row(y), static_cast<std::size_t>(width_));
      }
    } catch (const Error&) {
      return false;
    }
    return true;
  }
  const auto* format = std::find_if(std::begin(kFormats), std::end(kFormats),
                                    [&](const Format& candidate) { return candidate.fourcc == fourcc_; });
  const std::size_t stride = stride_ > 0 ? stride_ : row_bytes(format->layout, width_);
  return to_gray(data, filled.bytes, stride, format->layout, image);
}

}  // namespace berth
