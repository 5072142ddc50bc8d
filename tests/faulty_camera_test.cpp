// A camera with faults, read as cameras are: what it does is counted by its name, to the last frame.
#include "verify/faulty_camera.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "berth/error.hpp"
#include "camera/live_source.hpp"

namespace berth {
namespace {

constexpr int kWidth = 64, kHeight = 16;

std::vector<GrayImage> pictures() {
  std::vector<GrayImage> all;
  for (int i = 0; i < 5; ++i) {
    all.emplace_back(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) all.back().view().at(x, y) = static_cast<u8>(16 * i + y);
    }
  }
  return all;
}

FaultyFilmOptions options_of(std::vector<CameraFault> kinds, u64 seed = 1) {
  FaultyFilmOptions options;
  options.seed = seed;
  options.frames = 400;
  options.share = 1;
  options.kinds = std::move(kinds);
  return options;
}

/// All frames handed on until 200 were; complaints are passed over.
struct Handed {
  std::vector<FilmedFrame> frames;
  std::vector<FrameStamp> stamps;
  SourceHealth health;
};

Handed read(FaultyFilm& film, std::size_t frames = 200) {
  LiveOptions options;
  options.name = "film";
  options.buffers = 1;
  const auto source = open_live(options, film.opener());
  Handed handed;
  while (handed.frames.size() < frames) {
    try {
      const SourceFrame frame = *source->next();
      handed.frames.push_back(film.last());
      handed.stamps.push_back(frame.stamp);
      GrayImage drawn(frame.image.width(), frame.image.height());
      film.draw(film.last(), drawn.view());
      EXPECT_EQ(std::memcmp(drawn.view().row(3), frame.image.view().row(3), static_cast<std::size_t>(drawn.width())),
                0);
    } catch (const Error&) {
      // The camera is gone; it comes back.
    }
  }
  handed.health = source->health();
  return handed;
}

class EveryCameraFault : public testing::TestWithParam<CameraFault> {};

TEST_P(EveryCameraFault, IsCountedByItsName) {
  const CameraFault fault = GetParam();
  const bool is_slow = fault == CameraFault::gone || fault == CameraFault::resized;
  FaultyFilm film(pictures(), options_of({fault}));
  const Handed handed = read(film, is_slow ? 20 : 200);
  EXPECT_GE(film.begun()[static_cast<std::size_t>(fault)], is_slow ? 2U : 10U);
  const SourceHealth& expected = film.expected();
  EXPECT_EQ(handed.health.lost, expected.lost);
  EXPECT_EQ(handed.health.incomplete, expected.incomplete);
  EXPECT_EQ(handed.health.repeated, expected.repeated);
  EXPECT_EQ(handed.health.misdated, expected.misdated);
  EXPECT_EQ(handed.health.reopened, expected.reopened);
  const u64 counted = expected.lost + expected.incomplete + expected.repeated + expected.misdated + expected.reopened;
  const bool is_handed_on = fault == CameraFault::torn || fault == CameraFault::black || fault == CameraFault::white;
  EXPECT_EQ(counted > 0, !is_handed_on);
  for (std::size_t i = 1; i < handed.frames.size(); ++i) {
    const FilmedFrame &before = handed.frames[i - 1], &now = handed.frames[i];
    EXPECT_GT(now.number, before.number);
    EXPECT_EQ(handed.stamps[i].mid_exposure_ns, now.time_ns);
    if (now.clock == before.clock) {
      EXPECT_GT(now.time_ns, before.time_ns);
    }
    EXPECT_NE(now.noise, before.noise) << "the same picture twice";
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryCameraFault,
                         testing::Values(CameraFault::dropped, CameraFault::doubled, CameraFault::torn,
                                         CameraFault::half, CameraFault::frozen, CameraFault::back, CameraFault::ahead,
                                         CameraFault::set_back, CameraFault::gone, CameraFault::resized,
                                         CameraFault::black, CameraFault::white),
                         [](const auto& fault) {
                           std::string name = name_of(fault.param);
                           for (char& c : name) c = c == ' ' ? '_' : c;
                           return name;
                         });

TEST(FaultyCamera, ASeedRepeatsItsFaults) {
  const std::vector<CameraFault> kinds = {CameraFault::dropped, CameraFault::torn, CameraFault::half,
                                          CameraFault::frozen,  CameraFault::back, CameraFault::set_back};
  FaultyFilm first(pictures(), options_of(kinds, 7)), second(pictures(), options_of(kinds, 7));
  FaultyFilm other(pictures(), options_of(kinds, 8));
  const Handed a = read(first), b = read(second), c = read(other);
  std::size_t differing = 0;
  for (std::size_t i = 0; i < a.frames.size(); ++i) {
    EXPECT_EQ(a.frames[i].number, b.frames[i].number);
    EXPECT_EQ(a.frames[i].time_ns, b.frames[i].time_ns);
    EXPECT_EQ(a.frames[i].seam, b.frames[i].seam);
    differing += a.frames[i].number != c.frames[i].number ? 1 : 0;
  }
  EXPECT_GT(differing, 0U);
  EXPECT_EQ(first.begun(), second.begun());
}

}  // namespace
}  // namespace berth
