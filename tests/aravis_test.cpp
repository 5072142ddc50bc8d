// GigE Vision cameras, by Aravis' fake one in a process of its own on 127.0.0.1: whole frames, lost packets, a camera
// that is killed and comes back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <map>
#include <optional>
#include <set>

#include "aravis/fake_gige_process.hpp"
#include "berth/detector.hpp"
#include "camera/image_file.hpp"
#include "camera/sources.hpp"
#include "support/complaint.hpp"
#include "support/image_digest.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

using test::complaint;
using test::FakeGigeProcess;
using test::image_digest;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kCamera = "aravis:127.0.0.1,width=640,height=480,packet_size=9000";

class OwnNetwork final : public testing::Environment {
 public:
  void SetUp() override { test::enter_own_network(); }
};
[[maybe_unused]] const testing::Environment* const kOwnNetwork = testing::AddGlobalTestEnvironment(new OwnNetwork);

class Aravis : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_.emplace();
    const auto approach = open_source("sim:" BERTH_SOURCE_DIR "/scenarios/approach.toml");
    for (char name = '0'; name < '6'; ++name) {
      const GrayImage image = approach->next()->image;
      std::string bytes = "P5\n640 480\n255\n";
      for (int y = 0; y < image.height(); ++y) {
        bytes.append(reinterpret_cast<const char*>(image.view().row(y)), static_cast<std::size_t>(image.width()));
      }
      folder_->write(std::string(1, name) + ".pgm", bytes);
      shown_.emplace(image_digest(image), std::string(1, name));
    }
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::vector<std::string> arguments(const std::string& lost = "0") {
    return {"dir:" + folder_->path(), "6", "lost=" + lost};
  }

  /// The image that the frame is, bit for bit; empty where it is none.
  static std::string name_of(const SourceFrame& frame) {
    const auto found = shown_.find(image_digest(frame.image));
    return found == shown_.end() ? "" : found->second;
  }

  static std::string refusal(const std::string& keys) {
    return complaint([&] { open_source("aravis:127.0.0.1" + keys); });
  }

  static inline std::optional<test::ScratchFolder> folder_;
  static inline std::map<u64, std::string> shown_;
};

TEST(AravisOptions, ReadsEveryKey) {
  const AravisOptions options = parse_aravis(
      "GV77,width=640,height=480,x=8,y=4,fps=59.94,format=Mono12p,exposure_us=2000,gain=1.5,packet_size=8000,buffers=3,"
      "retention_ms=6.5,resend=off,packet_socket=on,time=ptp,watchdog_ms=250");
  EXPECT_EQ(options.name, "GV77");
  EXPECT_EQ(options.width, 640);
  EXPECT_EQ(options.height, 480);
  EXPECT_EQ(options.x, 8);
  EXPECT_EQ(options.y, 4);
  EXPECT_EQ(options.fps, 59.94);
  EXPECT_EQ(options.format, "Mono12p");
  EXPECT_EQ(options.exposure_us, 2000);
  EXPECT_EQ(options.gain, 1.5);
  EXPECT_EQ(options.packet_size, 8000);
  EXPECT_EQ(options.buffers, 3);
  EXPECT_EQ(options.retention_ms, 6.5);
  EXPECT_FALSE(options.resend);
  EXPECT_TRUE(options.packet_socket);
  EXPECT_FALSE(parse_aravis("GV77").packet_socket);
  EXPECT_EQ(options.time, AravisOptions::Time::ptp);
  EXPECT_EQ(options.watchdog_ms, 250);
  EXPECT_FALSE(options.chunk_time);
  EXPECT_TRUE(parse_aravis("GV77,timestamp=chunk,time=ptp").chunk_time);
  EXPECT_EQ(parse_aravis("GV77,trigger=Line1").trigger, "Line1");
}

TEST(AravisOptions, SaysWhatIsWrongWithAKey) {
  const auto message = [](const std::string& text) { return complaint([&] { parse_aravis(text); }); };
  EXPECT_THAT(message(""), HasSubstr("serial number"));
  EXPECT_THAT(message("GV77,width=640"), AllOf(HasSubstr("height"), HasSubstr("missing")));
  EXPECT_THAT(message("GV77,x=8"), AllOf(HasSubstr("aravis:…,x"), HasSubstr("width and height")));
  EXPECT_THAT(message("GV77,gain=high"), AllOf(HasSubstr("gain"), HasSubstr("'high'"), HasSubstr("from 0 to")));
  EXPECT_THAT(message("GV77,format=RAW"), AllOf(HasSubstr("'RAW'"), HasSubstr("Mono8"), HasSubstr("BayerRG8")));
  EXPECT_THAT(message("GV77,trigger=Software"), HasSubstr("Line1"));
  EXPECT_THAT(message("GV77,trigger=Line1,fps=30"), AllOf(HasSubstr("fps"), HasSubstr("trigger")));
  EXPECT_THAT(message("GV77,resend=maybe"), HasSubstr("on or off"));
  EXPECT_THAT(message("GV77,time=gps"), HasSubstr("host, camera or ptp"));
  EXPECT_THAT(message("GV77,timestamp=trailer"), HasSubstr("leader or chunk"));
  EXPECT_THAT(message("GV77,timestamp=chunk"), AllOf(HasSubstr("'chunk'"), HasSubstr("time=camera or time=ptp")));
  EXPECT_THAT(message("GV77,speed=2"), AllOf(HasSubstr("speed"), HasSubstr("retention_ms")));
}

TEST_F(Aravis, GivesTheFramesOfAnApproachWhole) {
  const FakeGigeProcess camera(arguments());
  const auto source = open_source("aravis:GV77,width=640,height=480,packet_size=9000,fps=100,exposure_us=2000,gain=1");
  const auto backend = open_backend("simd");
  DetectorConfig config;
  config.digests = true;
  Detector detector(*backend, 640, 480, config);
  FrameStamp last;
  for (u64 i = 0; i < 12; ++i) {
    const SourceFrame frame = *source->next();
    const std::string name = name_of(frame);
    ASSERT_NE(name, "") << "not one of the images shown";
    EXPECT_EQ(frame.label, "aravis:GV77#" + std::to_string(i));
    EXPECT_EQ(frame.stamp.sequence, i);
    EXPECT_STREQ(frame.stamp.clock, "monotonic");
    EXPECT_EQ(frame.stamp.mid_exposure_ns - frame.stamp.exposure_start_ns, 1'000'000);
    EXPECT_GE(frame.stamp.arrival_ns, frame.stamp.exposure_start_ns + 2'000'000);
    EXPECT_GT(frame.stamp.mid_exposure_ns, last.mid_exposure_ns);
    last = frame.stamp;

    const FrameResult received = detector.detect(frame.image.view());
    const FrameResult direct = detector.detect(read_gray_image(*folder_ / (name + ".pgm")).view());
    EXPECT_FALSE(received.detections.empty());
    ASSERT_EQ(received.digests.size(), direct.digests.size());
    for (std::size_t stage = 0; stage < direct.digests.size(); ++stage) {
      EXPECT_EQ(received.digests[stage].digest, direct.digests[stage].digest) << direct.digests[stage].stage;
    }
  }
}

TEST_F(Aravis, CountsFramesWithLostPacketsAndHandsOnNone) {
  // 35 packets a frame: one in two comes whole.
  const FakeGigeProcess camera(arguments("0.02"));
  const auto source = open_source(kCamera + ",fps=200,retention_ms=5,resend=off");
  for (int i = 0; i < 20; ++i) ASSERT_NE(name_of(*source->next()), "");
  EXPECT_GT(source->health().incomplete, 0U);
}

TEST_F(Aravis, OpensACameraAgainThatWasKilled) {
  std::optional<FakeGigeProcess> camera(arguments());
  const auto source = open_source(kCamera + ",fps=100,watchdog_ms=300");
  for (int i = 0; i < 3; ++i) ASSERT_NE(name_of(*source->next()), "");
  camera.reset();
  const auto next_complaint = [&] {
    for (;;) {
      std::string text = complaint([&] { source->next(); });
      if (!text.empty()) return text;
    }
  };
  EXPECT_THAT(next_complaint(), AllOf(StartsWith("aravis:127.0.0.1: "), HasSubstr("no whole frame for 300 ms")));
  EXPECT_THAT(next_complaint(), HasSubstr("does not answer at 127.0.0.1"));
  camera.emplace(arguments());
  const auto returned = std::chrono::steady_clock::now();
  std::optional<SourceFrame> frame;
  while (!frame) complaint([&] { frame = source->next(); });
  const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - returned;
  RecordProperty("ms_from_return_to_frame", std::to_string(took.count()));
  EXPECT_NE(name_of(*frame), "");
  EXPECT_GE(frame->stamp.sequence, 3U) << "goes on counting";
  EXPECT_EQ(source->health().reopened, 1U);
}

TEST_F(Aravis, SaysWhatTheCameraDoesNotDo) {
  const FakeGigeProcess camera(arguments());
  EXPECT_THAT(refusal(",format=Mono12"), AllOf(HasSubstr("no pixel format Mono12"), HasSubstr("Mono8")));
  EXPECT_THAT(refusal(",gain=500"), AllOf(HasSubstr("gain from"), HasSubstr("500")));
  EXPECT_THAT(refusal(",trigger=Line9"), HasSubstr("trigger=Line9"));
  EXPECT_THAT(refusal(",time=ptp"), HasSubstr("no PTP"));
}

TEST_F(Aravis, WaitsForATrigger) {
  const FakeGigeProcess camera(arguments());
  const auto source = open_source(kCamera + ",trigger=Line0,watchdog_ms=100");
  EXPECT_THAT(complaint([&] { source->next(); }), HasSubstr("no whole frame for 100 ms"));
}

TEST_F(Aravis, TakesTimesFromTheCamera) {
  // What a camera with PTP has, where the fake one has memory; enabled, it is slave.
  const std::string nodes = folder_->write("ptp", std::string(R"(
    <Boolean Name="PtpEnable"><pValue>Ptp</pValue><OnValue>1</OnValue><OffValue>0</OffValue></Boolean>
    <Enumeration Name="PtpStatus">
      <EnumEntry Name="Disabled"><Value>0</Value></EnumEntry><EnumEntry Name="Slave"><Value>1</Value></EnumEntry>
      <pValue>Ptp</pValue>
    </Enumeration>
    <IntReg Name="Ptp">
      <Address>0x1f4</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>
      <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>
    </IntReg>)"));
  std::vector<std::string> with_nodes = arguments();
  with_nodes.push_back("nodes=" + nodes);
  const FakeGigeProcess camera(with_nodes);
  for (const char* clock : {"ptp", "camera"}) {
    const auto source = open_source((kCamera + ",exposure_us=4000,time=").append(clock));
    const SourceFrame frame = *source->next();
    EXPECT_STREQ(frame.stamp.clock, clock);
    EXPECT_GT(frame.stamp.exposure_start_ns, 0);
    EXPECT_EQ(frame.stamp.mid_exposure_ns - frame.stamp.exposure_start_ns, 2'000'000);
  }
}

TEST_F(Aravis, TakesTimesFromChunkData) {
  std::vector<std::string> with_chunks = arguments();
  const std::string sent = *folder_ / "sent";
  with_chunks.push_back("chunks=4");
  with_chunks.push_back("sent=" + sent);
  const FakeGigeProcess camera(with_chunks);
  {
    const auto source = open_source(kCamera + ",fps=50,exposure_us=4000,time=camera,timestamp=chunk");
    std::vector<std::int64_t> times;
    for (int i = 0; i < 8; ++i) {
      const SourceFrame frame = *source->next();
      EXPECT_NE(name_of(frame), "") << "not one of the images shown";
      EXPECT_STREQ(frame.stamp.clock, "camera");
      EXPECT_EQ(frame.stamp.mid_exposure_ns - frame.stamp.exposure_start_ns, 2'000'000);
      times.push_back(frame.stamp.exposure_start_ns);
    }
    // Those that came without one are none.
    EXPECT_GE(source->health().incomplete, 2U);
    // The chunk's, in ticks of 8 ns, is 3 ms before the leader's.
    std::set<std::int64_t> of_chunks;
    std::ifstream file(sent);
    for (std::int64_t time = 0; file >> time;) of_chunks.insert((time - 3'000'000) / 8 * 8);
    for (const std::int64_t time : times) EXPECT_EQ(of_chunks.count(time), 1U) << time;
  }
  // The same camera without: a fourth of the frames has no chunk, and all of them come, but for what a busy machine
  // loses.
  const auto source = open_source(kCamera + ",fps=50,timestamp=leader");
  for (int i = 0; i < 24; ++i) ASSERT_NE(name_of(*source->next()), "");
  EXPECT_LT(source->health().incomplete, 4U);
}

TEST_F(Aravis, SaysWhatChunkDataTheCameraHas) {
  {
    const FakeGigeProcess camera(arguments());
    EXPECT_THAT(refusal(",time=camera,timestamp=chunk"),
                AllOf(HasSubstr("sends no chunk data"), HasSubstr("leave timestamp=chunk out")));
  }
  const std::string nodes = folder_->write("gain", std::string(R"(
    <Boolean Name="ChunkModeActive"><Value>0</Value></Boolean>
    <Enumeration Name="ChunkSelector"><EnumEntry Name="Gain"><Value>1</Value></EnumEntry><Value>1</Value></Enumeration>)"));
  std::vector<std::string> with_nodes = arguments();
  with_nodes.push_back("nodes=" + nodes);
  const FakeGigeProcess camera(with_nodes);
  EXPECT_THAT(refusal(",time=camera,timestamp=chunk"), HasSubstr("the camera has no chunk Timestamp; it has Gain;"));
}

TEST(AravisWithoutACamera, SaysSo) {
  EXPECT_THAT(complaint([] { open_source("aravis:127.0.0.1"); }),
              AllOf(StartsWith("aravis:127.0.0.1: the camera cannot be opened"), HasSubstr("berth doctor")));
}

}  // namespace
}  // namespace berth
