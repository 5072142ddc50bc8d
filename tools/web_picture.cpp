#include "web_picture.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace berth::cli {
namespace {

constexpr int kQuality = 80;
/// Wider pictures are sent smaller.
constexpr int kWidest = 1280;

}  // namespace

std::string PictureEncoder::jpeg(const cv::Mat& pixels) {
  const double shrink = static_cast<double>(kWidest) / pixels.cols;
  if (shrink < 1) cv::resize(pixels, smaller_, cv::Size(), shrink, shrink, cv::INTER_AREA);
  cv::imencode(".jpg", shrink < 1 ? smaller_ : pixels, jpeg_, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  return {jpeg_.begin(), jpeg_.end()};
}

}  // namespace berth::cli
