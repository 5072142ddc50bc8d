// `berth detect` as a user meets it: its lines, its drawings, its poses, its complaints.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <locale>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "support/command_run.hpp"
#include "support/marker_image.hpp"

namespace berth {
namespace {

using nlohmann::json;
using test::CommandRun;
using test::kImage;
using test::run_berth;
using test::ScratchFolder;
using testing::ElementsAre;
using testing::HasSubstr;

cv::Size image_size() { return cv::imread(kImage, cv::IMREAD_UNCHANGED).size(); }

/// A camera file for kImage.
std::string camera_file(const ScratchFolder& folder) {
  write_camera_info(folder / "cam.yaml", paper_camera(image_size().width, image_size().height));
  return folder / "cam.yaml";
}

std::vector<std::string> keys_of(const nlohmann::ordered_json& object) {
  std::vector<std::string> keys;
  for (const auto& item : object.items()) keys.push_back(item.key());
  return keys;
}

TEST(Detect, JsonLineHasTheDocumentedFields) {
  const CommandRun run = run_berth({"detect", "--json", kImage});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const auto line = nlohmann::ordered_json::parse(run.out);
  EXPECT_THAT(keys_of(line), ElementsAre("image", "ms", "detections"));
  EXPECT_EQ(line["image"], kImage);
  EXPECT_GT(line["ms"], 0);
  ASSERT_EQ(line["detections"].size(), 1u);
  const nlohmann::ordered_json& detection = line["detections"][0];
  EXPECT_THAT(keys_of(detection),
              ElementsAre("family", "id", "hamming", "margin", "corners", "center", "corner_covariance_px2"));
  EXPECT_EQ(detection["corner_covariance_px2"].size(), 64u);
  EXPECT_EQ(detection["family"], "tag36h11");
  EXPECT_EQ(detection["id"], 7);
  EXPECT_EQ(detection["hamming"], 0);
  ASSERT_EQ(detection["corners"].size(), 4u);
  // Counter-clockwise on the screen, where y grows downwards: the signed area is negative.
  double twice_area = 0;
  for (int i = 0; i < 4; ++i) {
    const auto& a = detection["corners"][i];
    const auto& b = detection["corners"][(i + 1) % 4];
    twice_area += a[0].get<double>() * b[1].get<double>() - b[0].get<double>() * a[1].get<double>();
  }
  EXPECT_LT(twice_area, 0);
}

TEST(Detect, AnotherSizeGivesAPoseOnlyWhenToldHow) {
  const ScratchFolder folder;
  const auto pose_with = [&](const CameraModel& camera, const std::vector<std::string>& how, int exit_code) {
    write_camera_info(folder / "other.yaml", camera);
    std::vector<std::string> arguments = {"detect", "--json", "--camera", folder / "other.yaml",
                                          "--size", "0.1",    kImage};
    arguments.insert(arguments.end(), how.begin(), how.end());
    const CommandRun run = run_berth(arguments);
    EXPECT_EQ(run.exit_code, exit_code) << run.err;
    const json marker = run.lines().at(0)["detections"][0];
    return marker.contains("pose") ? marker["pose"]["t"].get<std::array<double, 3>>() : std::array<double, 3>{};
  };
  const cv::Size size = image_size();
  const CameraModel fitting = paper_camera(size.width, size.height);
  const CameraModel twice = paper_camera(2 * size.width, 2 * size.height);
  CameraModel around = fitting;
  around.width += 60;
  around.height += 20;
  around.cx += 30;
  around.cy += 10;
  const std::array<double, 3> expected = pose_with(fitting, {}, 0);
  EXPECT_GT(expected[2], 0);
  EXPECT_EQ(pose_with(twice, {}, 2)[2], 0);
  EXPECT_EQ(pose_with(around, {"--camera-fit", "resize"}, 2)[2], 0);
  EXPECT_EQ(pose_with(around, {"--camera-fit", "crop"}, 0), expected);
  const std::array<double, 3> resized = pose_with(twice, {"--camera-fit", "resize"}, 0);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(resized[i], expected[i], 1e-9);
}

TEST(Detect, PoseNeedsCameraAndSize) {
  const ScratchFolder folder;
  const std::string camera = camera_file(folder);
  const CommandRun with = run_berth({"detect", "--json", "--camera", camera, "--size", "0.1", kImage});
  ASSERT_EQ(with.exit_code, 0) << with.err;
  const json pose = with.lines().at(0)["detections"][0]["pose"];
  EXPECT_EQ(pose["R"].size(), 9u);
  ASSERT_EQ(pose["t"].size(), 3u);
  EXPECT_GT(pose["t"][2], 0);
  EXPECT_EQ(pose["covariance"].size(), 36u);
  EXPECT_GT(pose["covariance"][14].get<double>(), 0);  // of the range
  EXPECT_GT(pose["error_px"].get<double>(), 0.5);      // this camera did not take the image, and it shows
  EXPECT_LE(pose["ambiguity"].get<double>(), 1);
  const CommandRun paper =
      run_berth({"detect", "--json", "--camera", camera, "--size", "0.1", "--pose", "paper", kImage});
  const json closed = paper.lines().at(0)["detections"][0]["pose"];
  EXPECT_FALSE(closed.contains("covariance"));
  EXPECT_NEAR(closed["t"][2].get<double>(), pose["t"][2].get<double>(), 0.1 * pose["t"][2].get<double>());
  const CommandRun twice = run_berth({"detect", "--json", "--camera", camera, "--size", "0.2", kImage});
  EXPECT_NEAR(twice.lines().at(0)["detections"][0]["pose"]["t"][2].get<double>(), 2 * pose["t"][2].get<double>(), 1e-9);
  for (const std::vector<std::string>& half : {std::vector<std::string>{"--camera", camera}, {"--size", "0.1"}}) {
    std::vector<std::string> arguments = {"detect", "--json", kImage};
    arguments.insert(arguments.end(), half.begin(), half.end());
    const CommandRun without = run_berth(arguments);
    EXPECT_EQ(without.exit_code, 0);
    EXPECT_FALSE(without.lines().at(0)["detections"][0].contains("pose"));
    EXPECT_THAT(without.err, HasSubstr("no poses: "));
  }
}

TEST(Detect, PhotometricCornersComeWithTheirCovariance) {
  const CommandRun plain = run_berth({"detect", "--json", kImage});
  EXPECT_FALSE(plain.lines().at(0)["detections"][0].contains("corner_fit"));
  const CommandRun fitted = run_berth({"detect", "--json", "--corners", "photometric", kImage});
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json marker = fitted.lines().at(0)["detections"][0];
  ASSERT_TRUE(marker.contains("corner_fit"));
  EXPECT_EQ(marker["corner_covariance_px2"].size(), 64u);
  EXPECT_LT(marker["corner_covariance_px2"][0].get<double>(),
            plain.lines().at(0)["detections"][0]["corner_covariance_px2"][0].get<double>());
  EXPECT_GT(marker["corner_fit"]["noise"].get<double>(), 0);
  EXPECT_NE(run_berth({"detect", "--corners", "guessed", kImage}).exit_code, 0);
}

TEST(Detect, BackendsPrintTheSameNumbers) {
  const auto detections = [](const std::string& backend) {
    const CommandRun run = run_berth({"detect", "--json", "--backend", backend, kImage});
    EXPECT_EQ(run.exit_code, 0) << backend << ": " << run.err;
    return run.lines().at(0)["detections"].dump();
  };
  const std::string reference = detections("reference");
  EXPECT_THAT(reference, HasSubstr("\"id\":7"));
  EXPECT_EQ(detections("simd"), reference);
  EXPECT_EQ(detections("cpu"), reference);
}

TEST(Detect, NamesOfEveryKindSurvive) {
  const ScratchFolder folder;
  for (const std::string name :
       {"über.png", "two words.png", "quote\".png", "back\\slash.png", "tab\t.png", "日本.png"}) {
    std::filesystem::copy_file(kImage, folder / name);
    const CommandRun run = run_berth({"detect", "--json", folder / name});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    ASSERT_EQ(run.lines().size(), 1u);
    EXPECT_EQ(run.lines()[0]["image"], folder / name);
    EXPECT_EQ(run.lines()[0]["detections"].size(), 1u);
  }
  std::filesystem::copy_file(kImage, folder / "latin\xe9.png");
  EXPECT_THAT(run_berth({"detect", "--json", folder / "latin\xe9.png"}).lines().at(0)["image"].get<std::string>(),
              HasSubstr("latin\xef\xbf\xbd.png"));
}

TEST(Detect, FolderMeansEveryImageInItByName) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "deeper");
  for (const char* name : {"b.png", "a.png", "deeper/c.png"}) std::filesystem::copy_file(kImage, folder / name);
  folder.write("notes.txt", std::string("not an image"));
  const auto images = [](const CommandRun& run) {
    std::vector<std::string> names;
    for (const json& line : run.lines()) names.push_back(line["image"]);
    return names;
  };
  EXPECT_THAT(images(run_berth({"detect", "--json", folder.path()})), ElementsAre(folder / "a.png", folder / "b.png"));
  EXPECT_THAT(images(run_berth({"detect", "--json", "-r", folder.path()})),
              ElementsAre(folder / "a.png", folder / "b.png", folder / "deeper/c.png"));
}

TEST(Detect, FamilyListsAreAccepted) {
  for (const std::vector<std::string>& families :
       {std::vector<std::string>{"--family", "tag25h9,tag36h11"}, {"--family", "tag25h9", "--family", "tag36h11"}}) {
    std::vector<std::string> arguments = {"detect", "--json"};
    arguments.insert(arguments.end(), families.begin(), families.end());
    arguments.push_back(kImage);
    const CommandRun run = run_berth(arguments);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.lines().at(0)["detections"].size(), 1u);
  }
  EXPECT_TRUE(run_berth({"detect", "--json", "--family", "tag25h9", kImage}).lines().at(0)["detections"].empty());
}

TEST(Detect, DrawsOnTheImage) {
  const ScratchFolder folder;
  const CommandRun run =
      run_berth({"detect", "--camera", camera_file(folder), "--size", "0.1", "--draw", folder / "seen.png", kImage});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("tag36h11"));
  const cv::Mat drawn = cv::imread(folder / "seen.png", cv::IMREAD_COLOR);
  ASSERT_FALSE(drawn.empty());
  const int factor = drawn.cols / image_size().width;
  EXPECT_EQ(drawn.size(), image_size() * factor);
  // Corner 1 has a red dot.
  const json corner = run_berth({"detect", "--json", kImage}).lines().at(0)["detections"][0]["corners"][0];
  const auto at = [&](int i) { return static_cast<int>((corner[i].get<double>() + 0.5) * factor); };
  const cv::Vec3b pixel = drawn.at<cv::Vec3b>(at(1), at(0));
  EXPECT_GT(pixel[2], 200);
  EXPECT_LT(pixel[1], 120);
}

TEST(Detect, DrawsIntoAFolderWithoutOverwriting) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "x");
  std::filesystem::copy_file(kImage, folder / "x/same.png");
  std::filesystem::copy_file(kImage, folder / "same.png");
  const CommandRun run = run_berth({"detect", "--draw", folder / "out", folder / "same.png", folder / "x/same.png"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_FALSE(cv::imread(folder / "out/same.png").empty());
  EXPECT_FALSE(cv::imread(folder / "out/same_2.png").empty());
}

/// A locale that writes 1234.5 as 1'234,5.
class OddNumbers : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '\''; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(Detect, NumbersDoNotDependOnTheLocale) {
  const ScratchFolder folder;
  const std::vector<std::string> arguments = {"detect", "--json", "--camera", camera_file(folder),
                                              "--size", "0.1",    kImage};
  const json plain = run_berth(arguments).lines().at(0)["detections"];
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new OddNumbers));
  const CommandRun odd = run_berth(arguments);
  std::locale::global(before);
  EXPECT_EQ(odd.exit_code, 0) << odd.err;
  EXPECT_EQ(odd.lines().at(0)["detections"], plain);
}

}  // namespace
}  // namespace berth
