#include "berth/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <random>
#include <string>

#include "berth/error.hpp"
#include "support/scratch_folder.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

std::string temporary(const std::string& name) {
  static const test::ScratchFolder folder;
  return folder / name;
}

std::string write_text(const std::string& name, const std::string& text) {
  std::string path = temporary(name);
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

const char* const kGood =
    "image_width: 640\nimage_height: 480\ncamera_name: dock\n"
    "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [669.42, 0, 308.825, 0, 672.51, 237.615, 0, 0, 1]\n"
    "distortion_model: plumb_bob\n"
    "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.1116, 0.1242, 0.001, -0.002, 0]\n";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

void expect_same(const CameraModel& a, const CameraModel& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.fx, b.fx);
  EXPECT_EQ(a.fy, b.fy);
  EXPECT_EQ(a.cx, b.cx);
  EXPECT_EQ(a.cy, b.cy);
  EXPECT_EQ(a.distortion, b.distortion);
  EXPECT_EQ(a.lens, b.lens);
}

TEST(Camera, ThePapersIsHalvedAboutTheImagesEdge) {
  const CameraModel full = paper_camera(1280, 960);
  EXPECT_EQ(full.fx, 1338.84);
  EXPECT_EQ(full.fy, 1345.02);
  EXPECT_DOUBLE_EQ(full.cx, 618.15);
  EXPECT_DOUBLE_EQ(full.cy, 475.73);
  const CameraModel half = paper_camera();
  EXPECT_EQ(half.width, 640);
  EXPECT_EQ(half.fx, 669.42);
  EXPECT_DOUBLE_EQ(half.cx, (618.15 + 0.5) / 2 - 0.5);
  // The same ray meets the same place on both sensors: edges at -0.5.
  const auto a = full.project(0.2, -0.1);
  const auto b = half.project(0.2, -0.1);
  EXPECT_NEAR((a[0] + 0.5) / 2, b[0] + 0.5, 1e-9);
  EXPECT_NEAR((a[1] + 0.5) / 2, b[1] + 0.5, 1e-9);
  EXPECT_THROW(paper_camera(640, 640), Error);
  EXPECT_THROW(paper_camera(0, 0), Error);
}

TEST(Camera, ProjectsWithTheBrownModel) {
  CameraModel camera;
  camera.fx = 500;
  camera.fy = 400;
  camera.cx = 320;
  camera.cy = 240;
  camera.distortion = {0.1, -0.2, 0.01, -0.02, 0.3};
  // By hand: x = 0.5, y = -0.25, r2 = 0.3125.
  const double r2 = 0.3125, radial = 1 + 0.1 * r2 - 0.2 * r2 * r2 + 0.3 * r2 * r2 * r2;
  const double x = 0.5 * radial + 2 * 0.01 * 0.5 * -0.25 - 0.02 * (r2 + 2 * 0.25);
  const double y = -0.25 * radial + 0.01 * (r2 + 2 * 0.0625) + 2 * -0.02 * 0.5 * -0.25;
  const auto p = camera.project(0.5, -0.25);
  EXPECT_NEAR(p[0], 500 * x + 320, 1e-10);
  EXPECT_NEAR(p[1], 400 * y + 240, 1e-10);
}

TEST(Camera, UndistortsWhatItProjects) {
  CameraModel paper = paper_camera(1280, 960);
  CameraModel barrel = paper;
  barrel.distortion = {-0.35, 0.12, 0.001, -0.0015, -0.01};
  CameraModel cushion = paper;
  cushion.distortion = {0.3, 0.1, -0.002, 0.001, 0.05};
  for (const CameraModel& camera : {paper, barrel, cushion}) {
    double worst = 0;
    for (int v = 0; v < camera.height; v += 7) {
      for (int u = 0; u < camera.width; u += 7) {
        const auto ray = camera.undistort(u, v);
        const auto back = camera.project(ray[0], ray[1]);
        worst = std::max({worst, std::fabs(back[0] - u), std::fabs(back[1] - v)});
      }
    }
    EXPECT_LT(worst, 1e-9) << "k1 = " << camera.distortion[0];
  }
}

// OpenCV's own projections and inverse are the judges of what Berth does with a lens.
std::vector<cv::Point2d> by_opencv(const CameraModel& camera, const std::vector<cv::Point3d>& points) {
  const cv::Matx33d k(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  std::vector<cv::Point2d> image;
  const std::vector<double> d(camera.distortion.begin(), camera.distortion.end());
  if (camera.lens == LensModel::equidistant) {
    cv::fisheye::projectPoints(points, image, cv::Vec3d(), cv::Vec3d(), k, cv::Vec4d(d[0], d[1], d[2], d[3]));
  } else {
    cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), k, d, image);
  }
  return image;
}

CameraModel fisheye_camera() {
  CameraModel camera = paper_camera();
  camera.fx = camera.fy = 220;
  camera.lens = LensModel::equidistant;
  camera.distortion = {-0.02, 0.008, -0.004, 0.0007};
  return camera;
}

TEST(Camera, ProjectsAsOpenCvDoes) {
  CameraModel rational = paper_camera();
  rational.distortion = {0.4, -0.3, 0.001, -0.002, 0.1, 0.5, -0.2, 0.05};
  for (const CameraModel& camera : {fisheye_camera(), rational}) {
    const double most = camera.lens == LensModel::equidistant ? 6 : 0.6;  // 80 degrees
    std::vector<cv::Point3d> points = {{0, 0, 1}, {1e-12, 0, 1}};
    for (int i = -20; i <= 20; ++i) points.emplace_back(most * i / 20, most * (i % 7) / 9, 1);
    const std::vector<cv::Point2d> expected = by_opencv(camera, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::array<double, 4> slope{};
      const auto p = camera.project(points[i].x, points[i].y, slope);
      EXPECT_NEAR(p[0], expected[i].x, 1e-9);
      EXPECT_NEAR(p[1], expected[i].y, 1e-9);
      constexpr double kStep = 1e-6;
      const auto right = camera.project(points[i].x + kStep, points[i].y);
      const auto left = camera.project(points[i].x - kStep, points[i].y);
      const auto down = camera.project(points[i].x, points[i].y + kStep);
      const auto up = camera.project(points[i].x, points[i].y - kStep);
      for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_NEAR(slope[2 * k], (right[k] - left[k]) / (2 * kStep), 1e-5);
        EXPECT_NEAR(slope[2 * k + 1], (down[k] - up[k]) / (2 * kStep), 1e-5);
      }
    }
  }
}

TEST(Camera, UndistortsAFisheyeUpTo89Degrees) {
  const CameraModel camera = fisheye_camera();
  for (double degrees = 0; degrees <= 89; degrees += 0.5) {
    const double r = std::tan(degrees * 3.14159265358979 / 180);
    const auto pixel = camera.project(0.6 * r, -0.8 * r);
    const auto ray = camera.undistort(pixel[0], pixel[1]);
    const auto back = camera.project(ray[0], ray[1]);
    EXPECT_NEAR(back[0], pixel[0], 1e-9) << degrees;
    EXPECT_NEAR(back[1], pixel[1], 1e-9) << degrees;
    EXPECT_NEAR(ray[0], 0.6 * r, 1e-11 * (1 + r * r)) << degrees;
  }
  // What no pinhole sees comes out far off, but finite and on the right side.
  const auto beyond = camera.undistort(camera.cx - 1000, camera.cy);
  EXPECT_LT(beyond[0], -1000);
  EXPECT_GT(beyond[0], -1500);
}

TEST(Camera, IsResizedAboutTheEdgeAndCroppedToTheMiddle) {
  const CameraModel half = resized_camera(paper_camera(1280, 960), 640, 480);
  expect_same(half, paper_camera(640, 480));
  const CameraModel middle = cropped_camera(paper_camera(1280, 960), 640, 480);
  EXPECT_EQ(middle.fx, 1338.84);
  EXPECT_DOUBLE_EQ(middle.cx, 618.15 - 320);
  EXPECT_DOUBLE_EQ(middle.cy, 475.73 - 240);
  EXPECT_THROW(resized_camera(paper_camera(), 640, 360), Error);
  EXPECT_THROW(cropped_camera(paper_camera(), 641, 480), Error);
  EXPECT_THROW(cropped_camera(paper_camera(), 639, 480), Error);
}

const char* const kChain =
    "cam0:\n  camera_model: pinhole\n  intrinsics: [461.6, 460.3, 362.7, 248.1]\n"
    "  distortion_model: radtan\n  distortion_coeffs: [-0.27, 0.07, 0.0002, 0.00003]\n"
    "  resolution: [752, 480]\n  rostopic: /cam0/image_raw\n"
    "cam1:\n  camera_model: pinhole\n  intrinsics: [190.9, 190.8, 254.9, 256.8]\n"
    "  distortion_model: equidistant\n  distortion_coeffs: [0.0034, 0.0007, -0.002, 0.0002]\n"
    "  resolution: [512, 512]\n";

TEST(CameraFile, ReadsKalibrsCamchain) {
  const std::string path = write_text("camchain.yaml", kChain);
  const CameraModel second = read_camera(path + "#cam1");
  EXPECT_EQ(second.width, 512);
  EXPECT_EQ(second.lens, LensModel::equidistant);
  EXPECT_EQ(second.distortion, (std::array<double, 8>{0.0034, 0.0007, -0.002, 0.0002}));
  const std::string one = std::string(kChain).substr(0, std::string(kChain).find("cam1:"));
  const CameraModel first = read_camera(write_text("one.yaml", one));
  EXPECT_EQ(first.height, 480);
  EXPECT_EQ(first.fx, 461.6);
  EXPECT_EQ(first.fy, 460.3);
  EXPECT_EQ(first.cx, 362.7);
  EXPECT_EQ(first.cy, 248.1);
  EXPECT_EQ(first.lens, LensModel::radial_tangential);
  EXPECT_EQ(first.distortion, (std::array<double, 8>{-0.27, 0.07, 0.0002, 0.00003}));
}

const char* const kPhoton =
    R"({"resolution": {"width": 1280.0, "height": 720.0},
"cameraIntrinsics": {"rows": 3, "cols": 3, "type": 6,
  "data": [1142.34, 0.0, 621.38, 0.0, 1139.92, 349.9, 0.0, 0.0, 1.0]},
"distCoeffs": {"rows": 1, "cols": 8, "type": 6, "data": [0.16, -1.27, 0.0028, -2.8E-4, 2.5, 0.1, 0.2, 0.3]},
"observations": [], "lensmodel": "LENSMODEL_OPENCV"})";

TEST(CameraFile, ReadsPhotonVisionsJson) {
  const CameraModel camera = read_camera(write_text("photon.json", kPhoton));
  EXPECT_EQ(camera.width, 1280);
  EXPECT_EQ(camera.fy, 1139.92);
  EXPECT_EQ(camera.cx, 621.38);
  EXPECT_EQ(camera.distortion, (std::array<double, 8>{0.16, -1.27, 0.0028, -2.8e-4, 2.5, 0.1, 0.2, 0.3}));
  // As older versions wrote it.
  const std::string old = replaced(replaced(kPhoton, "distCoeffs", "cameraExtrinsics"), ", 0.1, 0.2, 0.3]", "]");
  EXPECT_EQ(read_camera(write_text("old.json", old)).distortion,
            (std::array<double, 8>{0.16, -1.27, 0.0028, -2.8e-4, 2.5}));
}

TEST(CameraFile, ReadsRosAndNamesWhatIsWrong) {
  expect_same(read_camera(write_text("ros.yaml", kGood)), read_camera_info(write_text("ros.yaml", kGood)));
  const auto refused = [](const std::string& path, const std::string& words) {
    try {
      read_camera(path);
      ADD_FAILURE() << "no error";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  const std::string chain = write_text("camchain.yaml", kChain);
  refused(chain, "one of 2 cameras");
  refused(chain + "#cam2", "cam2: missing");
  refused(temporary("ros.yaml") + "#cam0", "only a Kalibr camchain");
  refused(write_text("omni.yaml", replaced(kChain, "pinhole", "omni")) + "#cam0", "cam0.camera_model: \"omni\"");
  refused(write_text("fov.yaml", replaced(kChain, "radtan", "fov")) + "#cam0", "cam0.distortion_model: \"fov\"");
  refused(write_text("short.yaml", replaced(kChain, "[752, 480]", "[752]")) + "#cam0", "cam0.resolution: has 1 values");
  refused(write_text("focal.yaml", replaced(kChain, "461.6", "-461.6")) + "#cam0", "cam0.intrinsics[0] (fx): -461.6");
  refused(write_text("photon.json", replaced(kPhoton, "2.5,", "\"x\",")), "distCoeffs.data[4]: \"x\"");
  refused(write_text("photon.json", replaced(kPhoton, "720.0", "720.5")), "resolution.height: 720.5");
  refused(write_text("photon.json", replaced(kPhoton, "\"distCoeffs\"", "\"other\"")), "cameraExtrinsics: missing");
}

TEST(CameraInfo, ReadsWhatRosWrites) {
  const CameraModel camera = read_camera_info(write_text("good.yaml", kGood));
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  EXPECT_EQ(camera.fx, 669.42);
  EXPECT_EQ(camera.fy, 672.51);
  EXPECT_EQ(camera.cx, 308.825);
  EXPECT_EQ(camera.cy, 237.615);
  EXPECT_EQ(camera.distortion, (std::array<double, 8>{-0.1116, 0.1242, 0.001, -0.002, 0}));
  EXPECT_EQ(camera.lens, LensModel::radial_tangential);
  // Four coefficients, and the rational model.
  EXPECT_EQ(read_camera_info(write_text("four.yaml", replaced(kGood, ", -0.002, 0]", ", -0.002]"))).distortion[4], 0);
  const std::string rational =
      replaced(replaced(kGood, "plumb_bob", "rational_polynomial"), "-0.002, 0]", "-0.002, 0.5, 0, 0, 0.25]");
  EXPECT_EQ(read_camera_info(write_text("rational.yaml", rational)).distortion,
            (std::array<double, 8>{-0.1116, 0.1242, 0.001, -0.002, 0.5, 0, 0, 0.25}));
  const CameraModel fisheye = read_camera_info(
      write_text("fisheye.yaml", replaced(replaced(kGood, "plumb_bob", "equidistant"), "-0.002, 0]", "-0.002]")));
  EXPECT_EQ(fisheye.lens, LensModel::equidistant);
  EXPECT_EQ(fisheye.distortion, camera.distortion);
}

TEST(CameraInfo, WritesWhatItReadsBackExactly) {
  std::mt19937_64 random(3);
  const auto between = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random() >> 11) / 9007199254740992.0);
  };
  const std::string path = temporary("round.yaml");
  for (int trial = 0; trial < 200; ++trial) {
    CameraModel camera;
    camera.width = 1 + static_cast<int>(random() % 16384);
    camera.height = 1 + static_cast<int>(random() % 16384);
    camera.fx = between(1, 5000);
    camera.fy = between(1, 5000);
    camera.cx = between(-1, 2) * camera.width;
    camera.cy = between(-1, 2) * camera.height;
    constexpr std::size_t kCounts[] = {5, 8, 4};
    if (trial % 3 == 2) camera.lens = LensModel::equidistant;
    for (std::size_t i = 0; i < kCounts[trial % 3]; ++i) {
      camera.distortion[i] = between(-1, 1) * (trial % 2 == 0 ? 1e-7 : 1);
    }
    write_camera_info(path, camera, "a: name # with 'signs'");
    expect_same(read_camera_info(path), camera);
  }
  write_camera_info(path, paper_camera());
  std::ifstream in(path);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_NE(text.find("669.42,"), std::string::npos) << text;  // shortest, not 669.41999999999996
  EXPECT_THROW(write_camera_info(temporary("no_such_folder/x.yaml"), paper_camera()), Error);
}

struct BadFile {
  const char* why;
  const char* what;
  const char* by;
  const char* named;  // the field or value that the message must name
};

class BadCameraInfo : public testing::TestWithParam<BadFile> {};

TEST_P(BadCameraInfo, IsRefusedByName) {
  const BadFile& bad = GetParam();
  const std::string path = write_text("bad.yaml", replaced(kGood, bad.what, bad.by));
  try {
    read_camera_info(path);
    FAIL() << "no error";
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find(path), std::string::npos) << what;
    EXPECT_NE(what.find(bad.named), std::string::npos) << what;
    EXPECT_NE(what.find(';'), std::string::npos) << "no remedy: " << what;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadCameraInfo,
    testing::Values(
        BadFile{"no_width", "image_width: 640\n", "", "image_width: missing"},
        BadFile{"zero_width", "image_width: 640", "image_width: 0", "image_width: 0"},
        BadFile{"negative_height", "image_height: 480", "image_height: -480", "image_height: -480"},
        BadFile{"huge_width", "image_width: 640", "image_width: 16385", "16385"},
        BadFile{"broken_width", "image_width: 640", "image_width: 640.5", "640.5"},
        BadFile{"width_in_words", "image_width: 640", "image_width: wide", "\"wide\""},
        BadFile{"width_is_list", "image_width: 640", "image_width: [640]", "image_width"},
        BadFile{"no_matrix", "camera_matrix:", "matrix:", "camera_matrix: missing"},
        BadFile{"matrix_without_data", "  data: [669.42", "  values: [669.42", "camera_matrix.data: missing"},
        BadFile{"matrix_is_text", "data: [669.42, 0, 308.825, 0, 672.51, 237.615, 0, 0, 1]", "data: none",
                "camera_matrix.data"},
        BadFile{"short_matrix", "237.615, 0, 0, 1]", "237.615, 0, 0]", "has 8 values"},
        BadFile{"zero_fx", "669.42", "0", "fx"}, BadFile{"negative_fy", "672.51", "-672.51", "fy"},
        BadFile{"fx_nan", "669.42", ".nan", "camera_matrix.data[0]"},
        BadFile{"fx_nan_plain", "669.42", "nan", "camera_matrix.data[0]"},
        BadFile{"fx_infinite", "669.42", ".inf", "camera_matrix.data[0]"},
        BadFile{"fx_overflow", "669.42", "1e999", "camera_matrix.data[0]"}, BadFile{"huge_fx", "669.42", "1e7", "fx"},
        BadFile{"skew", "669.42, 0,", "669.42, 0.5,", "camera_matrix.data[1]"},
        BadFile{"last_row", "0, 0, 1]", "0, 0, 2]", "camera_matrix.data[8]"},
        BadFile{"far_cx", "308.825", "1280.5", "cx"}, BadFile{"far_cy", "237.615", "-480.5", "cy"},
        BadFile{"no_model", "distortion_model: plumb_bob\n", "", "distortion_model: missing"},
        BadFile{"five_of_a_fisheye", "plumb_bob", "equidistant", "has 5 values"},
        BadFile{"unknown_model", "plumb_bob", "barrel", "\"barrel\""},
        BadFile{"no_coefficients", "distortion_coefficients:", "coefficients:", "distortion_coefficients: missing"},
        BadFile{"three_coefficients", "0.001, -0.002, 0]", "0.001]", "has 3 values"},
        BadFile{"coefficient_nan", "0.1242", ".NaN", "distortion_coefficients.data[1]"},
        BadFile{"absurd_coefficient", "0.1242", "12420", "distortion_coefficients.data[1]"},
        BadFile{"unclosed", "237.615, 0, 0, 1]", "237.615, 0, 0, 1", "not a YAML file"}),
    [](const testing::TestParamInfo<BadFile>& bad) { return std::string(bad.param.why); });

TEST(CameraInfo, RefusesFilesThatAreNone) {
  EXPECT_THROW(read_camera_info(temporary("no_such_file.yaml")), Error);
  EXPECT_THROW(read_camera_info(testing::TempDir()), Error);
  EXPECT_THROW(read_camera_info(write_text("empty.yaml", "")), Error);
  EXPECT_THROW(read_camera_info(write_text("list.yaml", "- 1\n- 2\n")), Error);
  EXPECT_THROW(read_camera_info(write_text("binary.yaml", std::string("\0\1\2\xff\xfe", 5))), Error);
}

TEST(NumberText, IsShortestAndExact) {
  EXPECT_EQ(shortest_decimal(0), "0");
  EXPECT_EQ(shortest_decimal(0.1), "0.1");
  EXPECT_EQ(shortest_decimal(-1338.84), "-1338.84");
  EXPECT_EQ(shortest_decimal(480), "480");
  EXPECT_EQ(shortest_decimal(1e14), "100000000000000");
  EXPECT_EQ(shortest_decimal(1e300), "1e+300");
  EXPECT_EQ(shortest_decimal(0.00025), "0.00025");
  EXPECT_EQ(shortest_decimal(1.0 / 3), "0.3333333333333333");
  std::mt19937_64 random(4);
  for (int trial = 0; trial < 2000; ++trial) {
    const double value = std::ldexp(static_cast<double>(random()), static_cast<int>(random() % 200) - 150);
    double back = 0;
    ASSERT_TRUE(parse_decimal(shortest_decimal(value), back));
    ASSERT_EQ(back, value);
  }
  double value = 0;
  for (const char* text : {"", "nan", "inf", "0x10", "1,5", "1.5 ", "1e", "--1", "1e999"}) {
    EXPECT_FALSE(parse_decimal(text, value)) << text;
  }
}

}  // namespace
}  // namespace berth
