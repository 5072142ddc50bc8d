// Whole frames: where a network is pointed, what it puts forward, and that every backend sees the same.
#include "berth/navigator.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "berth/error.hpp"
#include "navigation/candidates.hpp"
#include "navigation/network_watch.hpp"
#include "navigation/track.hpp"
#include "navset/flight.hpp"
#include "support/faulty_backend.hpp"
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
  config.evidence = 0;  // what it sees is believed at once
  config.doubt = -8;
  return config;
}

/// The network that comes with Berth, which sees the target of simulated flights.
NavigatorConfig lite_config() {
  NavigatorConfig config;
  config.network = std::string(BERTH_SOURCE_DIR) + "/models/lite.berthnet";
  config.camera = navset::Flight::camera();
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

TEST(Navigator, BelievesWhatItSawInSomeFramesAndFollowsItUntilItIsTold) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Navigator navigator(*backend, 640, 480, lite_config());
  const navset::Flight flight(3, 240);
  int first = -1;
  for (int i = 0; i < 8; ++i) {
    const navset::FlightFrame frame = flight.frame(i);
    const Sighting& s = navigator.look(frame.image.view());
    EXPECT_EQ(s.tracked, i > 0) << i;
    EXPECT_EQ(s.candidates > 0, i == 0) << i << ": what is followed needs no search";
    EXPECT_NE(s.doubted, s.status == FrameStatus::ok) << i;
    if (s.status != FrameStatus::ok) continue;
    if (first < 0) first = i;
    EXPECT_NEAR(static_cast<double>(s.x_q16) / 65536, frame.x, frame.d_px / 4) << i;
    EXPECT_NEAR(static_cast<double>(s.y_q16) / 65536, frame.y, frame.d_px / 4) << i;
    EXPECT_NEAR(s.range_m, sim::length(frame.target.t), 1.5) << i;
  }
  EXPECT_GE(first, 1) << "one frame is not enough";
  EXPECT_LE(first, 3);
  navigator.forget();
  const Sighting again = navigator.look(flight.frame(8).image.view());
  EXPECT_TRUE(again.doubted);
  EXPECT_FALSE(again.tracked);
  EXPECT_GT(again.candidates, 0);
}

TEST(Navigator, FindsAgainWhatItLostWhereItWas) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Navigator navigator(*backend, 640, 480, lite_config());
  const navset::Flight flight(3, 240);
  for (int i = 0; i < 4; ++i) navigator.look(flight.frame(i).image.view());
  const GrayImage dark(640, 480);
  for (int i = 4; i < 6; ++i) {
    const Sighting& s = navigator.look(dark.view());
    EXPECT_EQ(s.status, FrameStatus::no_target) << "no frame has a position that does not show the target";
    EXPECT_FALSE(s.has_range);
  }
  EXPECT_EQ(navigator.look(flight.frame(6).image.view()).status, FrameStatus::ok) << "remembered";
  for (int i = 7; i < 14; ++i) navigator.look(dark.view());
  EXPECT_EQ(navigator.look(flight.frame(14).image.view()).status, FrameStatus::no_target) << "forgotten";
}

TEST(Navigator, AsksMoreOfTheFirstSight) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const navset::Flight flight(3, 240);
  const navset::FlightFrame frame = flight.frame(0);
  NavigatorConfig config = lite_config();
  config.first_threshold_q15 = 32768;
  Navigator stricter(*backend, 640, 480, config);
  const Sighting first = stricter.look(frame.image.view());
  EXPECT_FALSE(first.doubted);
  EXPECT_GT(first.score_q15, config.keep_threshold_q15);
  stricter.expect(frame.x, frame.y, frame.d_px);  // what is followed needs less
  const Sighting& s = stricter.look(frame.image.view());
  EXPECT_EQ(s.status, FrameStatus::ok);
  EXPECT_LT(s.score_q15, config.first_threshold_q15);
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
  config.doubt = std::nan("");
  EXPECT_THAT([&] { Navigator(*backend, 640, 480, config); }, ThrowsMessage<Error>(HasSubstr("doubt nan")));
  config = tiny_config();
  config.network = "no/such.berthnet";
  EXPECT_THAT([&] { Navigator(*backend, 640, 480, config); }, ThrowsMessage<Error>(HasSubstr("no/such.berthnet")));
  Navigator navigator(*backend, 640, 480, tiny_config());
  EXPECT_THAT([&] { navigator.look(noise(320, 240, 1).view()); },
              ThrowsMessage<Error>(HasSubstr("an image of 320x240 for a navigator of 640x480")));
}

TEST(Navigator, LooksFirstWhereItIsToldTo) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const navset::Flight flight(3, 240);
  const navset::FlightFrame frame = flight.frame(0);
  Navigator navigator(*backend, 640, 480, lite_config());
  navigator.expect(frame.x, frame.y, frame.d_px);
  const Sighting& sighting = navigator.look(frame.image.view());
  EXPECT_EQ(sighting.status, FrameStatus::ok);
  EXPECT_TRUE(sighting.tracked);
  EXPECT_EQ(sighting.candidates, 0);
  // 256 window pixels at full size, their middle at the place.
  EXPECT_EQ(sighting.window[2], 256);
  EXPECT_NEAR(sighting.window[0] / 256.0, frame.x + 0.5 - 128, 1);
  EXPECT_NEAR(sighting.window[1] / 256.0, frame.y + 0.5 - 128, 1);
  navigator.expect(1e300, -1e300, 1e300);
  EXPECT_NO_THROW(navigator.look(frame.image.view()));
  navigator.forget();
  EXPECT_FALSE(navigator.look(frame.image.view()).tracked);
}

/// Log-odds in 1/256 and a place, px.
Reading reading(int logit_q8, int x, int y, int d) {
  return {logit_q8, {std::int64_t{x} << 16, std::int64_t{y} << 16, std::int64_t{d} << 16}};
}

constexpr TrackRules kRules = {256, 512, 1024, 3};  // doubt, most, believed, memory

/// Asked before every look.
HealthConfig always(std::size_t scrub_bytes) {
  HealthConfig health;
  health.known_answer_every_ns = 1;
  health.scrub_bytes = scrub_bytes;
  return health;
}

TEST(NetworkWatch, BelievesEveryBackend) {
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty()) continue;
    const std::unique_ptr<Backend> backend = open_backend(status.name);
    NavigatorPlans plans(*backend, read_network(kTiny), 160, 120);
    NetworkWatch watch(always(100), plans);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(watch.is_believed(plans)) << status.name;
    EXPECT_EQ(watch.report().known_answers, 4u);
    EXPECT_EQ(watch.report().mode, HealthMode::nominal);
  }
}

TEST(NetworkWatch, FindsABitThatTurnsOver) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  NavigatorPlans plans(*backend, read_network(kTiny), 160, 120);
  // By memory in its turn, and by what comes of it at once.
  for (const bool scrubs : {true, false}) {
    for (const std::vector<Buffer*>& layer : {plans.device.constants().front(), plans.device.constants().back()}) {
      HealthConfig health = always(scrubs ? 4096 : 0);
      if (scrubs) health.known_answer_every_ns = 0;
      NetworkWatch watch(health, plans);
      EXPECT_TRUE(watch.is_believed(plans));
      // The sign of a channel's bias.
      u32* const word = static_cast<u32*>(layer[1]->host());
      *word ^= 0x01000000u;
      bool believed = true;
      const u64 around = 2 * watch.report().watched_bytes + 4096;
      while (believed && watch.report().checked_bytes < around) believed = watch.is_believed(plans) && scrubs;
      EXPECT_FALSE(watch.is_believed(plans));
      EXPECT_STREQ(watch.report().reason, scrubs ? "network weights" : "a wrong known answer");
      EXPECT_EQ(watch.report().alterations, scrubs ? 1u : 0u);
      EXPECT_EQ(watch.report().mode, HealthMode::failed);
      *word ^= 0x01000000u;
      EXPECT_FALSE(watch.is_believed(plans)) << "what was wrong once is not believed again";
    }
  }
  plans.network.logistic[7] ^= 4;
  NetworkWatch watch(always(0), plans);
  EXPECT_TRUE(watch.is_believed(plans)) << "which no sum goes by: it is for the memory's checks";
}

TEST(Navigator, IsNotBelievedOnceAPlanAnswersWrongly) {
  const std::unique_ptr<Backend> simd = open_backend("simd");
  NavigatorConfig config = tiny_config();
  config.health = always(8192);
  const GrayImage image = noise(160, 120, 5);
  NavigatorPlans like(*simd, read_network(kTiny), 160, 120);
  const std::array<const NetworkPlan*, 3> plans = {&like.search, &like.close, &like.follow};
  for (int plan = 0; plan < 3; ++plan) {
    // A sum, in the plan's second answer: the first, at start, is its replay -1.
    test::Fault fault;
    fault.flip_step = static_cast<int>(plans[static_cast<std::size_t>(plan)]->steps().size()) - 1;
    fault.flip_argument = 3;
    fault.flip_frame = 0;
    fault.flip_plan = plan;
    const auto faulty = test::make_faulty_backend(*simd, fault);
    Navigator navigator(*faulty, 160, 120, config);
    EXPECT_EQ(navigator.health().mode, HealthMode::nominal);
    for (int look = 0; look < 2; ++look) EXPECT_EQ(navigator.look(image.view()).status, FrameStatus::device_lost);
    EXPECT_EQ(navigator.health().mode, HealthMode::failed);
    EXPECT_STREQ(navigator.health().reason, "a wrong known answer");
    EXPECT_EQ(navigator.health().wrong_answers, 1u);
  }
}

TEST(Track, IsBelievedByEvidenceOfSeveralFrames) {
  Track sure(kRules);
  sure.begin(reading(2000, 100, 100, 50));  // counts 512, the most
  EXPECT_TRUE(sure.alive());
  EXPECT_FALSE(sure.believed());
  sure.see(reading(767, 101, 100, 50));  // 511
  EXPECT_FALSE(sure.believed());
  sure.see(reading(257, 101, 100, 50));  // 1
  EXPECT_TRUE(sure.believed());
  sure.see(reading(-2000, 101, 100, 50));
  EXPECT_TRUE(sure.believed()) << "only misses end it";
}

TEST(Track, IsGivenUpWithMoreAgainstItThanForItUnlessBelieved) {
  Track track(kRules);
  track.begin(reading(500, 100, 100, 50));  // 244
  track.see(reading(12, 100, 100, 50));     // -244
  EXPECT_TRUE(track.alive());
  track.see(reading(255, 100, 100, 50));
  EXPECT_FALSE(track.alive());
  track.begin(reading(500, 100, 100, 50));
  track.miss();
  EXPECT_FALSE(track.alive()) << "one miss is enough";
  track.believe({100 << 16, 100 << 16, 50 << 16});
  track.miss();
  track.miss();
  EXPECT_TRUE(track.believed());
  track.miss();
  EXPECT_FALSE(track.alive());
  EXPECT_FALSE(track.believed());
}

TEST(Track, FitsWhatIsNearWhereItMovesAndOfItsSize) {
  Track track(kRules);
  track.begin(reading(2000, 100, 100, 40));
  EXPECT_TRUE(track.fits(reading(0, 119, 100, 40).place));
  EXPECT_FALSE(track.fits(reading(0, 120, 100, 40).place)) << "its radius";
  EXPECT_FALSE(track.fits(reading(0, 100, 100, 60).place)) << "half as large again";
  EXPECT_TRUE(track.fits(reading(0, 100, 100, 59).place));
  EXPECT_TRUE(track.fits(reading(0, 100, 100, 27).place));
  EXPECT_FALSE(track.fits(reading(0, 100, 100, 26).place));
  track.see(reading(2000, 108, 92, 40));  // half of the step counts: 4, -4
  EXPECT_EQ(track.expected().x_q16, 112 << 16);
  EXPECT_EQ(track.expected().y_q16, 88 << 16);
  track.believe({108 << 16, 92 << 16, 40 << 16});
  EXPECT_EQ(track.expected().x_q16, 108 << 16);
  EXPECT_FALSE(track.fits(reading(0, 137, 92, 40).place));
  EXPECT_TRUE(track.fits(reading(0, 137, 92, 40).place, true)) << "sure to be one: three times as far";
  EXPECT_FALSE(track.fits(reading(0, 168, 92, 40).place, true));
  track.miss();
  EXPECT_TRUE(track.fits(reading(0, 137, 92, 40).place)) << "a quarter of d further for every miss";
  track.see(reading(2000, 116, 92, 40));  // 8 px in two frames: 4 a frame, half of it counts
  EXPECT_EQ(track.expected().x_q16, 118 << 16);
}

TEST(Track, WindowsAgreeWhereHalfOfThemFit) {
  Track track(kRules);
  track.begin(reading(2000, 100, 100, 40));
  Reading all;
  ASSERT_TRUE(agreed(track, {reading(100, 98, 100, 40), reading(300, 104, 102, 44)}, -512, all));
  EXPECT_EQ(all.logit_q8, 200);
  EXPECT_EQ(all.place.x_q16, 101 << 16);
  EXPECT_EQ(all.place.y_q16, 101 << 16);
  EXPECT_EQ(all.place.d_q16, 42 << 16);
  ASSERT_TRUE(agreed(track, {reading(1000, 98, 100, 40), reading(2000, 300, 100, 40)}, -512, all));
  EXPECT_EQ(all.logit_q8, 244) << "one that sees it elsewhere speaks against it";
  EXPECT_EQ(all.place.x_q16, 98 << 16);
  EXPECT_FALSE(
      agreed(track, {reading(2000, 98, 100, 40), reading(2000, 300, 100, 40), reading(2000, 300, 99, 40)}, -512, all));
}

}  // namespace
}  // namespace berth
