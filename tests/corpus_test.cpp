// The corpora that recall is measured on: their bits, and that they hold what docs/simulator.md says.
#include "sim/corpus.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "berth/error.hpp"
#include "sim/clutter.hpp"
#include "sim/render.hpp"
#include "support/image_digest.hpp"

namespace berth::sim {
namespace {

struct CorpusGolden {
  const char* name;
  u64 first, fourth;
};

class EveryCorpus : public testing::TestWithParam<CorpusGolden> {};

TEST_P(EveryCorpus, HasTheGoldenBits) {
  const CorpusGolden golden = GetParam();
  EXPECT_EQ(test::image_digest(render(corpus_scene(golden.name, 0, 320, 240))), golden.first)
      << std::hex << golden.name;
  EXPECT_EQ(test::image_digest(render(corpus_scene(golden.name, 3, 320, 240))), golden.fourth)
      << std::hex << golden.name;
}

INSTANTIATE_TEST_SUITE_P(Sim, EveryCorpus,
                         testing::Values(CorpusGolden{"easy", 0xd2d8cf67a52b9dfau, 0x6fa245c77582fc22u},
                                         CorpusGolden{"dock", 0x9beac23f246976c5u, 0x56e6d12a7535da42u},
                                         CorpusGolden{"hard", 0x708c56b07fbd48f2u, 0xc78b353b370c1eb3u},
                                         CorpusGolden{"tiny", 0xe7a6cca0209d7b07u, 0x32477d926f0caf49u},
                                         CorpusGolden{"cluttered", 0xa92d2a80d62f5b21u, 0xb7ee7c8fbffa721fu},
                                         CorpusGolden{"dark", 0xb52389f92e41b67fu, 0xce3b3bb322d09374u},
                                         CorpusGolden{"motion", 0xc03d5eec9da5d9ebu, 0x14619a6667d7bf39u}),
                         [](const auto& one) { return std::string(one.param.name); });

// Side of a square seen frontally, px, and angle between the view and its normal, degrees.
double side_px(const Scene& scene, const SceneMarker& m) { return scene.camera.fx * m.size_m / m.pose.t[2]; }
double tilt_deg(const SceneMarker& m) {
  return std::acos(dot(column(m.pose.R, 2), m.pose.t) / length(m.pose.t)) * 180 / kPi;
}

TEST(Corpus, HoldsWhatItPromises) {
  EXPECT_EQ(corpus_names(), (std::vector<std::string>{"easy", "dock", "hard", "tiny", "cluttered", "dark", "motion"}));
  for (const int width : {640, 1280}) {
    double darkest = 255, brightest = 0, least_motion = 99, most_motion = 0;
    int without_tag = 0, hard_hidden = 0;
    for (int i = 0; i < kCorpusFrames; ++i) {
      const auto scene_of = [&](const char* name) { return corpus_scene(name, i, width, width * 3 / 4); };
      const Scene easy = scene_of("easy");
      ASSERT_EQ(easy.markers.size(), 1u);
      EXPECT_GE(side_px(easy, easy.markers[0]), 60);
      EXPECT_LE(side_px(easy, easy.markers[0]), 220);
      EXPECT_LE(tilt_deg(easy.markers[0]), 45.001);
      EXPECT_EQ(truth(easy)[0].visible, 1);

      const Scene dock = scene_of("dock");
      EXPECT_EQ(dock.markers.size(), 5u);
      EXPECT_NEAR(dock.markers[0].pose.t[2], 1.6 - 1.42 * i / 99, 1e-9);

      const Scene hard = scene_of("hard");
      EXPECT_GE(hard.markers.size(), 1u);
      EXPECT_LE(hard.markers.size(), 4u);
      for (const TruthMarker& marker : truth(hard)) hard_hidden += marker.visible < 0.9 ? 1 : 0;
      for (const SceneMarker& marker : hard.markers) EXPECT_LE(tilt_deg(marker), 72.001);

      const Scene tiny = scene_of("tiny");
      EXPECT_EQ(tiny.markers.size(), 8u);
      std::set<int> ids;
      for (const SceneMarker& marker : tiny.markers) {
        ids.insert(marker.id);
        EXPECT_GE(side_px(tiny, marker), 11.99);
        EXPECT_LE(side_px(tiny, marker), 34.01);
      }
      EXPECT_EQ(ids.size(), tiny.markers.size());

      const Scene cluttered = scene_of("cluttered");
      const auto is_tag = [](const SceneMarker& m) { return m.family == "tag36h11"; };
      without_tag += std::none_of(cluttered.markers.begin(), cluttered.markers.end(), is_tag) ? 1 : 0;

      const Scene dark = scene_of("dark"), motion = scene_of("motion");
      darkest = std::min(darkest, dark.sensor.white_level);
      brightest = std::max(brightest, dark.sensor.white_level);
      const double blur = length(motion.motion.turn) * motion.camera.fx;
      least_motion = std::min(least_motion, blur);
      most_motion = std::max(most_motion, blur);
    }
    EXPECT_EQ(without_tag, 10);
    EXPECT_GE(hard_hidden, 10) << "grippers occlude";
    EXPECT_NEAR(darkest, 12, 3);
    EXPECT_NEAR(brightest, 60, 3);
    EXPECT_NEAR(least_motion, 1, 0.5);
    EXPECT_NEAR(most_motion, 12, 0.5);
  }
  EXPECT_THROW(corpus_scene("esay", 0, 640, 480), Error);
  EXPECT_THROW(corpus_scene("easy", -1, 640, 480), Error);
  EXPECT_THROW(corpus_scene("easy", 0, 64, 48), Error);
}

TEST(Clutter, NearTagsAreTooFarToBeMended) {
  const MarkerFamily& shape = family("tag36h11");
  EXPECT_EQ(distance_to_family(shape, shape.codes[100]), 0);
  EXPECT_EQ(distance_to_family(shape, shape.codes[100] ^ 0x900000000u), 2);
  Random random(5);
  for (int i = 0; i < 20; ++i) EXPECT_GE(distance_to_family(shape, near_code(shape, 5, random)), 5);
}

}  // namespace
}  // namespace berth::sim
