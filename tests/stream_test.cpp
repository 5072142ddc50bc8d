// Whoever observes a stream gets each frame once, with the same results, whichever way the frames take.
#include "stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "berth/source.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"

namespace berth::cli {
namespace {

constexpr int kWidth = 280;
constexpr int kHeight = 210;

/// Simulated pictures with their truth, which tells the markers' sizes.
class Pictures final : public Source {
 public:
  explicit Pictures(int count) : count_(count) {}
  std::optional<SourceFrame> next() override {
    if (at_ == count_) return std::nullopt;
    const sim::Scene scene = sim::corpus_scene("easy", at_, kWidth, kHeight);
    SourceFrame frame;
    frame.image = sim::render(scene);
    frame.truth = sim::truth(scene);
    frame.label = "picture " + std::to_string(at_);
    frame.stamp.sequence = static_cast<u64>(at_++);
    return frame;
  }
  std::optional<CameraModel> camera() const override { return paper_camera(kWidth, kHeight); }

 private:
  int count_;
  int at_ = 0;
};

struct Seen {
  std::string label;
  u64 digest;
  std::vector<double> ranges_m;
  bool is_paced, has_camera;
  u8 last_pixel;
};

class Notes final : public FrameObserver {
 public:
  void begin(const ObservedStream& stream) override {
    EXPECT_EQ(stream.width, kWidth);
    EXPECT_TRUE(stream.config.camera.has_value());
    EXPECT_THAT(stream.backend, testing::StartsWith("simd on "));
    EXPECT_TRUE(seen.empty());
    ++begun;
  }
  void observe(const ObservedFrame& frame) override {
    Seen one{frame.label, frame.digest, {}, frame.paced != nullptr, frame.camera.has_value(), 0};
    one.last_pixel = frame.image.at(kWidth - 1, kHeight - 1);
    for (const Detection& d : frame.result.detections) one.ranges_m.push_back(d.has_pose ? d.pose.t[2] : 0);
    EXPECT_EQ(frame.mode, Mode::docking);
    seen.push_back(one);
  }
  void finish(std::ostream& people) override { people << "noted " << seen.size() << '\n'; }

  std::vector<Seen> seen;
  int begun = 0;
};

std::vector<Seen> observed(double fps, std::string& said, bool track = false) {
  Pictures source(4);
  const auto notes = std::make_shared<Notes>();
  StreamOptions options;
  options.engine.backend = "simd";
  options.pace.fps = fps;
  options.track = track;
  options.observers.push_back(notes);
  std::ostringstream out, err;
  Console console(out, err, false);
  run_stream(source, options, console);
  EXPECT_EQ(notes->begun, 1);
  said = out.str() + err.str();
  return notes->seen;
}

TEST(FrameObserver, SeesEachFrameOnceOnBothWays) {
  std::string said;
  const std::vector<Seen> plain = observed(0, said);
  ASSERT_EQ(plain.size(), 4u);
  EXPECT_THAT(said, testing::HasSubstr("noted 4\n"));
  const std::vector<Seen> paced = observed(20, said);
  ASSERT_FALSE(paced.empty());
  EXPECT_THAT(said, testing::HasSubstr("noted " + std::to_string(paced.size()) + "\n"));
  std::size_t ranges = 0;
  for (std::size_t i = 0, at = 0; i < paced.size(); ++i, ++at) {
    while (at < plain.size() && plain[at].label != paced[i].label) ++at;  // a busy machine may drop one
    ASSERT_LT(at, plain.size()) << paced[i].label;
    EXPECT_EQ(plain[at].digest, paced[i].digest);
    EXPECT_EQ(plain[at].ranges_m, paced[i].ranges_m);
    EXPECT_EQ(plain[at].last_pixel, paced[i].last_pixel);
    EXPECT_TRUE(plain[at].has_camera && paced[i].has_camera);
    EXPECT_TRUE(paced[i].is_paced && !plain[at].is_paced);
    ranges += paced[i].ranges_m.size();
  }
  EXPECT_GT(ranges, 0u);
}

TEST(Stream, SaysHowFramesWereSearchedOnBothWays) {
  for (const double fps : {0.0, 20.0}) {
    std::string said;
    const std::vector<Seen> seen = observed(fps, said, true);
    ASSERT_FALSE(seen.empty());
    EXPECT_THAT(said, testing::HasSubstr("whole: none_held"));
  }
}

}  // namespace
}  // namespace berth::cli
