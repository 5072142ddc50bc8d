// Whole frames: where a network is pointed, what it puts forward, and that every backend sees the same.
#include "berth/navigator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "berth/error.hpp"
#include "navigation/candidates.hpp"
#include "support/pictures.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const std::string kTiny = std::string(BERTH_SOURCE_DIR) + "/training/tests/data/tiny.berthnet";

NavigatorConfig tiny_config() {
  NavigatorConfig config;
  config.network = kTiny;
  // The tiny network knows nothing: its scores lie around a half, so every frame has some of both kinds.
  config.threshold_q15 = 17000;
  config.first_threshold_q15 = 17000;
  config.search_threshold_q15 = 16500;
  return config;
}

GrayImage noise(int width, int height, u64 seed) {
  GrayImage image(width, height);
  pictures::Random random(seed);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.view().at(x, y) = static_cast<u8>(random.below(256));
  }
  return image;
}

TEST(Place, OfAWindowIsWhereItsPixelsAre) {
  NetworkOutput output;
  output.x_q16 = 100 << 16;
  output.y_q16 = 0;
  output.d_q16 = 50 << 16;
  const s32 same[3] = {0, 0, 256};
  EXPECT_EQ(place_in_frame(output, same, 0, 0).x_q16, 100 << 16);
  EXPECT_EQ(place_in_frame(output, same, 0, 0).y_q16, 0);
  EXPECT_EQ(place_in_frame(output, same, 32, 64).x_q16, 132 << 16);
  // Half the size: window pixel 0 covers frame pixels 0 and 1, whose middle is 0.5.
  const s32 half[3] = {0, 10 * 256, 512};
  EXPECT_EQ(place_in_frame(output, half, 0, 0).x_q16, (200 << 16) + 32768);
  EXPECT_EQ(place_in_frame(output, half, 0, 0).y_q16, (10 << 16) + 32768);
  EXPECT_EQ(place_in_frame(output, half, 0, 0).d_q16, 100 << 16);
}

TEST(Navigator, LooksTheSameOnEveryBackend) {
  std::vector<std::vector<std::int64_t>> seen;
  std::vector<std::string> names;
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty()) continue;
    const std::unique_ptr<Backend> backend = open_backend(status.name);
    Navigator navigator(*backend, 320, 240, tiny_config());
    std::vector<std::int64_t> all;
    for (u64 seed = 0; seed < 4; ++seed) {
      const Sighting& s = navigator.look(noise(320, 240, seed).view());
      all.insert(all.end(), {s.score_q15, s.x_q16, s.y_q16, s.d_q16, s.window[0], s.window[2], s.candidates,
                             s.tracked ? 1 : 0, static_cast<std::int64_t>(s.status)});
    }
    seen.push_back(all);
    names.push_back(status.name);
  }
  ASSERT_GE(seen.size(), 3u);
  for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_EQ(seen[i], seen[0]) << names[i] << " against " << names[0];
}

TEST(Navigator, FollowsUntilItIsTold) {
  NavigatorConfig config = tiny_config();
  config.threshold_q15 = 1;
  config.first_threshold_q15 = 1;
  config.search_threshold_q15 = 1;
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Navigator navigator(*backend, 640, 480, config);
  const GrayImage image = noise(640, 480, 5);
  const Sighting first = navigator.look(image.view());
  EXPECT_EQ(first.status, FrameStatus::ok);
  EXPECT_FALSE(first.tracked);
  EXPECT_GT(first.candidates, 0);
  EXPECT_TRUE(navigator.look(image.view()).tracked);
  navigator.forget();
  const Sighting again = navigator.look(image.view());
  EXPECT_FALSE(again.tracked);
  EXPECT_EQ(again.x_q16, first.x_q16);
  EXPECT_EQ(again.d_q16, first.d_q16);
}

TEST(Navigator, AsksMoreOfTheFirstSight) {
  NavigatorConfig config = tiny_config();
  config.threshold_q15 = 1;
  config.search_threshold_q15 = 1;
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const GrayImage image = noise(640, 480, 5);
  config.first_threshold_q15 = 1;
  const int score = Navigator(*backend, 640, 480, config).look(image.view()).score_q15;
  config.first_threshold_q15 = score + 1;
  Navigator stricter(*backend, 640, 480, config);
  EXPECT_EQ(stricter.look(image.view()).status, FrameStatus::no_target);
  stricter.expect(320, 240, 96);  // what is followed needs less
  EXPECT_EQ(stricter.look(image.view()).status, FrameStatus::ok);
}

TEST(Navigator, GivesBearingAndRangeThroughTheCamera) {
  NavigatorConfig config = tiny_config();
  config.threshold_q15 = 1;
  config.first_threshold_q15 = 1;
  config.search_threshold_q15 = 1;
  config.camera = paper_camera();
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Navigator navigator(*backend, 640, 480, config);
  const Sighting& s = navigator.look(noise(640, 480, 5).view());
  ASSERT_TRUE(s.has_range);
  const auto pixel = config.camera->project(s.bearing[0] / s.bearing[2], s.bearing[1] / s.bearing[2]);
  EXPECT_NEAR(pixel[0], static_cast<double>(s.x_q16) / 65536, 1e-3);
  EXPECT_NEAR(pixel[1], static_cast<double>(s.y_q16) / 65536, 1e-3);
  const double depth = s.range_m * s.bearing[2];
  EXPECT_NEAR(depth * static_cast<double>(s.d_q16) / 65536, (config.camera->fx + config.camera->fy) / 2 * 0.4, 1e-6);
  EXPECT_NEAR(s.range_deviation_m, config.range_deviation * s.range_m, 1e-12);
}

TEST(Navigator, RefusesWhatItCannotDo) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  EXPECT_THAT([&] { Navigator(*backend, 32, 480, tiny_config()); }, ThrowsMessage<Error>(HasSubstr("32x480")));
  NavigatorConfig config = tiny_config();
  config.target_diameter_m = 0;
  EXPECT_THAT([&] { Navigator(*backend, 640, 480, config); }, ThrowsMessage<Error>(HasSubstr("target_diameter_m")));
  config = tiny_config();
  config.network = "no/such.berthnet";
  EXPECT_THAT([&] { Navigator(*backend, 640, 480, config); }, ThrowsMessage<Error>(HasSubstr("no/such.berthnet")));
  Navigator navigator(*backend, 640, 480, tiny_config());
  EXPECT_THAT([&] { navigator.look(noise(320, 240, 1).view()); },
              ThrowsMessage<Error>(HasSubstr("an image of 320x240 for a navigator of 640x480")));
}

TEST(Navigator, LooksFirstWhereItIsToldTo) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  NavigatorConfig config = tiny_config();
  config.threshold_q15 = 1;  // whatever it looks at is a target
  Navigator navigator(*backend, 640, 480, config);
  navigator.expect(400, 100, 96);
  const GrayImage image = noise(640, 480, 3);
  const Sighting& sighting = navigator.look(image.view());
  EXPECT_TRUE(sighting.tracked);
  // 256 window pixels at full size, their middle at the place: 400 + 1/2 - 128.
  EXPECT_EQ(sighting.window, (std::array<s32, 3>{272 * 256, -28 * 256, 256}));
  navigator.expect(1e300, -1e300, 1e300);
  EXPECT_NO_THROW(navigator.look(image.view()));
  navigator.forget();
  EXPECT_FALSE(navigator.look(image.view()).tracked);
}

}  // namespace
}  // namespace berth
