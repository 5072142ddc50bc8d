#include "camera/aravis_camera.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

#include "berth/error.hpp"
#include "camera/aravis_chunks.hpp"
#include "camera/aravis_finder.hpp"
#include "camera/aravis_formats.hpp"
#include "camera/decoders.hpp"
#include "camera/gige_probe.hpp"
#include "monotonic.hpp"
#include "unix_time.hpp"

namespace berth {
namespace {

class AravisCamera final : public LiveCamera {
 public:
  AravisCamera(const AravisOptions& options, Object<ArvCamera> camera) : options_(options), camera_(std::move(camera)) {
    take_control();
    choose_format();
    set_region();
    set_exposure();  // the rate may depend on it
    set_rate();
    set_gain();
    if (options_.time == AravisOptions::Time::ptp) wait_for_ptp();
    if (options_.chunk_time) chunk_time_.emplace(camera_.get(), options_.name);
    start();
  }

  ~AravisCamera() override {
    // One that is gone would be waited for.
    if (stream_ && !*is_gone_ && answers()) arv_camera_stop_acquisition(camera_.get(), nullptr);
  }
  AravisCamera(const AravisCamera&) = delete;
  AravisCamera& operator=(const AravisCamera&) = delete;

  int take(int timeout_ms, Filled& filled) override {
    // In turns, so that a camera that says it is gone is not waited for to the end.
    constexpr int kTurn = 200;
    ArvBuffer* buffer = timeout_ms > 0 ? arv_stream_timeout_pop_buffer(
                                             stream_.get(), 1000ULL * static_cast<u64>(std::min(timeout_ms, kTurn)))
                                       : arv_stream_try_pop_buffer(stream_.get());
    if (buffer == nullptr) return *is_gone_ ? ENODEV : ETIMEDOUT;
    g_object_unref(buffer);  // buffers_ has another
    const auto at =
        std::find_if(buffers_.begin(), buffers_.end(), [&](const auto& own) { return own.get() == buffer; });
    filled.index = static_cast<std::size_t>(at - buffers_.begin());
    filled.damaged = !is_as_set(buffer);
    filled.bytes = 0;
    if (!filled.damaged) arv_buffer_get_part_data(buffer, 0, &filled.bytes);
    filled.sequence = count(buffer);
    stamp(buffer, filled);
    return 0;
  }

  int give_back(const Filled& filled) override {
    push(filled.index);
    return 0;
  }

  bool read(const Filled& filled, View2D<u8> image) const override {
    ArvBuffer* buffer = buffers_[filled.index].get();
    std::size_t bytes = 0;
    const auto* data = static_cast<const u8*>(arv_buffer_get_part_data(buffer, 0, &bytes));
    int x_padding = 0;
    arv_buffer_get_part_padding(buffer, 0, &x_padding, nullptr);
    return to_gray(data, bytes, row_bytes(layout_, width_) + static_cast<std::size_t>(x_padding), layout_, image);
  }

  int width() const override { return width_; }
  int height() const override { return height_; }
  std::int64_t exposure_ns() const override { return exposure_ns_; }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw Error("aravis:" + options_.name + ": " + what); }

  void check(const Failure& failure, const std::string& key) const {
    if (failure) fail("the camera does not take " + key + failure.because() + "; leave it out, or give another value");
  }

  bool has(const char* feature) const {
    Failure ignored;
    return arv_camera_is_feature_available(camera_.get(), feature, ignored.put()) != 0 && !ignored;
  }

  /// The device's address in the network; null for others.
  GInetAddress* address() const {
    if (arv_camera_is_gv_device(camera_.get()) == 0) return nullptr;
    GSocketAddress* whole = arv_gv_device_get_device_address(ARV_GV_DEVICE(arv_camera_get_device(camera_.get())));
    return g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(whole));
  }

  bool answers() const {
    GInetAddress* own = address();
    if (own == nullptr) return true;
    char* text = g_inet_address_to_string(own);
    const bool is_there = answers_gige(text, kAnswerMs);
    g_free(text);
    return is_there;
  }

  void take_control() {
    ArvDevice* device = arv_camera_get_device(camera_.get());
    if (arv_camera_is_gv_device(camera_.get()) != 0 && arv_gv_device_is_controller(ARV_GV_DEVICE(device)) == 0) {
      fail("another program has the camera, or had it and did not end well, which the camera notices after seconds");
    }
    using Flag = std::shared_ptr<std::atomic<bool>>;
    // Aravis' thread may call while the camera is being closed: the flag is its own.
    g_signal_connect_data(
        device, "control-lost", G_CALLBACK(+[](ArvDevice*, gpointer flag) { **static_cast<Flag*>(flag) = true; }),
        new Flag(is_gone_), +[](gpointer flag, GClosure*) { delete static_cast<Flag*>(flag); }, G_CONNECT_DEFAULT);
  }

  void choose_format() {
    Failure failure;
    unsigned count = 0;
    const char** names = arv_camera_dup_available_pixel_formats_as_strings(camera_.get(), &count, failure.put());
    const std::vector<std::string> offered(names, names + count);
    g_free(names);
    std::string all;
    for (const std::string& name : offered) all += (all.empty() ? "" : ", ") + name;
    const auto offers = [&](const AravisFormat& format) {
      return std::find(offered.begin(), offered.end(), format.name) != offered.end();
    };
    const auto* chosen =
        std::find_if(std::begin(kAravisFormats), std::end(kAravisFormats), [&](const AravisFormat& format) {
          return options_.format.empty() ? offers(format) : options_.format == format.name;
        });
    if (chosen == std::end(kAravisFormats)) {
      fail("the camera has the pixel formats " + all + ", none of which can be read" + failure.because());
    }
    if (!offers(*chosen)) fail(std::string("the camera has no pixel format ") + chosen->name + "; it has " + all);
    arv_camera_set_pixel_format_from_string(camera_.get(), chosen->name, failure.put());
    check(failure, std::string("format=") + chosen->name);
    pixel_format_ = arv_camera_get_pixel_format(camera_.get(), failure.put());
    layout_ = chosen->layout;
  }

  void set_region() {
    Failure failure;
    if (options_.width > 0) {
      const bool has_offset = arv_camera_is_region_offset_available(camera_.get(), nullptr) != 0;
      if (!has_offset && (options_.x > 0 || options_.y > 0)) fail("the camera has no x and y; leave them out");
      // First to where any size fits.
      if (has_offset) arv_camera_set_region(camera_.get(), 0, 0, options_.width, options_.height, failure.put());
      if (!failure) {
        arv_camera_set_region(camera_.get(), has_offset ? options_.x : -1, has_offset ? options_.y : -1, options_.width,
                              options_.height, failure.put());
      }
      check(failure, "width, height, x, y");
    }
    int x = 0, y = 0;
    arv_camera_get_region(camera_.get(), &x, &y, &width_, &height_, failure.put());
    if (failure || width_ < 1 || height_ < 1) fail("the camera tells no image size" + failure.because());
    check_image_size(static_cast<u64>(width_), static_cast<u64>(height_), "aravis:" + options_.name);
    if (options_.width > 0 &&
        (width_ != options_.width || height_ != options_.height || x != options_.x || y != options_.y)) {
      fail("asked for " + std::to_string(options_.width) + "x" + std::to_string(options_.height) + " at " +
           std::to_string(options_.x) + "," + std::to_string(options_.y) + ", the camera gives " +
           std::to_string(width_) + "x" + std::to_string(height_) + " at " + std::to_string(x) + "," +
           std::to_string(y) + "; it may take multiples of 4, 8 or 16 only");
    }
  }

  void set_exposure() {
    Failure failure;
    const bool has_auto = arv_camera_is_exposure_auto_available(camera_.get(), nullptr) != 0;
    if (options_.exposure_us > 0) {
      if (has_auto) arv_camera_set_exposure_time_auto(camera_.get(), ARV_AUTO_OFF, failure.put());
      double least = 0, most = 0;
      if (!failure) arv_camera_get_exposure_time_bounds(camera_.get(), &least, &most, failure.put());
      check_bounds("exposure_us", options_.exposure_us, least, most);
      if (!failure) arv_camera_set_exposure_time(camera_.get(), options_.exposure_us, failure.put());
      check(failure, "exposure_us");
    }
    if (has_auto && arv_camera_get_exposure_time_auto(camera_.get(), nullptr) != ARV_AUTO_OFF) return;
    const double exposure_us = arv_camera_get_exposure_time(camera_.get(), failure.put());
    if (!failure) exposure_ns_ = std::llround(exposure_us * 1000);
  }

  void set_rate() {
    Failure failure;
    if (has("AcquisitionMode")) {
      arv_camera_set_acquisition_mode(camera_.get(), ARV_ACQUISITION_MODE_CONTINUOUS, failure.put());
      check(failure, "continuous frames");
    }
    if (!options_.trigger.empty()) {
      arv_camera_set_trigger(camera_.get(), options_.trigger.c_str(), failure.put());
      check(failure, "trigger=" + options_.trigger);
      return;
    }
    if (options_.fps > 0) {
      arv_camera_set_frame_rate(camera_.get(), options_.fps, failure.put());
      check(failure, "fps");
    }
    const double fps = arv_camera_get_frame_rate(camera_.get(), failure.put());
    if (!failure && fps > 0) period_ms_ = 1000 / fps;
    if (options_.fps > 0 && !(std::fabs(fps - options_.fps) <= 0.01 * options_.fps)) {
      fail("asked for " + std::to_string(options_.fps) + " frames/s, the camera gives " + std::to_string(fps) +
           "; its rate depends on exposure_us, width, height and packet_size");
    }
  }

  void set_gain() {
    if (!(options_.gain >= 0)) return;
    Failure failure;
    if (arv_camera_is_gain_auto_available(camera_.get(), nullptr) != 0) {
      arv_camera_set_gain_auto(camera_.get(), ARV_AUTO_OFF, failure.put());
    }
    double least = 0, most = 0;
    if (!failure) arv_camera_get_gain_bounds(camera_.get(), &least, &most, failure.put());
    check_bounds("gain", options_.gain, least, most);
    if (!failure) arv_camera_set_gain(camera_.get(), options_.gain, failure.put());
    check(failure, "gain");
  }

  void check_bounds(const char* key, double value, double least, double most) const {
    if (most > least && (value < least || value > most)) {
      fail(std::string("the camera takes ") + key + " from " + std::to_string(least) + " to " + std::to_string(most) +
           ", not " + std::to_string(value));
    }
  }

  /// By either standard's names.
  void wait_for_ptp() {
    const bool is_new = has("PtpEnable");
    const char* status_of = is_new ? "PtpStatus" : "GevIEEE1588Status";
    if (!is_new && !has("GevIEEE1588")) fail("the camera has no PTP; take time=camera or time=host");
    Failure failure;
    arv_camera_set_boolean(camera_.get(), is_new ? "PtpEnable" : "GevIEEE1588", 1, failure.put());
    check(failure, "time=ptp");
    constexpr int kSeconds = 15;
    std::string status;
    for (int i = 0; i < 10 * kSeconds; ++i) {
      if (has("PtpDataSetLatch")) arv_camera_execute_command(camera_.get(), "PtpDataSetLatch", failure.put());
      const char* text = arv_camera_get_string(camera_.get(), status_of, failure.put());
      status = text == nullptr ? "" : text;
      if (status == "Slave") return;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    fail("the camera's clock is not set by PTP after " + std::to_string(kSeconds) + " s (its state is '" + status +
         "'); is there a master in its network (ptp4l, or a switch)?");
  }

  void start() {
    Failure failure;
    const bool is_network = arv_camera_is_gv_device(camera_.get()) != 0;
    if (is_network) {
      ArvDevice* device = arv_camera_get_device(camera_.get());
      if (options_.packet_size > 0) {
        arv_camera_gv_set_packet_size_adjustment(camera_.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
        arv_camera_gv_set_packet_size(camera_.get(), options_.packet_size, failure.put());
        check(failure, "packet_size");
      }
      // A packet socket sees nothing of what goes over the loopback interface.
      if (!options_.packet_socket || g_inet_address_get_is_loopback(address()) != 0) {
        arv_gv_device_set_stream_options(ARV_GV_DEVICE(device), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
      }
    }
    stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, failure.put()));
    if (!stream_) fail("the camera gives no stream" + failure.because() + "; another program may have it");
    const unsigned payload = arv_camera_get_payload(camera_.get(), failure.put());
    if (failure) fail("the camera does not tell how large a frame is" + failure.because());
    if (is_network) set_network(payload);
    for (int i = 0; i < options_.buffers; ++i) {
      buffers_.emplace_back(arv_buffer_new_allocate(payload));
      push(buffers_.size() - 1);
    }
    arv_camera_start_acquisition(camera_.get(), failure.put());
    if (failure) fail("the camera does not start" + failure.because());
  }

  void set_network(unsigned payload) {
    constexpr double kUnknownPeriodMs = 10, kMostRetentionMs = 200;
    const double period_ms = period_ms_ > 0 ? period_ms_ : kUnknownPeriodMs;
    const double retention_ms =
        options_.retention_ms > 0 ? options_.retention_ms : std::min(2 * period_ms, kMostRetentionMs);
    const auto retention_us = static_cast<unsigned>(std::lround(1000 * retention_ms));
    // What came while this program was not running is with the kernel, as far as net.core.rmem_max lets it.
    constexpr u64 kMostSocketBytes = 64 << 20;
    const auto socket_bytes = static_cast<int>(std::min<u64>(u64{4} * payload, kMostSocketBytes));
    g_object_set(stream_.get(), "frame-retention", retention_us, "packet-timeout", std::max(retention_us / 4, 1U),
                 "packet-resend",
                 options_.resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
                 "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size", socket_bytes, nullptr);
  }

  void push(std::size_t index) {
    arv_stream_push_buffer(stream_.get(), static_cast<ArvBuffer*>(g_object_ref(buffers_[index].get())));
  }

  /// Whether the buffer holds a whole image of the size and format that the camera was set to.
  bool is_as_set(ArvBuffer* buffer) const {
    if (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS || arv_buffer_get_n_parts(buffer) < 1) return false;
    return arv_buffer_get_part_width(buffer, 0) == width_ && arv_buffer_get_part_height(buffer, 0) == height_ &&
           arv_buffer_get_part_pixel_format(buffer, 0) == pixel_format_;
  }

  /// The camera's own number as one that counts on: GigE Vision 1 has 16 bits and leaves 0 out, others have 64. A
  /// buffer whose first packet was lost has the number of what was in it before, so of those with packets missing none
  /// is believed: they come in their turn.
  std::uint32_t count(ArvBuffer* buffer) {
    if (arv_buffer_get_status(buffer) != ARV_BUFFER_STATUS_SUCCESS) {
      ++last_id_;
      return ++sequence_;
    }
    const u64 id = arv_buffer_get_frame_id(buffer);
    constexpr u64 kLast = 65535;
    u64 step = 1;
    if (has_id_ && id > last_id_) step = id - last_id_;
    if (has_id_ && id < last_id_ && last_id_ <= kLast) step = std::max<u64>(id + kLast - last_id_, 1);
    // One that began anew has lost nothing.
    if (step > kLast / 2) step = 1;
    has_id_ = true;
    last_id_ = id;
    return sequence_ += static_cast<std::uint32_t>(step);
  }

  void stamp(ArvBuffer* buffer, Filled& filled) const {
    if (options_.time == AravisOptions::Time::host) {
      // Aravis has it by the wall clock, which may be set; the difference to now is short enough not to matter.
      const auto came = static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer));
      filled.time_ns = monotonic_ns() - std::max<std::int64_t>(unix_ns() - came, 0);
      filled.clock = "monotonic";
      filled.from_start = false;
      return;
    }
    if (!chunk_time_) {
      filled.time_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer));
    } else if (!filled.damaged) {
      const std::optional<std::int64_t> time_ns = chunk_time_->of(buffer);
      // Without its time it is not whole; the leader's would be another one.
      filled.damaged = !time_ns;
      filled.time_ns = time_ns.value_or(0);
    }
    filled.clock = options_.time == AravisOptions::Time::ptp ? "ptp" : "camera";
    filled.from_start = true;
  }

  const AravisOptions options_;
  const std::shared_ptr<std::atomic<bool>> is_gone_ = std::make_shared<std::atomic<bool>>(false);
  Object<ArvCamera> camera_;
  std::optional<ChunkTime> chunk_time_;
  std::vector<Object<ArvBuffer>> buffers_;
  Object<ArvStream> stream_;
  ArvPixelFormat pixel_format_ = 0;
  PixelFormat layout_ = PixelFormat::mono8;
  int width_ = 0, height_ = 0;
  double period_ms_ = 0;
  std::int64_t exposure_ns_ = 0;
  std::uint32_t sequence_ = 0;
  u64 last_id_ = 0;
  bool has_id_ = false;
};

}  // namespace

LiveCameraOpener aravis_opener(const AravisOptions& options) {
  return [options, finder = AravisFinder(options.name)]() mutable {
    return std::make_unique<AravisCamera>(options, finder.open());
  };
}

}  // namespace berth
