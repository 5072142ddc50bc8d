// Cameras' pixels as gray: every layout against values worked out by hand, or by plain code that interpolates.
#include "camera/pixel_format.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace berth {
namespace {

using testing::ElementsAre;

std::vector<int> gray_of(PixelFormat format, const std::vector<u8>& bytes, int width, int height, std::size_t stride) {
  GrayImage image(width, height);
  EXPECT_TRUE(to_gray(bytes.data(), bytes.size(), stride, format, image.view())) << name_of(format);
  std::vector<int> all;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) all.push_back(image.view().at(x, y));
  }
  return all;
}

TEST(PixelFormat, TakesEightBitsAsTheyAreAndLeavesPaddingOut) {
  EXPECT_THAT(gray_of(PixelFormat::mono8, {1, 2, 99, 3, 4}, 2, 2, 3), ElementsAre(1, 2, 3, 4));
}

TEST(PixelFormat, ScalesWordsToTheNearestOf255) {
  EXPECT_THAT(gray_of(PixelFormat::mono10, {0, 0, 0xff, 0x03, 2, 0, 3, 0}, 4, 1, 8), ElementsAre(0, 255, 0, 1));
  // Bits above the value are not the pixel's.
  EXPECT_THAT(gray_of(PixelFormat::mono12, {0xff, 0xff, 0x00, 0x08}, 2, 1, 4), ElementsAre(255, 128));
  EXPECT_THAT(gray_of(PixelFormat::mono16, {0x80, 0x00, 0x81, 0x00, 0xff, 0xff}, 3, 1, 6), ElementsAre(0, 1, 255));
}

TEST(PixelFormat, UnpacksBitsFromTheLeastSignificantOn) {
  // 1023, 0, 512, 3 in ten bits each.
  EXPECT_THAT(gray_of(PixelFormat::mono10_packed, {0xff, 0x03, 0x00, 0xe0, 0x00}, 4, 1, 5),
              ElementsAre(255, 0, 128, 1));
  // 4095, 2048, 0 in twelve.
  EXPECT_THAT(gray_of(PixelFormat::mono12_packed, {0xff, 0x0f, 0x80, 0x00, 0x00}, 3, 1, 5), ElementsAre(255, 128, 0));
}

TEST(PixelFormat, TakesTheLumaOfChromaFormats) {
  EXPECT_THAT(gray_of(PixelFormat::yuyv, {10, 128, 20, 128}, 2, 1, 4), ElementsAre(10, 20));
  EXPECT_THAT(gray_of(PixelFormat::uyvy, {128, 10, 128, 20}, 2, 1, 4), ElementsAre(10, 20));
  EXPECT_THAT(gray_of(PixelFormat::nv12, {1, 2, 3, 4, 128, 128}, 2, 2, 2), ElementsAre(1, 2, 3, 4));
}

TEST(PixelFormat, WeighsColoursAsImageFilesAreWeighed) {
  EXPECT_THAT(gray_of(PixelFormat::rgb8, {255, 0, 0, 0, 255, 0, 0, 0, 255}, 3, 1, 9), ElementsAre(76, 150, 29));
  EXPECT_THAT(gray_of(PixelFormat::bgr8, {255, 0, 0, 0, 255, 0, 0, 0, 255}, 3, 1, 9), ElementsAre(29, 150, 76));
}

// (R + 2 G + B) / 4 of the bilinear interpolation of a red-first pattern, channel by channel.
int interpolated(const std::vector<u8>& mosaic, int width, int x, int y) {
  const auto mean = [&](auto&& is_channel) {
    double sum = 0, weight = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (!is_channel((x + dx) % 2, (y + dy) % 2)) continue;
        const double w = (2 - std::abs(dx)) * (2 - std::abs(dy));
        sum += w * mosaic[static_cast<std::size_t>((y + dy) * width + x + dx)];
        weight += w;
      }
    }
    return sum / weight;
  };
  const double red = mean([](int column, int row) { return column == 0 && row == 0; });
  const double blue = mean([](int column, int row) { return column == 1 && row == 1; });
  const double green = mean([](int column, int row) { return column != row; });
  return static_cast<int>((red + 2 * green + blue) / 4 + 0.5);
}

TEST(PixelFormat, InterpolatesBayerPatterns) {
  constexpr int kSide = 12;
  std::vector<u8> mosaic;
  u32 random = 1;
  for (int i = 0; i < kSide * kSide; ++i) {
    random = random * 1664525 + 1013904223;
    mosaic.push_back(static_cast<u8>(random >> 24));
  }
  const std::vector<int> gray = gray_of(PixelFormat::bayer8, mosaic, kSide, kSide, kSide);
  for (int y = 1; y + 1 < kSide; ++y) {
    for (int x = 1; x + 1 < kSide; ++x) {
      EXPECT_EQ(gray[static_cast<std::size_t>(y * kSide + x)], interpolated(mosaic, kSide, x, y)) << x << ", " << y;
    }
  }
}

TEST(PixelFormat, KeepsAnEvenColourEvenUpToTheBorder) {
  // Red 200, green 100, blue 40: (200 + 200 + 40) / 4.
  std::vector<u8> mosaic;
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 4; ++x) mosaic.push_back(x % 2 != y % 2 ? 100 : y % 2 == 0 ? 200 : 40);
  }
  EXPECT_THAT(gray_of(PixelFormat::bayer8, mosaic, 4, 5, 4), testing::Each(110));
}

TEST(PixelFormat, RefusesFramesThatAreTooShort) {
  for (const PixelFormat format : {PixelFormat::mono8, PixelFormat::mono16, PixelFormat::mono10_packed,
                                   PixelFormat::mono12_packed, PixelFormat::yuyv, PixelFormat::bgr8}) {
    const std::size_t row = row_bytes(format, 5);
    const std::vector<u8> bytes(2 * row + 3, 7);
    GrayImage image(5, 2);
    EXPECT_TRUE(to_gray(bytes.data(), 2 * row + 3, row + 3, format, image.view())) << name_of(format);
    EXPECT_FALSE(to_gray(bytes.data(), 2 * row + 2, row + 3, format, image.view())) << name_of(format);
    EXPECT_FALSE(to_gray(bytes.data(), 2 * row + 3, row - 1, format, image.view())) << name_of(format);
  }
}

}  // namespace
}  // namespace berth
