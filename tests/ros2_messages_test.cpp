// Messages of ROS 2 byte by byte, by hand; that they keep their memory; definitions. That other libraries read them is
// shown by ros2/read_messages.py.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "quaternion.hpp"
#include "ros2/messages.hpp"
#include "ros2/sample_messages.hpp"
#include "sim/geometry.hpp"
#include "support/complaint.hpp"
#include "support/counted_allocations.hpp"

namespace berth::ros2 {
namespace {

using test::complaint;
using testing::ElementsAreArray;
using testing::HasSubstr;
using testing::Not;

// Bytes as hexadecimal, in groups as one likes.
std::vector<u8> hex(const std::string& text) {
  std::vector<u8> bytes;
  std::string digits;
  std::copy_if(text.begin(), text.end(), std::back_inserter(digits), [](char c) { return c != ' ' && c != '\n'; });
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    bytes.push_back(static_cast<u8>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

constexpr const char* kOne = "000000000000f03f ";   // 1.0
constexpr const char* kZero = "0000000000000000 ";  // 0.0

TEST(CdrWriter, AlignsToEachValuesSizeCountedBehindTheFirstFourBytes) {
  CdrWriter cdr;
  cdr.begin();
  cdr.uint8(0xff);
  cdr.float64(1);
  cdr.boolean(true);
  cdr.int32(-2);
  cdr.uint8(7);
  cdr.uint64(0x0102030405060708);
  cdr.float32(1);
  cdr.int64(-1);
  EXPECT_THAT(cdr.bytes(), ElementsAreArray(hex("00010000"
                                                "ff 00000000000000 000000000000f03f"
                                                "01 000000 feffffff"
                                                "07 00000000000000 0807060504030201"
                                                "0000803f 00000000 ffffffffffffffff")));
}

TEST(CdrWriter, StringsCountTheirClosingZero) {
  CdrWriter cdr;
  cdr.begin();
  cdr.string("");
  cdr.string("dock");
  cdr.uint32(9);
  EXPECT_THAT(cdr.bytes(), ElementsAreArray(hex("00010000"
                                                "01000000 00 000000"
                                                "05000000 646f636b00 000000"
                                                "09000000")));
}

TEST(Ros2Messages, PoseStamped) {
  // 12 bytes of header and string end at 4 + 8 + 4 + 3 = 15 behind the head: one byte of padding, then doubles.
  PoseStamped message;
  message.header = {1'000'000'002, "ab"};
  message.pose.t = {1, 0, -2};
  CdrWriter cdr;
  write(message, cdr);
  EXPECT_THAT(cdr.bytes(), ElementsAreArray(hex(std::string("00010000 01000000 02000000 03000000 616200 00 ") + kOne +
                                                kZero + "00000000000000c0 " + kZero + kZero + kZero + kOne)));
}

TEST(Ros2Messages, DoublesBehindEveryLengthOfName) {
  for (std::size_t length = 0; length < 20; ++length) {
    const std::string name(length, 'x');
    PoseWithCovarianceStamped message;
    message.header.frame_id = name;
    std::iota(message.covariance.begin(), message.covariance.end(), 1.0);
    CdrWriter cdr;
    write(message, cdr);
    // Header: 8 bytes of time, 4 of length, name and zero; then to a multiple of 8.
    const std::size_t doubles = 4 + (12 + length + 1 + 7) / 8 * 8;
    ASSERT_EQ(cdr.bytes().size(), doubles + (7 + 36) * 8);
    double last = 0;
    std::memcpy(&last, cdr.bytes().data() + doubles + 42 * 8, 8);
    EXPECT_EQ(last, 36);
  }
}

TEST(Ros2Messages, TransformsAreASequenceOfStructures) {
  TransformList list;
  list.transforms.resize(2);
  list.transforms[0].header = {0, "c"};
  list.transforms[0].child_frame_id = "m";
  list.transforms[1] = list.transforms[0];
  CdrWriter cdr;
  write(list, cdr);
  const std::string identity = std::string(kZero) + kZero + kZero + kZero + kZero + kZero + kOne;
  // From 4: times 4…12, "c" 12…18, to 20: "m" 20…26, to 32; and from 88: 88…96, 96…102, 104…110, to 112.
  EXPECT_THAT(cdr.bytes(),
              ElementsAreArray(hex("00010000 02000000"
                                   "00000000 00000000 02000000 6300 0000 02000000 6d00 000000000000" +
                                   identity + "00000000 00000000 02000000 6300 0000 02000000 6d00 0000" + identity)));
}

TEST(Ros2Messages, NothingSeenIsAnEmptySequence) {
  const std::vector<Detection> none;
  CdrWriter cdr;
  write(AprilTagDetectionArray{{0, "c"}, none}, cdr);
  EXPECT_THAT(cdr.bytes(), ElementsAreArray(hex("00010000 00000000 00000000 02000000 6300 0000 00000000")));
}

TEST(Ros2Messages, AnImagesRowsCloseUp) {
  const std::vector<u8> pixels = {1, 2, 99, 3, 4, 99};
  CdrWriter cdr;
  write(Image{{0, ""}, {pixels.data(), 2, 2, 3}}, cdr);
  EXPECT_THAT(cdr.bytes(), ElementsAreArray(hex("00010000 00000000 00000000 01000000 00 000000"
                                                "02000000 02000000 06000000 6d6f6e6f3800 00 00"
                                                "02000000 04000000 01020304")));
}

TEST(Ros2Messages, TimesBefore1970CountAsNone) {
  PoseStamped message;
  message.header.stamp_ns = -1;
  CdrWriter cdr;
  write(message, cdr);
  EXPECT_THAT(std::vector<u8>(cdr.bytes().begin() + 4, cdr.bytes().begin() + 12), testing::Each(0));
}

TEST(Ros2Messages, QuaternionsAreThePosesRotation) {
  const SampleMessages samples;
  const Pose& pose = samples.detections()[0].pose;
  CdrWriter cdr;
  write(PoseStamped{{0, "abc"}, pose}, cdr);
  std::array<double, 7> read = {};
  std::memcpy(read.data(), cdr.bytes().data() + 20, sizeof read);
  const Mat3 back = rotation_of({read[6], read[3], read[4], read[5]});
  for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(back[i], pose.R[i], 1e-15);
  EXPECT_NE(back, (Mat3{1, 0, 0, 0, 1, 0, 0, 0, 1}));
}

TEST(Ros2Messages, AHomographyTakesTheSquareToTheCorners) {
  const SampleMessages samples;
  const Detection& detection = samples.detections()[0];
  CdrWriter cdr;
  write(AprilTagDetectionArray{{0, ""}, {detection}}, cdr);
  // The last 17 doubles: four corners from the lower left on, nine of the homography.
  std::array<double, 17> read = {};
  std::memcpy(read.data(), cdr.bytes().data() + cdr.bytes().size() - sizeof read, sizeof read);
  const double* h = read.data() + 8;
  constexpr std::array<std::array<double, 2>, 4> kSquare = {{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& [x, y] = kSquare[i];
    const double w = h[6] * x + h[7] * y + h[8];
    EXPECT_NEAR((h[0] * x + h[1] * y + h[2]) / w, read[2 * i], 1e-9);
    EXPECT_NEAR((h[3] * x + h[4] * y + h[5]) / w, read[2 * i + 1], 1e-9);
    EXPECT_EQ(read[2 * i], detection.corners[(i + 1) % 4][0]);
  }
  EXPECT_EQ(h[8], 1);
}

TEST(Ros2Messages, AWriterThatHasHeldThemAllAllocatesNoMore) {
  const SampleMessages samples;
  CdrWriter cdr;
  const auto write_all = [&] { samples.each([&](const auto& message) { write(message, cdr); }); };
  write_all();
  const std::size_t before = test::allocations();
  write_all();
  EXPECT_EQ(test::allocations(), before);
}

TEST(Ros2Schemas, HoldEveryPartOnceAndNoOther) {
  EXPECT_EQ(schema_of("geometry_msgs/msg/PoseStamped"),
            "std_msgs/Header header\ngeometry_msgs/Pose pose\n" + std::string(80, '=') +
                "\nMSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n" +
                std::string(80, '=') + "\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" +
                std::string(80, '=') +
                "\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n" +
                std::string(80, '=') + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" +
                std::string(80, '=') + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
  const std::string tf = schema_of("tf2_msgs/msg/TFMessage");
  EXPECT_THAT(tf, HasSubstr("MSG: geometry_msgs/Vector3\n"));
  EXPECT_THAT(tf, Not(HasSubstr("MSG: geometry_msgs/Point\n")));
  EXPECT_EQ(message_types().size(), 9u);
  for (const std::string& type : message_types()) EXPECT_THAT(schema_of(type), HasSubstr("MSG: std_msgs/Header\n"));
  EXPECT_THAT(complaint([] { schema_of("geometry_msgs/msg/Twist"); }), HasSubstr("geometry_msgs/msg/Twist"));
}

TEST(Ros2Schemas, NamesForDds) {
  EXPECT_EQ(dds_name_of("geometry_msgs/msg/PoseWithCovarianceStamped"),
            "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_");
}

}  // namespace
}  // namespace berth::ros2
