// The ORB baseline: which views become templates, and what matches them.
#include "orb_matcher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "berth/error.hpp"
#include "support/block_picture.hpp"
#include "support/scratch_folder.hpp"

namespace berth::cli {
namespace {

using test::block_picture;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr int kSide = 256;

LabelledImage whole(std::size_t index, const char* livery, const char* light, double d) {
  LabelledImage image;
  image.index = index;
  image.present = true;
  image.visible = 1;
  image.livery = livery;
  image.light = light;
  image.d = d;
  return image;
}

std::vector<std::size_t> indices(const std::vector<LabelledImage>& images) {
  std::vector<std::size_t> all;
  for (const LabelledImage& image : images) all.push_back(image.index);
  return all;
}

bool any(const LabelledImage& /*image*/) { return true; }

TEST(TemplateViews, SpreadOverLiveriesAndLights) {
  std::vector<LabelledImage> images = {
      whole(0, "gold", "sun", 50),   whole(1, "gold", "sun", 90),   whole(2, "gold", "lamps", 200),
      whole(3, "white", "sun", 80),  whole(4, "white", "sun", 80),  whole(5, "white", "lamps", 60),
      whole(6, "white", "sun", 220), whole(7, "black", "sun", 300),
  };
  images[6].visible = 0.99;
  images[7].present = false;
  // gold in lamps, white in the sun, then the other way round; then what is left: of equal ones the first.
  EXPECT_THAT(indices(template_views(images, 4, any)), ElementsAre(2, 3, 1, 5));
  EXPECT_THAT(indices(template_views(images, 3, any)), ElementsAre(2, 3, 1));
  EXPECT_THAT(indices(template_views(images, 24, any)), ElementsAre(2, 3, 1, 5, 4, 0));
  const auto small = [](const LabelledImage& image) { return image.d < 85; };
  EXPECT_THAT(indices(template_views(images, 24, small)), ElementsAre(3, 0, 5, 4));
  EXPECT_TRUE(template_views({}, 24, any).empty());
}

/// One training image of blocks with a target that fills the box.
void write_set(const test::ScratchFolder& folder, const std::string& box, const std::vector<u8>& pixels) {
  folder.write("labels.csv",
               "index,part,class,subject,visible,x0,y0,x1,y1,d_px,x,y,depth_m,light,background,livery\n"
               "0,train,1,target,1.0," +
                   box + ",180,128,128,2.0,sun,lab-1,gold-foil\n");
  folder.write("images.u8", pixels);
}

TEST(OrbMatcher, FindsItsTemplateAndNothingElse) {
  const test::ScratchFolder folder;
  write_set(folder, "30,30,225,225", block_picture(1, kSide));
  const OrbMatcher matcher(folder.path(), kSide);
  EXPECT_EQ(matcher.templates(), 1U);
  const OrbEvidences same = matcher.match(block_picture(1, kSide, 7).data());
  const OrbEvidences another = matcher.match(block_picture(2, kSide).data());
  for (std::size_t i = 0; i < same.size(); ++i) {
    EXPECT_GE(same[i].inliers, OrbMatcher::kLeast);
    EXPECT_LE(same[i].inliers, same[i].matches);
    EXPECT_GE(same[i].matches, same[i == 0 ? 0 : i - 1].matches);
  }
  EXPECT_LT(another[0].matches, OrbMatcher::kLeast);
  EXPECT_EQ(another[0].inliers, 0);
  const OrbEvidences nothing = matcher.match(std::vector<u8>(kSide * kSide, 90).data());
  for (const OrbEvidence& evidence : nothing) EXPECT_EQ(evidence.matches, 0);
}

TEST(OrbMatcher, DependsOnNoThreadsAndNoHistory) {
  const test::ScratchFolder folder;
  write_set(folder, "30,30,225,225", block_picture(1, kSide));
  const OrbMatcher matcher(folder.path(), kSide);
  const auto words = [&](int shift) {
    std::vector<int> all;
    for (const OrbEvidence& e : matcher.match(block_picture(1, kSide, shift).data())) {
      all.push_back(e.matches);
      all.push_back(e.inliers);
    }
    return all;
  };
  const int threads = cv::getNumThreads();
  const std::vector<int> first = words(5);
  cv::setNumThreads(2);
  cv::setRNGSeed(77);
  EXPECT_NE(words(9), first);
  EXPECT_EQ(words(5), first);
  EXPECT_EQ(cv::getNumThreads(), 2);
  cv::setNumThreads(threads);
}

TEST(OrbMatcher, RefusesASetWithoutATemplate) {
  const test::ScratchFolder folder;
  const auto complaint = [&] {
    try {
      const OrbMatcher matcher(folder.path(), kSide);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  write_set(folder, "30,30,225,225", std::vector<u8>(kSide * kSide, 90));
  EXPECT_THAT(complaint(),
              HasSubstr(folder.path() + ": no whole target of the training part has the 100 ORB features"));
  write_set(folder, "30,30,225,256", block_picture(1, kSide));
  EXPECT_THAT(complaint(), HasSubstr("line 2: field 'y1' is 256, not within the image's 256 px"));
  write_set(folder, "30,30,29,200", block_picture(1, kSide));
  EXPECT_THAT(complaint(), HasSubstr("line 2: the box ends before it begins"));
}

}  // namespace
}  // namespace berth::cli
