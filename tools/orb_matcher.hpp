#pragma once

#include <array>
#include <functional>
#include <opencv2/features2d.hpp>
#include <string>
#include <vector>

#include "eval_tables.hpp"
#include "navigation/labelled_set.hpp"

namespace berth::cli {

/// What ORB says of an image at one ratio: of the template with the most good matches, how many it has and how many of
/// those a homography found by RANSAC agrees with.
struct OrbEvidence {
  int matches = 0;
  int inliers = 0;
};
/// One for each of kTableThresholds, which are Lowe's ratios here.
using OrbEvidences = std::array<OrbEvidence, kTableThresholds.size()>;

/// The paper's rival: ORB features (Rublee et al. 2011), each of the image matched by brute force with those of
/// template views, by Lowe's ratio test.
class OrbMatcher {
 public:
  static constexpr int kFeatures = 500;
  static constexpr int kTemplates = 24;
  /// Good matches, or inliers, that mean found.
  static constexpr int kLeast = 8;

  /// Cuts the templates out of the training part of a set of side × side px. Throws Error where none is fit.
  OrbMatcher(const std::string& set, int side);

  std::size_t templates() const { return templates_.size(); }
  /// u8[side, side]. The same for any number of threads and in any order of images: OpenCV runs on one, and its random
  /// numbers start anew.
  OrbEvidences match(const u8* pixels) const;

 private:
  struct Features {
    std::vector<cv::Point2f> points;
    cv::Mat descriptors;
  };
  Features features_of(const cv::Mat& image) const;

  int side_;
  cv::Ptr<cv::ORB> orb_;
  std::vector<Features> templates_;
};

/// Training images to cut templates from: whole targets, of each livery in turn the largest fit one in the next light,
/// so that both are spread evenly; `count` or what there is.
std::vector<LabelledImage> template_views(const std::vector<LabelledImage>& images, std::size_t count,
                                          const std::function<bool(const LabelledImage&)>& is_fit);

}  // namespace berth::cli
