#include <cmath>
#include <cstdio>
#include <opencv2/videoio.hpp>
#include <opencv2/videoio/registry.hpp>

#include "berth/error.hpp"
#include "camera/mat_gray.hpp"
#include "camera/sources.hpp"

namespace berth {
namespace {

class VideoSource final : public Source {
 public:
  explicit VideoSource(const std::string& path) : path_(path) {
    std::FILE* file = std::fopen(path.c_str(), "rb");
    if (file == nullptr) throw Error(path + ": the file cannot be read; check the name and its permissions");
    const bool empty = std::fgetc(file) == EOF;
    std::fclose(file);
    if (empty) throw Error(path + ": the file is empty (0 bytes) or a folder; name a video file");
    if (!open_by_codec()) {
      throw Error(path + ": OpenCV cannot open it as a video; convert it, e.g. to MP4 (H.264) or AVI (MJPG)");
    }
  }

  std::optional<SourceFrame> next() override {
    if (!video_.read(picture_) || picture_.empty()) {
      if (sequence_ == 0) throw_no_frame();
      return std::nullopt;
    }
    if (picture_.depth() != CV_8U) throw Error(path_ + ": the video's pixels are not 8 bit; convert it to 8 bit");
    check_image_size(static_cast<u64>(picture_.cols), static_cast<u64>(picture_.rows), path_);
    const double time_ms = video_.get(cv::CAP_PROP_POS_MSEC);
    SourceFrame frame;
    frame.stamp.sequence = sequence_++;
    frame.stamp.exposure_start_ns = frame.stamp.mid_exposure_ns = std::llround(time_ms * 1e6);
    frame.stamp.clock = "video";
    frame.label = path_ + "#" + std::to_string(frame.stamp.sequence);
    frame.image = to_gray<u8>(picture_);
    return frame;
  }

  std::optional<std::size_t> size() const override {
    const double frames = video_.get(cv::CAP_PROP_FRAME_COUNT);
    if (!(frames > 0 && frames < 1e9)) return std::nullopt;
    return static_cast<std::size_t>(frames);
  }

 private:
  /// FFmpeg where OpenCV has it: asked after it, GStreamer takes most of a second to say no, and says it in red.
  bool open_by_codec() {
    if (!cv::videoio_registry::hasBackend(cv::CAP_FFMPEG)) return video_.open(path_);
    return video_.open(path_, cv::CAP_FFMPEG) || video_.open(path_, cv::CAP_OPENCV_MJPEG);
  }

  void throw_no_frame() {
    if (told_) return;
    told_ = true;
    throw Error(path_ + ": no frame of the video can be decoded; convert it, e.g. to MP4 (H.264) or AVI (MJPG)");
  }

  std::string path_;
  cv::VideoCapture video_;
  cv::Mat picture_;
  u64 sequence_ = 0;
  bool told_ = false;
};

}  // namespace

std::unique_ptr<Source> open_video(const std::string& path) { return std::make_unique<VideoSource>(path); }

}  // namespace berth
