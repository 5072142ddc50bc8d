#include "camera/gst_camera.hpp"

#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <array>
#include <cassert>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <memory>
#include <mutex>
#include <utility>

#include "berth/error.hpp"
#include "camera/decoders.hpp"
#include "camera/gst_formats.hpp"
#include "monotonic.hpp"

namespace berth {
namespace {

struct UnrefObject {
  void operator()(void* object) const { gst_object_unref(object); }
};
template <class T>
using Object = std::unique_ptr<T, UnrefObject>;

struct StopAndUnref {
  void operator()(GstElement* pipeline) const {
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
  }
};

struct UnrefSample {
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
};
using Sample = std::unique_ptr<GstSample, UnrefSample>;

std::string all_formats() {
  std::string all;
  for (const std::string& name : gst_formats()) all += (all.empty() ? "" : ", ") + name;
  return all;
}

/// What GStreamer says of an error: its text, and the last line of what it has for programmers, which names the cause.
std::string text_of(GstMessage* message) {
  GError* error = nullptr;
  gchar* debug = nullptr;
  gst_message_parse_error(message, &error, &debug);
  std::string text = error == nullptr ? "an error without a text" : error->message;
  const std::string details = debug == nullptr ? "" : debug;
  if (const std::size_t line = details.find_last_of('\n'); line != std::string::npos) {
    text += " " + details.substr(line + 1);
  }
  g_clear_error(&error);
  g_free(debug);
  return text;
}

class GstCamera final : public LiveCamera {
 public:
  explicit GstCamera(const GstOptions& options) : options_(options), ring_(static_cast<std::size_t>(options.buffers)) {
    build();
    play();
  }

  int take(int timeout_ms, Filled& filled) override {
    Held held;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      change_.wait_for(lock, std::chrono::milliseconds(timeout_ms), [&] { return count_ > 0 || !end_.empty(); });
      if (count_ == 0) return end_.empty() ? ETIMEDOUT : ENODEV;
      held = std::move(ring_[first_]);
      first_ = (first_ + 1) % ring_.size();
      --count_;
    }
    GstBuffer* buffer = gst_sample_get_buffer(held.sample.get());
    filled.sequence = held.sequence;
    filled.bytes = gst_buffer_get_size(buffer);
    filled.clock = "monotonic";
    filled.from_start = false;
    filled.time_ns = time_of(held, buffer);
    GstCaps* caps = gst_sample_get_caps(held.sample.get());
    filled.damaged = GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_CORRUPTED) || caps == nullptr ||
                     (caps != caps_.get() && gst_caps_is_equal(caps, caps_.get()) == FALSE);
    filled.index = lend(std::move(held.sample));
    return 0;
  }

  int give_back(const Filled& filled) override {
    lent_[filled.index].reset();
    return 0;
  }

  bool read(const Filled& filled, View2D<u8> image) const override {
    GstVideoFrame frame = {};
    if (gst_video_frame_map(&frame, &info_, gst_sample_get_buffer(lent_[filled.index].get()), GST_MAP_READ) == FALSE) {
      return false;
    }
    const auto stride = static_cast<std::size_t>(GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0));
    // Mapped, all rows are there.
    const std::size_t bytes = stride * static_cast<std::size_t>(height());
    const bool is_whole =
        to_gray(static_cast<const u8*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)), bytes, stride, layout_, image);
    gst_video_frame_unmap(&frame);
    return is_whole;
  }

  std::string explain(int error) const override {
    const std::lock_guard<std::mutex> lock(mutex_);
    return end_.empty() ? LiveCamera::explain(error) : end_;
  }

  int width() const override { return GST_VIDEO_INFO_WIDTH(&info_); }
  int height() const override { return GST_VIDEO_INFO_HEIGHT(&info_); }
  std::int64_t exposure_ns() const override { return std::int64_t{1000} * options_.exposure_us; }

 private:
  struct Held {
    Sample sample;
    std::uint32_t sequence = 0;
    std::int64_t came_ns = 0;
  };

  struct UnrefCaps {
    void operator()(GstCaps* caps) const { gst_caps_unref(caps); }
  };

  [[noreturn]] void fail(const std::string& what) const { throw Error(name_of(options_) + ": " + what); }

  void build() {
    GError* error = nullptr;
    if (gst_init_check(nullptr, nullptr, &error) == FALSE) {
      const std::string why = error == nullptr ? "no reason given" : error->message;
      g_clear_error(&error);
      fail("GStreamer does not start (" + why + "); does gst-launch-1.0 videotestsrc ! fakesink run?");
    }
    const std::string text = options_.pipeline + " ! appsink name=berth";
    GstElement* built = gst_parse_launch_full(text.c_str(), nullptr, GST_PARSE_FLAG_FATAL_ERRORS, &error);
    if (built == nullptr) {
      const std::string why = error == nullptr ? "no reason given" : error->message;
      g_clear_error(&error);
      fail("the pipeline cannot be built (" + why +
           "); give it without a sink, try it by gst-launch-1.0 with ! fakesink, and see gst-inspect-1.0 for elements");
    }
    pipeline_.reset(GST_ELEMENT(gst_object_ref_sink(built)));
    sink_.reset(GST_APP_SINK(gst_bin_get_by_name(GST_BIN(built), "berth")));
    std::string formats = "video/x-raw,format={" + all_formats() + "}";
    const std::unique_ptr<GstCaps, UnrefCaps> caps(gst_caps_from_string(formats.c_str()));
    gst_app_sink_set_caps(sink_.get(), caps.get());
    GstAppSinkCallbacks callbacks = {};
    callbacks.new_sample = [](GstAppSink*, gpointer self) { return static_cast<GstCamera*>(self)->receive(); };
    gst_app_sink_set_callbacks(sink_.get(), &callbacks, this, nullptr);
    // The clock of the system, which is CLOCK_MONOTONIC, whatever others an element may bring.
    const Object<GstClock> clock(gst_system_clock_obtain());
    gst_pipeline_use_clock(GST_PIPELINE(built), clock.get());
    const Object<GstBus> bus(gst_element_get_bus(built));
    gst_bus_set_sync_handler(
        bus.get(),
        [](GstBus*, GstMessage* message, gpointer self) { return static_cast<GstCamera*>(self)->hear(message); }, this,
        nullptr);
  }

  /// Ends when the first frame is there, which tells how large they are.
  void play() {
    const GstStateChangeReturn paused = gst_element_set_state(pipeline_.get(), GST_STATE_PAUSED);
    // What is not live would come as fast as it can be read: it is played at its own pace.
    const bool is_live = paused == GST_STATE_CHANGE_NO_PREROLL;
    gst_base_sink_set_sync(GST_BASE_SINK(sink_.get()), is_live ? FALSE : TRUE);
    if (paused != GST_STATE_CHANGE_FAILURE) gst_element_set_state(pipeline_.get(), GST_STATE_PLAYING);
    constexpr std::chrono::seconds kFirstFrame{5};
    std::unique_lock<std::mutex> lock(mutex_);
    change_.wait_for(lock, kFirstFrame, [&] { return count_ > 0 || !end_.empty(); });
    if (count_ == 0) {
      const std::string why = !end_.empty() ? end_
                              : paused == GST_STATE_CHANGE_FAILURE
                                  ? "it does not start"
                                  : "nothing came for " + std::to_string(kFirstFrame.count()) + " s";
      lock.unlock();
      fail("the pipeline gives no frame (" + why + "); it must give video/x-raw of " + all_formats() +
           " in the system's memory: end it with ! videoconvert");
    }
    caps_.reset(gst_caps_ref(gst_sample_get_caps(ring_[first_].sample.get())));
    lock.unlock();
    if (gst_video_info_from_caps(&info_, caps_.get()) == FALSE) fail("the pipeline's frames are no video");
    check_image_size(static_cast<std::uint32_t>(width()), static_cast<std::uint32_t>(height()), name_of(options_));
    const char* format = GST_VIDEO_INFO_NAME(&info_);
    for (const GstFormat& known : kGstFormats) {
      if (std::strcmp(known.name, format) == 0) layout_ = known.layout;
    }
  }

  /// On the pipeline's thread: a frame has come.
  GstFlowReturn receive() {
    Sample sample(gst_app_sink_pull_sample(sink_.get()));
    if (!sample || gst_sample_get_buffer(sample.get()) == nullptr) return GST_FLOW_OK;
    Held held;
    held.came_ns = monotonic_ns();
    const std::lock_guard<std::mutex> lock(mutex_);
    held.sequence = number_of(gst_sample_get_buffer(sample.get()));
    held.sample = std::move(sample);
    if (count_ == ring_.size()) {
      first_ = (first_ + 1) % ring_.size();
      --count_;
    }
    ring_[(first_ + count_) % ring_.size()] = std::move(held);
    ++count_;
    change_.notify_one();
    return GST_FLOW_OK;
  }

  /// On whatever thread says it: the pipeline has ended, or has failed.
  GstBusSyncReply hear(GstMessage* message) {
    std::string end;
    if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS) end = "its pipeline has ended";
    if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) end = text_of(message);
    if (!end.empty()) {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (end_.empty()) end_ = end;
      change_.notify_one();
    }
    gst_message_unref(message);  // what a handler drops is its own
    return GST_BUS_DROP;
  }

  /// The source's own number as one that counts on, where its frames carry one as raw video has it: this frame's and
  /// the next one's. Of others those that come here are counted.
  std::uint32_t number_of(GstBuffer* buffer) {
    constexpr guint64 kMost = 1U << 30;
    const guint64 offset = GST_BUFFER_OFFSET(buffer);
    const bool counts = offset != GST_BUFFER_OFFSET_NONE && GST_BUFFER_OFFSET_END(buffer) == offset + 1;
    guint64 step = 1;
    // One that began anew has lost nothing.
    if (counts && has_offset_ && offset > last_offset_ && offset - last_offset_ < kMost) step = offset - last_offset_;
    has_offset_ = counts;
    last_offset_ = offset;
    return sequence_ += static_cast<std::uint32_t>(step);
  }

  /// By the pipeline's clock; where the frame has no time, when it came here.
  std::int64_t time_of(const Held& held, GstBuffer* buffer) const {
    const GstSegment* segment = gst_sample_get_segment(held.sample.get());
    if (!GST_BUFFER_PTS_IS_VALID(buffer) || segment->format != GST_FORMAT_TIME) return held.came_ns;
    const guint64 running = gst_segment_to_running_time(segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
    const GstClockTime base = gst_element_get_base_time(pipeline_.get());
    if (running == GST_CLOCK_TIME_NONE || base == GST_CLOCK_TIME_NONE) return held.came_ns;
    return static_cast<std::int64_t>(base + running);
  }

  std::size_t lend(Sample sample) {
    std::size_t index = 0;
    while (index + 1 < lent_.size() && lent_[index]) ++index;
    assert(!lent_[index]);
    lent_[index] = std::move(sample);
    return index;
  }

  const GstOptions options_;
  Object<GstAppSink> sink_;
  std::unique_ptr<GstCaps, UnrefCaps> caps_;
  GstVideoInfo info_ = {};
  PixelFormat layout_ = PixelFormat::mono8;
  /// The reader has one at a time, and a newer one beside it while it chooses.
  std::array<Sample, 2> lent_;

  mutable std::mutex mutex_;
  std::condition_variable change_;
  std::vector<Held> ring_;
  std::size_t first_ = 0, count_ = 0;
  /// Why nothing more comes.
  std::string end_;
  std::uint32_t sequence_ = 0;
  guint64 last_offset_ = 0;
  bool has_offset_ = false;
  // Last, so that what its threads use outlives it.
  std::unique_ptr<GstElement, StopAndUnref> pipeline_;
};

}  // namespace

LiveCameraOpener gst_opener(const GstOptions& options) {
  return [options] { return std::make_unique<GstCamera>(options); };
}

}  // namespace berth
