#include "film_strip.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "as_mat.hpp"
#include "output_file.hpp"
#include "pose_algebra.hpp"

namespace berth::cli {
namespace {

const cv::Scalar kNetwork(220, 150, 40), kMarker(80, 230, 80), kText(60, 230, 255), kBlack(0, 0, 0);
constexpr int kBorder = 4;

void write_text(cv::Mat& picture, const std::string& text, cv::Point at) {
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.6, kBlack, 4, cv::LINE_AA);
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.6, kText, 1, cv::LINE_AA);
}

}  // namespace

void FilmStrip::add(View2D<const u8> image, const PilotFrame& found, const std::string& caption) {
  cv::Mat picture;
  cv::cvtColor(as_mat(image), picture, cv::COLOR_GRAY2BGR);
  if (found.has_position && !found.from_marker) {
    const auto& p = found.position_m;
    const auto at = image_of(camera_, p);
    const double radius = camera_.fx * diameter_m_ / p[2] / 2;
    cv::circle(picture, {cvRound(at[0]), cvRound(at[1])}, cvRound(std::min(radius, 4000.0)), kNetwork, 2, cv::LINE_AA);
  }
  if (found.marker != nullptr) {
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& a = found.marker->corners[i];
      const auto& b = found.marker->corners[(i + 1) % 4];
      cv::line(picture, {cvRound(a[0]), cvRound(a[1])}, {cvRound(b[0]), cvRound(b[1])}, kMarker, 2, cv::LINE_AA);
    }
  }
  write_text(picture, caption, {10, image.height - 14});
  cv::copyMakeBorder(picture, picture, kBorder, kBorder, kBorder, kBorder, cv::BORDER_CONSTANT, kBlack);
  frames_.push_back(picture);
}

void FilmStrip::write(const std::string& path, int columns) const {
  cv::Mat sheet;
  for (std::size_t first = 0; first < frames_.size(); first += static_cast<std::size_t>(columns)) {
    cv::Mat row;
    for (std::size_t i = first; i < first + static_cast<std::size_t>(columns); ++i) {
      const cv::Mat frame = i < frames_.size() ? frames_[i] : cv::Mat::zeros(frames_[0].size(), frames_[0].type());
      if (row.empty()) {
        row = frame.clone();
      } else {
        cv::hconcat(row, frame, row);
      }
    }
    if (sheet.empty()) {
      sheet = row;
    } else {
      cv::vconcat(sheet, row, sheet);
    }
  }
  cv::resize(sheet, sheet, {}, 0.75, 0.75, cv::INTER_AREA);
  write_png(path, "the picture", sheet);
}

}  // namespace berth::cli
