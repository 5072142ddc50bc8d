#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "berth/pipeline.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/pictures.hpp"

namespace berth::test::pipeline {

constexpr int kWidth = 280;  // rows are padded
constexpr int kHeight = 210;
constexpr std::size_t kPictures = 6;

inline const std::vector<GrayImage>& frames() {
  static const std::vector<GrayImage> all = [] {
    std::vector<GrayImage> images;
    for (std::size_t i = 0; i + 1 < kPictures; ++i) {
      images.push_back(sim::render(sim::corpus_scene("easy", static_cast<int>(i), kWidth, kHeight)));
    }
    images.push_back(pictures::mazes(kWidth, kHeight, 3));
    return images;
  }();
  return all;
}

inline View2D<const u8> picture(u64 sequence) { return frames()[sequence % kPictures].view(); }

inline DetectorConfig posing() {
  DetectorConfig config;
  config.camera = paper_camera(kWidth, kHeight);
  config.marker_size_m = 0.1;
  return config;
}

inline FrameStamp stamped(u64 sequence) {
  FrameStamp stamp;
  stamp.sequence = sequence;
  return stamp;
}

/// What the plain detector makes of every picture.
inline std::vector<FrameResult> expected(const DetectorConfig& config) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector detector(*backend, kWidth, kHeight, config);
  std::vector<FrameResult> results;
  for (u64 i = 0; i < kPictures; ++i) results.push_back(detector.detect(picture(i)));
  return results;
}

inline void expect_same(const FrameResult& found, const FrameResult& wanted) {
  EXPECT_EQ(found.status, wanted.status);
  EXPECT_EQ(found.quads, wanted.quads);
  ASSERT_EQ(found.detections.size(), wanted.detections.size());
  for (std::size_t i = 0; i < wanted.detections.size(); ++i) {
    const Detection& a = found.detections[i];
    const Detection& b = wanted.detections[i];
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.corners, b.corners);
    EXPECT_EQ(a.has_pose, b.has_pose);
    EXPECT_EQ(a.pose.R, b.pose.R);
    EXPECT_EQ(a.pose.t, b.pose.t);
    ASSERT_EQ(a.pose_uncertainty.has_value(), b.pose_uncertainty.has_value());
    if (b.pose_uncertainty) {
      EXPECT_EQ(a.pose_uncertainty->covariance, b.pose_uncertainty->covariance);
    }
  }
  ASSERT_EQ(found.digests.size(), wanted.digests.size());
  for (std::size_t i = 0; i < wanted.digests.size(); ++i) {
    EXPECT_EQ(found.digests[i].digest, wanted.digests[i].digest) << wanted.digests[i].stage;
  }
}

/// Checks each frame that is delivered against the detector's result, and that none comes before an earlier one.
class Judge {
 public:
  explicit Judge(const DetectorConfig& config) : wanted_(expected(config)) {}
  void operator()(const PipelineFrame& frame) {
    const u64 sequence = frame.result->stamp.sequence;
    EXPECT_TRUE(seen_ == 0 || sequence > last_) << sequence << " after " << last_;
    SCOPED_TRACE(sequence);
    expect_same(*frame.result, wanted_[sequence % kPictures]);
    EXPECT_EQ(frame.image.at(kWidth - 1, 7), picture(sequence).at(kWidth - 1, 7));
    last_ = sequence;
    ++seen_;
  }
  u64 seen() const { return seen_; }

 private:
  std::vector<FrameResult> wanted_;
  u64 last_ = 0, seen_ = 0;
};

}  // namespace berth::test::pipeline
