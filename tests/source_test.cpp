// Files as frames: the pixels that come out of each format, folders, videos, source names.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "berth/error.hpp"
#include "camera/image_file.hpp"
#include "camera/sources.hpp"
#include "support/command_run.hpp"

namespace berth {
namespace {

using test::ScratchFolder;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<int> pixels(const GrayImage& image) {
  std::vector<int> all;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) all.push_back(image.view().at(x, y));
  }
  return all;
}

std::vector<u8> encoded(const std::string& ending, const cv::Mat& picture) {
  std::vector<u8> bytes;
  cv::imencode(ending, picture, bytes);
  return bytes;
}

TEST(ReadGrayImage, TakesPgmBytesAsTheyAre) {
  const ScratchFolder folder;
  const std::string text = "P5\n# a comment\n3 2 # another\n255\n";
  const std::string path = folder.write("a.pgm", text + std::string("\x00\x01\x7f\x80\xfe\xff", 6));
  const GrayImage image = read_gray_image(path);
  EXPECT_EQ(image.width(), 3);
  EXPECT_EQ(image.height(), 2);
  EXPECT_THAT(pixels(image), ElementsAre(0, 1, 127, 128, 254, 255));
}

TEST(ReadGrayImage, ScalesPgmByItsMaximumRoundingToNearest) {
  const ScratchFolder folder;
  EXPECT_THAT(pixels(read_gray_image(folder.write("a.pgm", std::string("P2 5 1 15 0 1 7 8 15")))),
              ElementsAre(0, 17, 119, 136, 255));
  // 65535 / 255 = 257: 128 is the last value nearer to 0, 129 the first nearer to 1.
  const std::string sixteen = "P5 4 1 65535\n" + std::string("\x00\x80\x00\x81\x80\x00\xff\xff", 8);
  EXPECT_THAT(pixels(read_gray_image(folder.write("b.pgm", sixteen))), ElementsAre(0, 1, 128, 255));
}

TEST(ReadGrayImage, WeighsColoursInIntegers) {
  const ScratchFolder folder;
  const std::string ppm =
      "P6 5 1 255\n" + std::string("\xff\x00\x00\x00\xff\x00\x00\x00\xff\xff\xff\xff\x01\x02\x03", 15);
  EXPECT_THAT(pixels(read_gray_image(folder.write("a.ppm", ppm))), ElementsAre(76, 150, 29, 255, 2));
  EXPECT_THAT(pixels(read_gray_image(folder.write("b.ppm", std::string("P3 1 1 255 255 0 0")))), ElementsAre(76));
  // OpenCV's order is blue, green, red.
  const cv::Mat picture =
      (cv::Mat_<cv::Vec3b>(1, 3) << cv::Vec3b(0, 0, 255), cv::Vec3b(0, 255, 0), cv::Vec3b(255, 0, 0));
  EXPECT_THAT(pixels(read_gray_image(folder.write("c.png", encoded(".png", picture)))), ElementsAre(76, 150, 29));
}

TEST(ReadGrayImage, IgnoresAlphaAndRoundsSixteenBits) {
  const ScratchFolder folder;
  const cv::Mat clear = (cv::Mat_<cv::Vec4b>(1, 2) << cv::Vec4b(9, 9, 9, 0), cv::Vec4b(200, 200, 200, 255));
  EXPECT_THAT(pixels(read_gray_image(folder.write("a.png", encoded(".png", clear)))), ElementsAre(9, 200));
  const cv::Mat deep = (cv::Mat_<std::uint16_t>(1, 4) << 0x80, 0x81, 0x8000, 0xffff);
  EXPECT_THAT(pixels(read_gray_image(folder.write("b.png", encoded(".png", deep)))), ElementsAre(0, 1, 128, 255));
}

TEST(ReadGrayImage, GoesByTheContentNotTheName) {
  const ScratchFolder folder;
  const cv::Mat picture(2, 2, CV_8U, cv::Scalar(77));
  EXPECT_THAT(pixels(read_gray_image(folder.write("png.pgm", encoded(".png", picture)))), ElementsAre(77, 77, 77, 77));
}

TEST(ReadGrayImage, DecodesGrayJpegAsTheLibraryDoes) {
  cv::Mat picture(67, 91, CV_8U);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) picture.at<u8>(y, x) = static_cast<u8>((x * x + 3 * y * x + 7 * y) & 255);
  }
  const std::vector<u8> bytes = encoded(".jpg", picture);
  const cv::Mat expected = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  const ScratchFolder folder;
  const GrayImage image = read_gray_image(folder.write("a.jpg", bytes));
  ASSERT_EQ(image.width(), 91);
  ASSERT_EQ(image.height(), 67);
  for (int y = 0; y < 67; ++y) {
    for (int x = 0; x < 91; ++x) ASSERT_EQ(image.view().at(x, y), expected.at<u8>(y, x)) << x << ' ' << y;
  }
}

TEST(ReadGrayImage, TakesOnePixelAndTheLargestSide) {
  const ScratchFolder folder;
  EXPECT_THAT(pixels(read_gray_image(folder.write("a.pgm", std::string("P5 1 1 255\nA")))), ElementsAre('A'));
  const GrayImage wide = read_gray_image(folder.write("b.pgm", "P5 16384 1 255\n" + std::string(16384, 'x')));
  EXPECT_EQ(wide.width(), kMaxImageSide);
}

TEST(ListImages, SortsByNameAndSkipsOtherFiles) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "c.png.d");
  std::filesystem::create_directories(folder / "sub.png");
  for (const char* name : {"b.JPG", "a.png", "notes.txt", "ä.pgm", "sub.png/z.jpeg"})
    folder.write(name, std::string("x"));
  EXPECT_THAT(list_images(folder.path(), false), ElementsAre(folder / "a.png", folder / "b.JPG", folder / "ä.pgm"));
  EXPECT_THAT(list_images(folder.path(), true),
              ElementsAre(folder / "a.png", folder / "b.JPG", folder / "sub.png/z.jpeg", folder / "ä.pgm"));
}

TEST(Sources, FolderGoesOnAfterADamagedFile) {
  const ScratchFolder folder;
  folder.write("1.pgm", std::string("P5 1 1 255\nA"));
  folder.write("2.pgm", std::string("P5 1 1"));
  folder.write("3.pgm", std::string("P5 1 1 255\nC"));
  const std::unique_ptr<Source> source = open_source("dir:" + folder.path());
  EXPECT_EQ(source->size(), 3u);
  EXPECT_EQ(source->next()->label, folder / "1.pgm");
  EXPECT_THROW(source->next(), Error);
  const std::optional<SourceFrame> third = source->next();
  ASSERT_TRUE(third);
  EXPECT_EQ(third->stamp.sequence, 2u);
  EXPECT_THAT(pixels(third->image), ElementsAre('C'));
  EXPECT_FALSE(source->next());
}

TEST(Sources, VideoGivesEveryFrameWithItsTime) {
  const ScratchFolder folder;
  const std::string path = folder / "v.avi";
  {
    cv::VideoWriter writer(path, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25, cv::Size(64, 48));
    ASSERT_TRUE(writer.isOpened());
    for (int i = 0; i < 5; ++i) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(40 * i)));
  }
  const std::unique_ptr<Source> source = open_source(path);
  for (int i = 0; i < 5; ++i) {
    const std::optional<SourceFrame> frame = source->next();
    ASSERT_TRUE(frame) << i;
    EXPECT_EQ(frame->stamp.sequence, static_cast<u64>(i));
    EXPECT_NEAR(static_cast<double>(frame->stamp.exposure_start_ns), i * 40e6, 1e6);
    EXPECT_EQ(frame->image.width(), 64);
    EXPECT_EQ(frame->image.height(), 48);
    EXPECT_NEAR(frame->image.view().at(20, 20), 40 * i, 2);
  }
  EXPECT_FALSE(source->next());
}

void expect_error(const std::string& spec, const std::string& part) {
  try {
    open_source(spec);
    ADD_FAILURE() << spec << " opened";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(part)) << spec;
  }
}

TEST(Sources, SayWhyTheyCannotBeOpened) {
  const ScratchFolder folder;
  expect_error(folder / "nothing", "there is no such file or folder");
  expect_error("dir:" + folder.path(), "holds no image");
  expect_error("dir:" + (folder / "nothing"), "No such file");
  expect_error("video:" + (folder / "nothing.mp4"), "cannot be read");
  expect_error("video:" + folder.write("empty.mp4", std::string()), "is empty");
  expect_error("video:" + folder.write("text.mp4", std::string("no video at all")), "cannot open it as a video");
  expect_error("sim:" + (folder / "nothing.toml"), "nothing.toml");
}

}  // namespace
}  // namespace berth
