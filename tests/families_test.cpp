// The generated family tables, module by module against the libraries they come from.

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "berth/error.hpp"
#include "berth/marker.hpp"
#include "target/marker_pattern.hpp"
#include "target/opencv_aruco.hpp"

namespace berth {
namespace {

int distance(u64 a, u64 b) { return __builtin_popcountll(a ^ b); }

u64 quarter_turn(const MarkerFamily& family, u64 code) {
  const std::size_t n = family.rotation.size();
  u64 turned = 0;
  for (std::size_t i = 0; i < n; ++i) {
    turned |= ((code >> (n - 1 - i)) & 1) << (n - 1 - static_cast<std::size_t>(family.rotation[i]));
  }
  return turned;
}

int smallest_distance(const MarkerFamily& family) {
  int smallest = 64;
  for (std::size_t i = 0; i < family.codes.size(); ++i) {
    u64 code = family.codes[i];
    for (int turn = 0; turn < 4; ++turn) {
      for (std::size_t j = turn == 0 ? i + 1 : i; j < family.codes.size(); ++j) {
        smallest = std::min(smallest, distance(code, family.codes[j]));
      }
      code = quarter_turn(family, code);
    }
  }
  return smallest;
}

// Every id of a small family, some of a large one, always with the first and the last.
std::vector<int> sample_ids(const MarkerFamily& family) {
  std::vector<int> ids;
  const int count = static_cast<int>(family.codes.size());
  for (int id = 0; id < count; id += std::max(1, count / 600)) ids.push_back(id);
  ids.push_back(count - 1);
  return ids;
}

TEST(Families, PatternsAreLibapriltags) {
  struct {
    apriltag_family_t* (*create)();
    void (*destroy)(apriltag_family_t*);
  } const libraries[] = {{tag36h11_create, tag36h11_destroy},
                         {tag36h10_create, tag36h10_destroy},
                         {tag25h9_create, tag25h9_destroy},
                         {tag16h5_create, tag16h5_destroy},
                         {tagStandard41h12_create, tagStandard41h12_destroy},
                         {tagStandard52h13_create, tagStandard52h13_destroy},
                         {tagCircle21h7_create, tagCircle21h7_destroy},
                         {tagCircle49h12_create, tagCircle49h12_destroy},
                         {tagCustom48h12_create, tagCustom48h12_destroy}};
  for (const auto& library : libraries) {
    apriltag_family_t* const theirs = library.create();
    const MarkerFamily& ours = family(theirs->name);
    ASSERT_EQ(ours.codes.size(), theirs->ncodes);
    EXPECT_EQ(ours.total_width, theirs->total_width);
    for (const int id : sample_ids(ours)) {
      image_u8_t* const image = apriltag_to_image(theirs, static_cast<u32>(id));
      const std::vector<u8> pattern = marker_pattern(ours, id);
      for (int y = 0; y < ours.total_width; ++y) {
        for (int x = 0; x < ours.total_width; ++x) {
          ASSERT_EQ(pattern[static_cast<std::size_t>(y * ours.total_width + x)], image->buf[y * image->stride + x])
              << ours.name << " " << id << " at " << x << ", " << y;
        }
      }
      std::free(image->buf);  // image_u8_destroy is in another of their libraries
      std::free(image);
    }
    library.destroy(theirs);
  }
}

TEST(Families, PatternsAreOpenCvs) {
  int dictionary = cv::aruco::DICT_4X4_50;
  int checked = 0;
  for (const std::string& name : family_names()) {
    if (name.compare(0, 5, "aruco") != 0) continue;
    const MarkerFamily& ours = family(name);
    const aruco::Dictionary theirs = aruco::getPredefinedDictionary(dictionary++);
    ASSERT_EQ(static_cast<int>(ours.codes.size()), theirs.bytesList.rows) << name;
    ASSERT_EQ(ours.border_width, theirs.markerSize + 2) << name;
    for (const int id : sample_ids(ours)) {
      cv::Mat image;
      aruco::generateImageMarker(theirs, id, ours.border_width, image);
      const std::vector<u8> pattern = marker_pattern(ours, id);
      for (int y = 0; y < ours.border_width; ++y) {
        for (int x = 0; x < ours.border_width; ++x) {
          ASSERT_EQ(pattern[static_cast<std::size_t>((y + 1) * ours.total_width + x + 1)], image.at<u8>(y, x))
              << name << " " << id << " at " << x << ", " << y;
        }
      }
    }
    ++checked;
  }
  EXPECT_EQ(checked, 17);
  EXPECT_EQ(dictionary - 1, static_cast<int>(cv::aruco::DICT_ARUCO_ORIGINAL));
}

TEST(Families, AQuarterTurnMovesEveryModuleClockwise) {
  for (const std::string& name : family_names()) {
    const MarkerFamily& f = family(name);
    const std::size_t n = f.bit_x.size();
    ASSERT_EQ(f.bit_y.size(), n);
    ASSERT_EQ(f.rotation.size(), n);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t to = static_cast<std::size_t>(f.rotation[i]);
      EXPECT_EQ(f.bit_x[to], f.border_width - 1 - f.bit_y[i]) << name;
      EXPECT_EQ(f.bit_y[to], f.bit_x[i]) << name;
    }
    EXPECT_EQ(quarter_turn(f, quarter_turn(f, quarter_turn(f, quarter_turn(f, f.codes[0])))), f.codes[0]) << name;
  }
}

TEST(Families, CodesAreAsFarApartAsTheTableSays) {
  for (const std::string& name : family_names()) {
    const MarkerFamily& f = family(name);
    if (f.codes.size() > 3000) continue;  // billions of pairs
    if (name.compare(0, 3, "tag") == 0) {
      EXPECT_GE(smallest_distance(f), f.min_hamming) << name;
    } else {
      EXPECT_EQ(smallest_distance(f), f.min_hamming) << name;
    }
  }
}

TEST(Families, KnownOnesAreThere) {
  EXPECT_EQ(family_names().size(), 26u);
  const MarkerFamily& f = family("tag36h11");
  EXPECT_EQ(f.border_width, 8);
  EXPECT_EQ(f.total_width, 10);
  EXPECT_FALSE(f.reversed_border);
  EXPECT_EQ(f.codes.size(), 587u);
  EXPECT_EQ(f.min_hamming, 11);
  EXPECT_EQ(&family("tag36h11"), &f);
  EXPECT_TRUE(family("tagStandard41h12").reversed_border);
  EXPECT_EQ(family("aruco6x6_250").codes.size(), 250u);
}

TEST(Families, AnUnknownNameBringsNearOnes) {
  try {
    family("Tag36h1");
    FAIL() << "no error";
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("Tag36h1"), std::string::npos) << what;
    EXPECT_NE(what.find("tag36h11"), std::string::npos) << what;
  }
  EXPECT_THROW(family(""), Error);
}

TEST(Families, AnUnknownIdIsRefused) {
  EXPECT_THROW(marker_pattern(family("tag16h5"), 30), Error);
  EXPECT_THROW(marker_pattern(family("tag16h5"), -1), Error);
}

}  // namespace
}  // namespace berth
