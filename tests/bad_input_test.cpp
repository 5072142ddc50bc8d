// Bad input, one by one: the message names file, field, value and remedy, the exit code is 2, the rest is processed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "berth/camera.hpp"
#include "berth/error.hpp"
#include "camera/image_file.hpp"
#include "support/command_run.hpp"

namespace berth {
namespace {

using test::CommandRun;
using test::run_berth;
using test::ScratchFolder;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kGood = std::string(BERTH_TEST_DATA) + "/tag36h11_7.png";

std::vector<u8> encoded(const std::string& ending) {
  cv::Mat picture(40, 60, CV_8UC3);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      picture.at<cv::Vec3b>(y, x) = {static_cast<u8>(x * y), static_cast<u8>(x * 4), static_cast<u8>(y * 6)};
    }
  }
  std::vector<u8> bytes;
  cv::imencode(ending, picture, bytes);
  return bytes;
}

/// What read_gray_image says about a file of these bytes; empty when it reads it.
std::string complaint(const ScratchFolder& folder, const std::string& name, const std::vector<u8>& bytes) {
  const std::string path = folder.write(name, bytes);
  try {
    read_gray_image(path);
    return "";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), StartsWith(path + ": ")) << "the file is not named";
    EXPECT_THAT(error.what(), HasSubstr("; ")) << "no remedy";
    return error.what();
  }
}

std::vector<u8> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

TEST(BadImage, CutShortAnywhereIsAnError) {
  const ScratchFolder folder;
  for (const std::string ending : {".png", ".jpg", ".ppm"}) {
    const std::vector<u8> whole = encoded(ending);
    ASSERT_EQ(complaint(folder, "whole" + ending, whole), "");
    for (std::size_t n = 0; n < whole.size(); n += n < 200 ? 1 : 29) {
      const std::vector<u8> part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
      EXPECT_NE(complaint(folder, "cut" + ending, part), "") << ending << " cut to " << n << " of " << whole.size();
    }
    const std::vector<u8> last_byte_gone(whole.begin(), whole.end() - 1);
    EXPECT_NE(complaint(folder, "cut" + ending, last_byte_gone), "") << ending;
  }
}

TEST(BadImage, HoleInTheMiddleIsAnError) {
  const ScratchFolder folder;
  for (const std::string ending : {".png", ".jpg"}) {
    std::vector<u8> bytes = encoded(ending);
    const auto middle = bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() * 2 / 3);
    bytes.erase(middle, middle + 100);
    EXPECT_NE(complaint(folder, "hole" + ending, bytes), "") << ending;
  }
  std::vector<u8> flipped = encoded(".png");
  flipped[flipped.size() / 2] ^= 0x10;
  EXPECT_THAT(complaint(folder, "flipped.png", flipped), HasSubstr("'IDAT' is damaged"));
}

TEST(BadImage, SaysWhatIsWrong) {
  const ScratchFolder folder;
  EXPECT_THAT(complaint(folder, "a.png", {}), HasSubstr("empty (0 bytes)"));
  EXPECT_THAT(complaint(folder, "b.png", bytes_of("GIF89a")), HasSubstr("no PNG, JPEG or PNM"));
  EXPECT_THAT(complaint(folder, "c.pgm", bytes_of("P5 2 2 255\nabc")),
              HasSubstr("3 bytes where the header promises 4"));
  EXPECT_THAT(complaint(folder, "d.pgm", bytes_of("P5 2 2 0\nabcd")), HasSubstr("'maxval' is 0"));
  EXPECT_THAT(complaint(folder, "e.pgm", bytes_of("P5 2 2 65536\nabcd")), HasSubstr("'maxval' is 65536"));
  EXPECT_THAT(complaint(folder, "f.pgm", bytes_of("P5 -2 2 255\nabcd")), HasSubstr("'width' is no number at byte 3"));
  EXPECT_THAT(complaint(folder, "g.pgm", bytes_of("P2 2 1 9 10 1")), HasSubstr("'pixels' is 10, above"));
  EXPECT_THAT(complaint(folder, "h.pgm", bytes_of("P5 0 2 255\n")), HasSubstr("'width' is 0"));
  std::vector<u8> jpeg = encoded(".jpg");
  jpeg.resize(jpeg.size() / 2);
  EXPECT_THAT(complaint(folder, "i.jpg", jpeg), HasSubstr("damaged or cut short"));
  std::vector<u8> png = encoded(".png");
  png.resize(png.size() - 12);
  EXPECT_THAT(complaint(folder, "j.png", png), HasSubstr("'IEND' is missing"));
}

TEST(BadImage, TooLargeIsToldFromTheHeader) {
  const ScratchFolder folder;
  EXPECT_THAT(complaint(folder, "a.pgm", bytes_of("P5 16385 1 255\n")),
              AllOf(HasSubstr("'width' is 16385"), HasSubstr("at most 16384")));
  EXPECT_THAT(complaint(folder, "b.pgm", bytes_of("P5 1 99999999999999999999 255\n")), HasSubstr("'height' is"));
  std::vector<u8> png = encoded(".png");
  png[18] = 0x9c, png[19] = 0x40;  // the header's width, 40000
  EXPECT_THAT(complaint(folder, "c.png", png), HasSubstr("'width' is 40000"));
  std::vector<u8> jpeg = encoded(".jpg");
  for (std::size_t i = 2; i + 6 < jpeg.size(); ++i) {
    if (jpeg[i] == 0xff && jpeg[i + 1] == 0xc0) {  // the frame header: length, precision, height, width
      jpeg[i + 5] = 0x75, jpeg[i + 6] = 0x30;
      break;
    }
  }
  EXPECT_THAT(complaint(folder, "d.jpg", jpeg), HasSubstr("'height' is 30000"));
}

TEST(BadInput, TheOtherImagesAreStillProcessed) {
  const ScratchFolder folder;
  const std::string empty = folder.write("empty.png", std::string());
  const std::string cut = folder.write("cut.jpg", std::string("\xff\xd8\xff\xe0", 4));
  const std::string missing = folder / "missing.png";
  const std::string dot = folder.write("dot.pgm", std::string("P5 1 1 255\nA"));
  const CommandRun run = run_berth({"detect", "--json", missing, kGood, empty, cut, folder.path(), dot, kGood});
  EXPECT_EQ(run.exit_code, 2);
  const std::vector<nlohmann::json> lines = run.lines();
  // kGood, dot.pgm of the folder, dot.pgm, kGood
  ASSERT_EQ(lines.size(), 4u) << run.out;
  EXPECT_EQ(lines[0]["image"], kGood);
  EXPECT_EQ(lines[0]["detections"].size(), 1u);
  EXPECT_EQ(lines[1]["image"], dot);
  EXPECT_EQ(lines[1]["detections"].size(), 0u);
  EXPECT_EQ(lines[3]["image"], kGood);
  EXPECT_THAT(run.err, HasSubstr("berth: " + missing + ": the file cannot be read (No such file or directory)"));
  EXPECT_THAT(run.err, HasSubstr("berth: " + empty + ": the file is empty"));
  EXPECT_THAT(run.err, HasSubstr("berth: " + cut + ": the JPEG is damaged"));
}

TEST(BadInput, OnePixelIsNoError) {
  const ScratchFolder folder;
  const CommandRun run = run_berth({"detect", "--json", folder.write("dot.pgm", std::string("P5 1 1 255\nA"))});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  ASSERT_EQ(run.lines().size(), 1u);
  EXPECT_TRUE(run.lines()[0]["detections"].empty());
}

void expect_usage_error(const std::vector<std::string>& arguments, const std::vector<std::string>& parts) {
  const CommandRun run = run_berth(arguments);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.out, "");
  EXPECT_THAT(run.err, StartsWith("berth: "));
  for (const std::string& part : parts) EXPECT_THAT(run.err, HasSubstr(part));
}

TEST(BadInput, MarkerSizeMustBeANumberAboveZero) {
  for (const std::string size : {"0", "-0.08", "nan", "inf", "eight", "0.08m", "1001", "0,08"}) {
    SCOPED_TRACE(size);
    expect_usage_error({"detect", "--size", size, kGood}, {"'--size' is '" + size + "'", "metres"});
  }
}

TEST(BadInput, FamilyAndBackendMustBeKnown) {
  expect_usage_error({"detect", "--family", "tag36h12", kGood}, {"'--family' is 'tag36h12'", "tag36h11"});
  expect_usage_error({"detect", "--family", "tag36h11,nonsense", kGood}, {"'--family' is 'nonsense'"});
  expect_usage_error({"detect", "--backend", "cuba", kGood}, {"'--backend' is 'cuba'", "simd", "reference"});
  expect_usage_error({"verify", "--backend", "cuba"}, {"'--backend' is 'cuba'", "simd"});
  expect_usage_error({"detect", "--threads", "-1", kGood}, {"'--threads' is -1"});
  expect_usage_error({"detect", "--max-hamming", "99", kGood}, {"'--max-hamming' is 99"});
}

TEST(BadInput, CameraFileMustBeSound) {
  const ScratchFolder folder;
  const std::string missing = folder / "missing.yaml";
  expect_usage_error({"detect", "--camera", missing, "--size", "0.08", kGood}, {missing});
  const std::string absurd = folder.write(
      "absurd.yaml", std::string("image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\n"
                                 "camera_matrix: {rows: 3, cols: 3, data: [0, 0, 320, 0, 600, 240, 0, 0, 1]}\n"
                                 "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"));
  expect_usage_error({"detect", "--camera", absurd, "--size", "0.08", kGood}, {absurd, "camera_matrix"});
}

TEST(BadInput, CameraOfAnotherSizeRefusesThePose) {
  const ScratchFolder folder;
  const std::string camera = folder / "cam.yaml";
  write_camera_info(camera, paper_camera(1280, 960));
  const std::string image = folder.write("small.pgm", "P5 33 22 255\n" + std::string(33 * 22, 'x'));
  const CommandRun run = run_berth({"detect", "--json", "--camera", camera, "--size", "0.1", image, kGood});
  EXPECT_EQ(run.exit_code, 2);
  const std::vector<nlohmann::json> lines = run.lines();
  ASSERT_EQ(lines.size(), 2u);
  ASSERT_EQ(lines[1]["detections"].size(), 1u);
  EXPECT_FALSE(lines[1]["detections"][0].contains("pose"));
  EXPECT_THAT(run.err, AllOf(HasSubstr("33x22"), HasSubstr("1280x960"), HasSubstr(image), HasSubstr(camera)));
}

TEST(BadInput, UsageErrorsEndWithTwo) {
  expect_usage_error({}, {"--help"});
  expect_usage_error({"dock"}, {"'dock'", "demo", "detect"});
  expect_usage_error({"detect"}, {"IMAGE"});
  expect_usage_error({"detect", "--colour", kGood}, {"--colour"});
  expect_usage_error({"detect", "--threads", "many", kGood}, {"many"});
  expect_usage_error({"run"}, {"--source"});
  expect_usage_error({"run", "--source", "nowhere"}, {"nowhere"});
  expect_usage_error({"demo", "--scenario", "nowhere.toml"}, {"nowhere.toml"});
}

TEST(BadInput, AFolderWithoutImagesIsNamed) {
  const ScratchFolder folder;
  expect_usage_error({"detect", folder.path()}, {folder.path(), "holds no image"});
}

TEST(BadInput, OutputThatCannotBeWrittenIsNamed) {
  const ScratchFolder folder;
  const std::string file = folder.write("file", std::string("x"));
  expect_usage_error({"detect", "--draw", file + "/inside", kGood}, {"'--draw' is '" + file + "/inside'"});
  expect_usage_error({"detect", "--draw", folder / "one.png", kGood, kGood}, {"2 pictures"});
  expect_usage_error({"run", "--source", "file:" + kGood, "--json", file + "/log"}, {file + "/log"});
}

}  // namespace
}  // namespace berth
