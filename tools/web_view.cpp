#include "web_view.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <opencv2/core.hpp>
#include <thread>

#include "berth/error.hpp"
#include "monotonic.hpp"
#include "pipeline/thread_setup.hpp"
#include "web_overlay.hpp"
#include "web_picture.hpp"
#include "web_server.hpp"
#include "web_times.hpp"

namespace berth::cli {
namespace {

/// Between two samples of poses, and between two pictures.
constexpr double kSampleEveryS = 0.04, kPictureEveryS = 0.05;
constexpr std::size_t kShortestToken = 16;

std::string read_token(const std::string& path) {
  if (path.empty()) return {};
  std::ifstream file(path);
  std::string token;
  if (!std::getline(file, token)) throw Error("--view-token " + path + ": cannot be read, or has no line; write one");
  if (!token.empty() && token.back() == '\r') token.pop_back();
  const bool is_plain = std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c <= '~'; });
  if (token.size() < kShortestToken || token.size() > 256 || !is_plain) {
    throw Error(
        fmt::format("--view-token {}: its first line has {} characters; write {} to 256 of printable ASCII without "
                    "spaces, e.g. by openssl rand -hex 16",
                    path, token.size(), kShortestToken));
  }
  return token;
}

class WebView final : public FrameObserver {
 public:
  WebView(const WebOptions& options, std::ostream& people, std::function<void()> end_run) {
    about_.run = new_run_name();
    about_.source = options.source;
    about_.is_filtered = options.is_filtered;
    const std::string token = read_token(options.token_file);
    about_.can_control = !token.empty();
    WebContent content;
    content.feed = &feed_;
    content.about_version = [this] { return about_version_.load(); };
    content.about = [this] {
      const std::lock_guard<std::mutex> lock(about_mutex_);
      return to_json(about_);
    };
    content.times = [this] { return times_.json(); };
    content.token = token;
    content.end_run = std::move(end_run);
    server_ = std::make_unique<WebServer>(parse_web_address(options.address), std::move(content));
    people << "view        " << server_->url() << '\n' << std::flush;
    encoder_ = std::thread([this] { encode(); });
  }

  ~WebView() override {
    {
      const std::lock_guard<std::mutex> lock(picture_mutex_);
      is_over_ = true;
    }
    filled_.notify_one();
    encoder_.join();
  }

  void begin(const ObservedStream& stream) override {
    sampler_.begin(stream);
    names_.begin(stream);
    {
      const std::lock_guard<std::mutex> lock(about_mutex_);
      about_.backend = stream.backend;
      about_.width = stream.width;
      about_.height = stream.height;
      about_.camera = stream.config.camera;
    }
    ++about_version_;
  }

  void observe(const ObservedFrame& frame) override {
    const double now_s = feed_.now_s();
    times_.add(frame);
    const std::vector<WebSample>& samples = sampler_.take(frame, now_s);
    count(frame, now_s, !samples.empty());
    const bool is_due = now_s - sampled_s_ >= kSampleEveryS;
    if (is_due) sampled_s_ = now_s;
    feed_.publish(status_, is_due ? samples : none_, sampler_.objects());
    if (server_->video_streams() > 0 && now_s - pictured_s_ >= kPictureEveryS) take_picture(frame, now_s);
  }

  void finish(std::ostream&) override {
    feed_.end();
    // Viewers are told so before the connections close.
    feed_.sleep(std::chrono::milliseconds(server_->event_streams() > 0 ? 300 : 0));
  }

 private:
  void count(const ObservedFrame& frame, double now_s, bool has_pose) {
    const FrameResult& result = frame.result;
    ++status_.frames;
    status_.with_pose += has_pose ? 1 : 0;
    status_.overflows += result.status == FrameStatus::overflow ? 1 : 0;
    status_.sequence = result.stamp.sequence;
    status_.finished_s = now_s;
    status_.captured_known = std::strcmp(result.stamp.clock, "monotonic") == 0;
    status_.captured_s = now_s;
    if (status_.captured_known) {
      status_.captured_s -= static_cast<double>(monotonic_ns() - result.stamp.mid_exposure_ns) / 1e9;
    }
    const std::size_t length = frame.label.copy(status_.label.data(), status_.label.size() - 1);
    status_.label[length] = '\0';
    status_.status = result.status;
    status_.mode = frame.mode;
    status_.is_tracked = frame.tracked != nullptr;
    if (frame.tracked != nullptr) {
      status_.is_whole = frame.tracked->whole;
      status_.why = frame.tracked->why;
    }
    status_.backend = frame.backend;
    status_.is_paced = frame.counts != nullptr;
    if (frame.counts != nullptr) status_.counts = *frame.counts;
    status_.health = frame.health;
    status_.engine = frame.engine;
    if (status_.frames > 1 && now_s - rated_s_ < 1) return;
    if (status_.frames > 1)
      status_.frames_per_second = static_cast<double>(status_.frames - rated_frames_) / (now_s - rated_s_);
    rated_s_ = now_s;
    rated_frames_ = status_.frames;
  }

  /// Copies what the encoder needs, unless it is still at work: then this frame is not shown.
  void take_picture(const ObservedFrame& frame, double now_s) {
    const std::unique_lock<std::mutex> lock(picture_mutex_, std::try_to_lock);
    if (!lock || is_filled_) return;
    pictured_s_ = now_s;
    const View2D<const u8> image = frame.image;
    pixels_.create(image.height, image.width, CV_8U);
    for (int y = 0; y < image.height; ++y) std::copy_n(image.row(y), image.width, pixels_.ptr(y));
    overlay_ = names_.of(frame);
    overlay_.captured_s = status_.captured_s;
    is_filled_ = true;
    filled_.notify_one();
  }

  void encode() {
    name_thread("berth-picture");
    make_ordinary();
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), 10);
    u64 number = 0;
    std::unique_lock<std::mutex> lock(picture_mutex_);
    while (true) {
      filled_.wait(lock, [this] { return is_over_ || is_filled_; });
      if (is_over_) return;
      // The stream's thread lets the picture be as long as it is filled.
      lock.unlock();
      const auto picture = std::make_shared<WebPicture>();
      picture->number = ++number;
      picture->about = to_line(to_json(overlay_));
      picture->jpeg = pictures_.jpeg(pixels_);
      feed_.show(picture);
      lock.lock();
      is_filled_ = false;
    }
  }

  WebFeed feed_;
  WebTimes times_;
  std::mutex about_mutex_;
  WebAbout about_;
  std::atomic<u64> about_version_ = 1;

  // The stream's thread's own.
  WebSampler sampler_;
  OverlayMaker names_;
  WebStatus status_;
  const std::vector<WebSample> none_;
  double sampled_s_ = -1, pictured_s_ = -1, rated_s_ = 0;
  u64 rated_frames_ = 0;

  std::mutex picture_mutex_;
  std::condition_variable filled_;
  bool is_filled_ = false, is_over_ = false;
  cv::Mat pixels_;
  PictureEncoder pictures_;
  Overlay overlay_;
  std::thread encoder_;
  /// Goes first: its threads use what is above.
  std::unique_ptr<WebServer> server_;
};

}  // namespace

std::shared_ptr<FrameObserver> make_web_view(const WebOptions& options, std::ostream& people,
                                             std::function<void()> end_run) {
  return std::make_shared<WebView>(options, people, std::move(end_run));
}

}  // namespace berth::cli
