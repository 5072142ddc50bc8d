// The decoder on markers drawn here: exact corners, known codes, chosen blur and noise.

#include "target/decode.hpp"

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "berth/error.hpp"
#include "support/marker_scene.hpp"
#include "target/marker_pattern.hpp"

namespace berth {
namespace {

std::vector<u8> flipped(const MarkerFamily& family, int id, const std::vector<std::size_t>& bits) {
  MarkerFamily changed = family;
  for (const std::size_t bit : bits) changed.codes[static_cast<std::size_t>(id)] ^= u64{1} << bit;
  return marker_pattern(changed, id);
}

class EveryFamily : public testing::TestWithParam<std::string> {};

TEST_P(EveryFamily, IsReadInEveryRotation) {
  const MarkerFamily& f = family(GetParam());
  const Decoder decoder({&f}, 2);
  Random random(5);
  const int count = static_cast<int>(f.codes.size());
  for (int trial = 0; trial < 24; ++trial) {
    const int id = trial == 0 ? 0 : trial == 1 ? count - 1 : static_cast<int>(random.word() % static_cast<u32>(count));
    const MarkerScene s =
        marker_scene(f, marker_pattern(f, id), random.between(30, 60), random.between(0, 55), Look(), random);
    Detection d;
    ASSERT_TRUE(decoder.decode(GrayImage(s.image).view(), candidate(f, s.corners, static_cast<u32>(trial) & 3), d))
        << "id " << id;
    EXPECT_EQ(d.family, &f);
    EXPECT_FALSE(d.has_pose);
    EXPECT_GT(d.margin, 20);
    // The old ArUco dictionary has markers that look alike in different rotations; every other family has none.
    if (f.min_hamming == 0) continue;
    ASSERT_EQ(d.id, id);
    EXPECT_EQ(d.hamming, 0);
    // Drawn clockwise from the upper left; reported counter-clockwise from it.
    EXPECT_EQ(d.corners, (Corners{s.corners[0], s.corners[3], s.corners[2], s.corners[1]}));
    const auto& c = s.corners;  // the centre is where the diagonals meet
    EXPECT_NEAR((c[2][0] - c[0][0]) * (d.center[1] - c[0][1]), (c[2][1] - c[0][1]) * (d.center[0] - c[0][0]), 1e-6);
    EXPECT_NEAR((c[3][0] - c[1][0]) * (d.center[1] - c[1][1]), (c[3][1] - c[1][1]) * (d.center[0] - c[1][0]), 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryFamily, testing::ValuesIn(family_names()),
                         [](const testing::TestParamInfo<std::string>& name) { return name.param; });

// docs/coordinate-frames.md says how libapriltag's corners map to ours.
TEST(Decode, CornersMapToLibapriltags) {
  const MarkerFamily& f = family("tag36h11");
  Random random(6);
  apriltag_family_t* const theirs = tag36h11_create();
  apriltag_detector_t* const detector = apriltag_detector_create();
  detector->quad_decimate = 1;
  apriltag_detector_add_family(detector, theirs);
  for (int trial = 0; trial < 8; ++trial) {
    MarkerScene s = marker_scene(f, marker_pattern(f, 40 + trial), 90, 30, Look(), random);
    Detection d;
    ASSERT_TRUE(Decoder({&f}, 2).decode(s.image.view(), candidate(f, s.corners, 0), d));
    const View2D<u8> view = s.image.view();
    image_u8_t image = {view.width, view.height, view.stride, view.data};
    zarray_t* const found = apriltag_detector_detect(detector, &image);
    ASSERT_EQ(zarray_size(found), 1);
    apriltag_detection_t* tag = nullptr;
    zarray_get(found, 0, &tag);
    EXPECT_EQ(tag->id, d.id);
    const std::size_t ours[4] = {1, 2, 3, 0};  // lower left, lower right, upper right, upper left
    for (std::size_t i = 0; i < 4; ++i) {
      // Their pixel centres are at halves.
      EXPECT_NEAR(tag->p[i][0] - 0.5, d.corners[ours[i]][0], 0.6) << i;
      EXPECT_NEAR(tag->p[i][1] - 0.5, d.corners[ours[i]][1], 0.6) << i;
    }
    apriltag_detections_destroy(found);
  }
  apriltag_detector_destroy(detector);
  tag36h11_destroy(theirs);
}

TEST(Decode, WrongBitsAreCountedAndLimited) {
  const MarkerFamily& f = family("tag36h11");
  std::vector<Decoder> decoders;
  for (int limit = 0; limit <= 3; ++limit) decoders.emplace_back(std::vector<const MarkerFamily*>{&f}, limit);
  Random random(7);
  for (int trial = 0; trial < 30; ++trial) {
    const int id = static_cast<int>(random.word() % 587);
    std::vector<std::size_t> bits;
    while (bits.size() < 4) {
      const std::size_t bit = random.word() % 36;
      if (std::find(bits.begin(), bits.end(), bit) == bits.end()) bits.push_back(bit);
    }
    for (int wrong = 0; wrong <= 4; ++wrong) {
      const std::vector<u8> pattern = flipped(f, id, {bits.begin(), bits.begin() + wrong});
      MarkerScene s = marker_scene(f, pattern, random.between(40, 60), random.between(0, 45), Look(), random);
      for (int limit = 0; limit <= 3; ++limit) {
        Detection d;
        const bool read =
            decoders[static_cast<std::size_t>(limit)].decode(s.image.view(), candidate(f, s.corners, 0), d);
        // More than two is more than chance allows for this family, whatever is asked for.
        EXPECT_EQ(read, wrong <= std::min(limit, 2)) << "id " << id << ", wrong " << wrong << ", limit " << limit;
        if (read) {
          EXPECT_EQ(d.id, id);
          EXPECT_EQ(d.hamming, wrong);
        }
      }
    }
  }
  EXPECT_THROW(Decoder({&f}, -1), Error);
}

// What docs/families.md says of weak families: sixteen bits are read without a wrong one or not at all.
TEST(Decode, WeakFamiliesMayHaveNoWrongBit) {
  Random random(8);
  for (const char* name : {"tag16h5", "aruco4x4_50"}) {
    const MarkerFamily& f = family(name);
    const Decoder decoder({&f}, 2);
    for (int trial = 0; trial < 30; ++trial) {
      MarkerScene s = marker_scene(f, flipped(f, trial, {random.word() % 16}), 60, 20, Look(), random);
      Detection d;
      EXPECT_FALSE(decoder.decode(s.image.view(), candidate(f, s.corners, 0), d)) << name << " " << trial;
    }
  }
}

struct Hard {
  const char* name;
  double least_px, most_px, tilt_deg;
  Look look;
  double corner_error_px;
  double recall;  // measured, less about two standard deviations
};

class HardMarkers : public testing::TestWithParam<Hard> {};

TEST_P(HardMarkers, AreStillRead) {
  const Hard& hard = GetParam();
  const MarkerFamily& f = family("tag36h11");
  const Decoder decoder({&f}, 2);
  Random random(9);
  constexpr int kTrials = 400;
  int read = 0, wrong = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const int id = static_cast<int>(random.word() % 587);
    MarkerScene s = marker_scene(f, marker_pattern(f, id), random.between(hard.least_px, hard.most_px),
                                 random.between(0, hard.tilt_deg), hard.look, random);
    QuadCandidate quad = candidate(f, s.corners, random.word());
    for (auto& c : quad.fine) {
      c[0] += hard.corner_error_px * random.normal();
      c[1] += hard.corner_error_px * random.normal();
    }
    Detection d;
    if (!decoder.decode(s.image.view(), quad, d)) continue;
    ++(d.id == id ? read : wrong);
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GE(read, hard.recall * kTrials);
}

INSTANTIATE_TEST_SUITE_P(Table, HardMarkers,
                         testing::Values(Hard{"tiny", 12, 34, 40, {30, 170, 0.65, 2}, 0.1, 0.99},
                                         Hard{"tiny_and_noisy", 12, 20, 40, {60, 130, 0.75, 3}, 0.15, 0.97},
                                         Hard{"dark", 20, 60, 60, {10, 25, 0.7, 2}, 0.15, 0.98},
                                         Hard{"oblique_and_blurred", 26, 50, 72, {40, 160, 1.2, 3}, 0.1, 0.97},
                                         Hard{"rough_corners", 14, 34, 40, {30, 170, 0.65, 2}, 0.35, 0.95}),
                         [](const testing::TestParamInfo<Hard>& hard) { return std::string(hard.param.name); });

TEST(Decode, BordersWithRandomPatternsAreNoMarkers) {
  const MarkerFamily& f = family("tag36h11");
  const Decoder decoder({&f}, 2);
  Random random(10);
  int taken = 0;
  for (int trial = 0; trial < 1500; ++trial) {
    MarkerFamily other = f;
    other.codes = {((static_cast<u64>(random.word()) << 32) | random.word()) & ((u64{1} << 36) - 1)};
    const Look look = {40, random.between(60, 200), random.between(0.4, 1), random.between(0, 3)};
    MarkerScene s =
        marker_scene(f, marker_pattern(other, 0), random.between(16, 40), random.between(0, 60), look, random);
    Detection d;
    taken += decoder.decode(s.image.view(), candidate(f, s.corners, 0), d);
  }
  EXPECT_EQ(taken, 0);
}

TEST(Decode, TexturesHoldNoMarkers) {
  std::vector<const MarkerFamily*> families;
  for (const char* name : {"tag36h11", "tag25h9", "tagStandard41h12", "aruco6x6_250"})
    families.push_back(&family(name));
  const Decoder decoder(families, 2);
  Random random(11);
  int taken = 0;
  for (const double sigma : {0.0, 1.0, 3.0, 8.0}) {
    for (int picture = 0; picture < 5; ++picture) {
      GrayImage image = texture(256, sigma, random.between(10, 90), random);
      for (int k = 0; k < 10000; ++k) {
        const Corners corners = random_corners(random, random.between(5, 90), random.between(0, 60),
                                               random.between(0, 256), random.between(0, 256));
        QuadCandidate quad = candidate(*families[0], corners, 0);
        quad.reversed_border = (k & 1) != 0;
        Detection d;
        taken += decoder.decode(image.view(), quad, d);
      }
    }
  }
  EXPECT_EQ(taken, 0);
}

TEST(Decode, FamiliesDoNotReadEachOther) {
  std::vector<std::string> names = {"tag36h11",     "tag36h10",         "aruco6x6_250",
                                    "aruco7x7_250", "tagStandard41h12", "tagCustom48h12"};
  Random random(12);
  for (const std::string& drawn : names) {
    for (const std::string& asked : names) {
      if (drawn == asked) continue;
      const MarkerFamily& from = family(drawn);
      const MarkerFamily& to = family(asked);
      const Decoder decoder({&to}, 2);
      int taken = 0;
      for (int trial = 0; trial < 12; ++trial) {
        const int id = static_cast<int>(random.word() % from.codes.size());
        MarkerScene s =
            marker_scene(from, marker_pattern(from, id), random.between(30, 90), random.between(0, 40), Look(), random);
        Detection d;
        QuadCandidate quad = candidate(to, s.corners, 0);
        taken += decoder.decode(s.image.view(), quad, d);
      }
      EXPECT_EQ(taken, 0) << drawn << " read as " << asked;
    }
  }
}

TEST(Decode, TheFamilyIsFoundAmongMany) {
  std::vector<const MarkerFamily*> families;
  for (const char* name : {"aruco6x6_250", "tag25h9", "tag36h11", "tagStandard41h12"})
    families.push_back(&family(name));
  const Decoder decoder(families, 2);
  Random random(13);
  for (const MarkerFamily* f : families) {
    for (int trial = 0; trial < 20; ++trial) {
      MarkerScene s = marker_scene(*f, marker_pattern(*f, trial), 60, 30, Look(), random);
      Detection d;
      ASSERT_TRUE(decoder.decode(s.image.view(), candidate(*f, s.corners, 0), d)) << f->name << " " << trial;
      EXPECT_EQ(d.family, f);
      EXPECT_EQ(d.id, trial);
    }
  }
}

TEST(Decode, CoarseCornersAreTriedWhenTheFineOnesFail) {
  const MarkerFamily& f = family("tag36h11");
  const Decoder decoder({&f}, 2);
  Random random(14);
  MarkerScene s = marker_scene(f, marker_pattern(f, 3), 50, 20, Look(), random);
  QuadCandidate quad = candidate(f, s.corners, 2);
  for (auto& c : quad.fine) c[0] += 12;
  Detection d;
  EXPECT_FALSE(decoder.decode(s.image.view(), quad, d));
  quad.has_fine = true;
  ASSERT_TRUE(decoder.decode(s.image.view(), quad, d));
  EXPECT_EQ(d.id, 3);
}

TEST(Decode, MarkersAtTheImagesEdgeAreRead) {
  const MarkerFamily& f = family("tag36h11");
  const Decoder decoder({&f}, 2);
  Random random(15);
  // The border touches the left and upper edges; the quiet zone there is outside.
  const Corners corners = {{{-0.4, -0.4}, {47.6, -0.4}, {47.6, 47.6}, {-0.4, 47.6}}};
  GrayImage image = draw_marker(f, marker_pattern(f, 9), corners, 64, 64, Look(), random);
  Detection d;
  ASSERT_TRUE(decoder.decode(image.view(), candidate(f, corners, 1), d));
  EXPECT_EQ(d.id, 9);
}

TEST(Decode, RubbishIsRefusedQuietly) {
  const MarkerFamily& f = family("tag36h11");
  const Decoder decoder({&f}, 2);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  GrayImage dot(1, 1), line(64, 1), square(64, 64);
  const std::vector<Corners> quads = {{{{0, 0}, {0, 0}, {0, 0}, {0, 0}}},
                                      {{{0, 0}, {10, 0}, {20, 0}, {30, 0}}},
                                      {{{0, 0}, {0, 10}, {10, 10}, {10, 0}}},  // counter-clockwise
                                      {{{0, 0}, {10, 10}, {10, 0}, {0, 10}}},  // crossed
                                      {{{nan, 0}, {10, 0}, {10, 10}, {0, 10}}},
                                      {{{0, 0}, {inf, 0}, {10, 10}, {0, 10}}},
                                      {{{-1e9, -1e9}, {1e9, -1e9}, {1e9, 1e9}, {-1e9, 1e9}}},
                                      {{{1000, 1000}, {1010, 1000}, {1010, 1010}, {1000, 1010}}},
                                      {{{0, 0}, {1e-7, 0}, {1e-7, 1e-7}, {0, 1e-7}}},
                                      {{{0, 0}, {63, 0}, {63, 63}, {0, 63}}}};
  for (const Corners& corners : quads) {
    for (GrayImage* image : {&dot, &line, &square}) {
      QuadCandidate quad = candidate(f, corners, 0);
      quad.has_fine = true;
      Detection d;
      EXPECT_FALSE(decoder.decode(image->view(), quad, d));
    }
  }
  Detection d;
  EXPECT_FALSE(Decoder({}, 2).decode(square.view(), candidate(f, quads.back(), 0), d));
}

}  // namespace
}  // namespace berth
