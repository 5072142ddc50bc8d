#include "orb_matcher.hpp"

#include <algorithm>
#include <map>
#include <opencv2/calib3d.hpp>
#include <set>

#include "berth/error.hpp"

namespace berth::cli {
namespace {

/// Visible shares are written with four digits.
constexpr double kWhole = 0.9995;
/// Among fewer the nearest one stands out by chance, and the ratio test says little.
constexpr int kLeastFeatures = 100;
/// RANSAC: a match within so many px of where the homography puts it is an inlier.
constexpr double kReprojection_px = 3;

/// OpenCV on one thread while it lives.
class OneThread {
 public:
  OneThread() : before_(cv::getNumThreads()) { cv::setNumThreads(1); }
  ~OneThread() { cv::setNumThreads(before_); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  int before_;
};

/// A feature of the image and the nearest one of a template.
struct Match {
  int of_template = 0;
  int of_image = 0;
  int distance = 0;
  int next_distance = 0;
  bool good(int hundredths) const { return 100 * distance < hundredths * next_distance; }
};

int inliers_of(const std::vector<cv::Point2f>& from, const std::vector<cv::Point2f>& to) {
  cv::setRNGSeed(0);
  std::vector<u8> mask;
  const cv::Mat homography = cv::findHomography(from, to, cv::RANSAC, kReprojection_px, mask);
  return homography.empty() ? 0 : static_cast<int>(std::count(mask.begin(), mask.end(), u8{1}));
}

}  // namespace

std::vector<LabelledImage> template_views(const std::vector<LabelledImage>& images, std::size_t count,
                                          const std::function<bool(const LabelledImage&)>& is_fit) {
  std::map<std::string, std::map<std::string, std::vector<LabelledImage>>> left;  // livery, light: the largest last
  std::set<std::string> all_lights;
  for (const LabelledImage& image : images) {
    if (!image.present || image.visible < kWhole) continue;
    left[image.livery][image.light].push_back(image);
    all_lights.insert(image.light);
  }
  for (auto& [livery, of_livery] : left) {
    for (auto& [light, views] : of_livery) {
      std::sort(views.begin(), views.end(), [](const LabelledImage& a, const LabelledImage& b) {
        return a.d != b.d ? a.d < b.d : a.index > b.index;
      });
    }
  }
  const std::vector<std::string> lights(all_lights.begin(), all_lights.end());
  std::vector<LabelledImage> chosen;
  // A round takes one view of each livery, each in another light than the livery before; after as many rounds as there
  // are lights, every livery was taken once in each.
  for (std::size_t round = 0, idle = 0; idle < lights.size(); ++round) {
    std::size_t livery = round;
    ++idle;
    for (auto& [name, of_livery] : left) {
      std::vector<LabelledImage>& views = of_livery[lights[livery++ % lights.size()]];
      while (!views.empty() && !is_fit(views.back())) views.pop_back();
      if (views.empty()) continue;
      chosen.push_back(views.back());
      if (chosen.size() == count) return chosen;
      views.pop_back();
      idle = 0;
    }
  }
  return chosen;
}

OrbMatcher::OrbMatcher(const std::string& set, int side) : side_(side), orb_(cv::ORB::create(kFeatures)) {
  const OneThread one;
  const LabelledSet training(set, "train", side);
  std::vector<u8> pixels(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  const auto features_of_view = [&](const LabelledImage& view) {
    training.read(view, pixels.data());
    const cv::Rect box(cv::Point(view.box[0], view.box[1]), cv::Point(view.box[2] + 1, view.box[3] + 1));
    return features_of(cv::Mat(side, side, CV_8U, pixels.data())(box));
  };
  const auto is_rich = [&](const LabelledImage& view) {
    return features_of_view(view).descriptors.rows >= kLeastFeatures;
  };
  for (const LabelledImage& view : template_views(training.images(), kTemplates, is_rich)) {
    templates_.push_back(features_of_view(view));
  }
  if (templates_.empty()) {
    throw Error(set + ": no whole target of the training part has the " + std::to_string(kLeastFeatures) +
                " ORB features of a template; use a set with larger ones or leave out --orb");
  }
}

OrbMatcher::Features OrbMatcher::features_of(const cv::Mat& image) const {
  Features features;
  std::vector<cv::KeyPoint> keypoints;
  orb_->detectAndCompute(image, cv::noArray(), keypoints, features.descriptors);
  cv::KeyPoint::convert(keypoints, features.points);
  return features;
}

OrbEvidences OrbMatcher::match(const u8* pixels) const {
  const OneThread one;
  // OpenCV has no const view of pixels; nothing writes them.
  const Features seen = features_of(cv::Mat(side_, side_, CV_8U, const_cast<u8*>(pixels)));
  OrbEvidences best;
  if (seen.descriptors.empty()) return best;
  const cv::BFMatcher matcher(cv::NORM_HAMMING);
  std::array<std::size_t, kTableThresholds.size()> best_template{};
  std::vector<std::vector<Match>> matches(templates_.size());
  for (std::size_t t = 0; t < templates_.size(); ++t) {
    std::vector<std::vector<cv::DMatch>> pairs;
    matcher.knnMatch(seen.descriptors, templates_[t].descriptors, pairs, 2);
    for (const std::vector<cv::DMatch>& pair : pairs) {
      matches[t].push_back(
          {pair[0].trainIdx, pair[0].queryIdx, static_cast<int>(pair[0].distance), static_cast<int>(pair[1].distance)});
    }
    for (std::size_t i = 0; i < best.size(); ++i) {
      const int good = static_cast<int>(std::count_if(matches[t].begin(), matches[t].end(),
                                                      [&](const Match& m) { return m.good(kTableThresholds[i]); }));
      if (good <= best[i].matches) continue;
      best[i].matches = good;
      best_template[i] = t;
    }
  }
  for (std::size_t i = 0; i < best.size(); ++i) {
    if (best[i].matches < kLeast) continue;
    std::vector<cv::Point2f> from;
    std::vector<cv::Point2f> to;
    for (const Match& match : matches[best_template[i]]) {
      if (!match.good(kTableThresholds[i])) continue;
      from.push_back(templates_[best_template[i]].points[static_cast<std::size_t>(match.of_template)]);
      to.push_back(seen.points[static_cast<std::size_t>(match.of_image)]);
    }
    best[i].inliers = inliers_of(from, to);
  }
  return best;
}

}  // namespace berth::cli
