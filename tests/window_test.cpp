// A window shows what the whole frame shows there, bit for bit, and nothing else.
#include "frame/window.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "berth/lockstep.hpp"
#include "frame/frame_levels.hpp"
#include "frame/search_area.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/complaint.hpp"
#include "support/frame_set.hpp"
#include "support/pictures.hpp"
#include "support/same_detection.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const std::vector<int> kSides = {64, 80, 96, 128, 176, 224, 320, 448};

/// Detectors of the whole frame and of windows in it, on one backend.
struct Pair {
  Pair(Backend& backend, int width, int height, DetectorConfig config) : whole(backend, width, height, config) {
    for (const int side : kSides) {
      if (side <= std::min(width, height)) config.window_sides.insert(config.window_sides.end(), 2, side);
    }
    sides = config.window_sides;
    windowed.emplace(backend, width, height, config);
  }

  Detector whole;
  std::vector<int> sides;
  std::optional<Detector> windowed;
};

int on_step(int v, int most) { return std::max(0, std::min(v, most)) / kWindowStep * kWindowStep; }

struct Tally {
  int windows = 0, found = 0, inside = 0;
};

/// Compares what windows show with what the frame has: nothing else, and all that is well inside.
void compare(const std::vector<Detection>& all, const std::vector<Detection>& seen,
             const std::vector<SearchWindow>& windows, const std::string& what, Tally& tally) {
  tally.windows += static_cast<int>(windows.size());
  for (const Detection& detection : seen) {
    ++tally.found;
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const Detection& d) { return test::same_bits(d, detection); }))
        << what << ": id " << detection.id << " is not the frame's";
  }
  for (const Detection& detection : all) {
    const auto looks_for = [&](const SearchWindow& w) {
      return !w.full_resolution_only || (detection.search == 0 && detection.hamming == 0);
    };
    const auto shows = [&](const SearchWindow& w) {
      return looks_for(w) && is_well_inside(box_of(detection.corners), w);
    };
    // What the photometric fit or the lens moved may have been on the other side of the rim by a hair.
    const auto surely_shows = [&](const SearchWindow& w) {
      Box box = box_of(detection.corners);
      box = {box.left - 2, box.top - 2, box.right + 2, box.bottom + 2};
      return looks_for(w) && is_well_inside(box, w);
    };
    if (!std::any_of(windows.begin(), windows.end(), shows)) continue;
    const bool found =
        std::any_of(seen.begin(), seen.end(), [&](const Detection& d) { return test::same_bits(d, detection); });
    if (std::any_of(windows.begin(), windows.end(), surely_shows)) {
      ++tally.inside;
      EXPECT_TRUE(found) << what << ": id " << detection.id << " is well inside, and not found";
    }
  }
}

/// Windows of every side around every marker, at random offsets from in the middle to cutting it.
void look_around(Pair& pair, View2D<const u8> image, int windows_each, u64 seed, const std::string& what,
                 Tally& tally) {
  const FrameResult whole = pair.whole.detect(image);
  pictures::Random random(seed);
  std::vector<std::array<double, 2>> places;
  for (const Detection& detection : whole.detections) places.push_back(detection.center);
  places.push_back({random.below(image.width) * 1.0, random.below(image.height) * 1.0});
  for (const auto& place : places) {
    for (const int side : std::set<int>(pair.sides.begin(), pair.sides.end())) {
      for (int k = 0; k < windows_each; ++k) {
        std::vector<SearchWindow> windows;
        for (int i = 0; i < 1 + k % 2; ++i) {
          windows.push_back({side, on_step(static_cast<int>(place[0]) - random.below(side), image.width - side),
                             on_step(static_cast<int>(place[1]) - random.below(side), image.height - side),
                             random.below(2) == 1});
        }
        const FrameResult& seen = pair.windowed->detect(image, {}, windows);
        if (seen.status == FrameStatus::overflow) continue;
        compare(whole.detections, seen.detections, windows, what + " side " + std::to_string(side), tally);
        if (::testing::Test::HasFailure()) return;
      }
    }
  }
}

DetectorConfig config_for(const sim::Scene& scene, CornerMethod corners = CornerMethod::edges) {
  DetectorConfig config;
  config.camera = scene.camera;
  config.marker_size_m = 0.1;
  config.corner_method = corners;
  return config;
}

TEST(Window, ShowsWhatTheFrameShowsOfTheCorpora) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Tally tally;
  for (const std::string& name : sim::corpus_names()) {
    std::unique_ptr<Pair> pair;
    for (int i = 0; i < 2; ++i) {
      const sim::Scene scene = sim::corpus_scene(name, 7 * i + 1, 480, 360);
      if (!pair) pair = std::make_unique<Pair>(*backend, 480, 360, config_for(scene));
      look_around(*pair, sim::render(scene).view(), 4, static_cast<u64>(i), name + " " + std::to_string(i), tally);
    }
  }
  EXPECT_GT(tally.inside, 300);
  EXPECT_GT(tally.windows, 2 * tally.inside) << "as many should cut their marker";
}

TEST(Window, PhotometricCornersAreTheFramesToo) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Tally tally;
  const sim::Scene scene = sim::corpus_scene("dock", 60, 480, 360);
  Pair pair(*backend, 480, 360, config_for(scene, CornerMethod::photometric));
  look_around(pair, sim::render(scene).view(), 4, 5, "dock", tally);
  EXPECT_GT(tally.inside, 5);
}

TEST(Window, EveryBackendShowsTheSame) {
  const sim::Scene scenes[] = {sim::corpus_scene("easy", 1, 400, 300), sim::corpus_scene("motion", 1, 400, 300)};
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty() || status.name == "simd") continue;
    const std::unique_ptr<Backend> backend = open_backend(status.name);
    DetectorConfig config = config_for(scenes[0]);
    Detector whole(*backend, 400, 300, config);
    config.window_sides = {208, 224, 224};
    Detector windowed(*backend, 400, 300, config);
    Tally tally;
    for (const sim::Scene& scene : scenes) {
      const GrayImage image = sim::render(scene);
      const FrameResult all = whole.detect(image.view());
      for (const Detection& marker : all.detections) {
        for (const int side : {208, 224}) {
          for (const int off : {0, 24, 64}) {
            std::vector<SearchWindow> windows;
            for (int i = 0; i < (side == 224 ? 2 : 1); ++i) {
              windows.push_back({side,
                                 on_step(static_cast<int>(marker.center[0]) - side / 2 + off * (1 - 2 * i), 400 - side),
                                 on_step(static_cast<int>(marker.center[1]) - side / 2, 300 - side), off == 24});
            }
            compare(all.detections, windowed.detect(image.view(), {}, windows).detections, windows, status.name, tally);
          }
        }
      }
    }
    EXPECT_GT(tally.inside, 2) << status.name;
  }
}

/// A marker that a window's border comes up to and passes, in steps of 8 px: the frame's bits, or nothing.
TEST(Window, TheBorderPassesAMarker) {
  const sim::Scene scene = sim::corpus_scene("easy", 1, 480, 360);
  const GrayImage image = sim::render(scene);
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Pair pair(*backend, 480, 360, config_for(scene));
  const FrameResult whole = pair.whole.detect(image.view());
  ASSERT_EQ(whole.detections.size(), 1u);
  const auto& center = whole.detections[0].center;
  bool was_found = false, was_missed = false;
  for (const bool sideways : {true, false}) {
    for (const int side : {176, 224, 320}) {
      for (int shift = -side; shift <= side; shift += kWindowStep) {
        const int x = static_cast<int>(center[0]) - side / 2 + (sideways ? shift : 0);
        const int y = static_cast<int>(center[1]) - side / 2 + (sideways ? 0 : shift);
        const std::vector<SearchWindow> windows = {
            {side, on_step(x, 480 - side), on_step(y, 360 - side), shift % 16 != 0}};
        const FrameResult& seen = pair.windowed->detect(image.view(), {}, windows);
        ASSERT_LE(seen.detections.size(), 1u);
        for (const Detection& found : seen.detections) EXPECT_TRUE(test::same_bits(found, whole.detections[0]));
        const bool inside = is_well_inside(box_of(whole.detections[0].corners), windows[0]);
        EXPECT_EQ(seen.detections.size(), inside ? 1u : 0u) << side << " px, shift " << shift;
        was_found = was_found || !seen.detections.empty();
        was_missed = was_missed || seen.detections.empty();
      }
    }
  }
  EXPECT_TRUE(was_found && was_missed);
}

struct Candidates {
  std::vector<std::array<s32, QUAD_WORDS>> of_search[3];
};

/// The quadrilaterals of an area that the device found, in the frame's own numbers.
Candidates candidates_of(SearchArea& area) {
  Candidates found;
  for (std::size_t k = 0; k < 3; ++k) {
    const MarkerSearch& search = area.plan.searches()[k];
    const s32* quads = static_cast<const s32*>(search.quads->host());
    for (int i = 0; i < area.searches[k].slots(); ++i, quads += QUAD_WORDS) {
      if ((quads[0] & QUAD_VALID) == 0) continue;
      std::array<s32, QUAD_WORDS> words{};
      std::copy(quads, quads + QUAD_WORDS, words.begin());
      for (std::size_t side = QUAD_SIDE; side < QUAD_WORDS; side += QUAD_SIDE_WORDS) {
        const bool upright = words[side] % 2 == 0;
        const int u = 2 * (upright ? area.place.y : area.place.x) / search.scale;
        const int v = 512 * (upright ? area.place.x : area.place.y) / search.scale;
        words[side] += 2 * u;
        words[side + 1] += v;
        words[side + 3] += u;
        words[side + 4] += u;
      }
      found.of_search[k].push_back(words);
    }
  }
  return found;
}

/// Clutter cut by a window's border makes no quadrilateral: each is one that the same search finds in the frame.
TEST(Window, HasNoQuadrilateralOfItsOwn) {
  constexpr int kWidth = 330, kHeight = 250;
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const std::unique_ptr<Stream> stream = backend->make_stream();
  DetectorConfig config;
  config.families = {"tag36h11", "tagStandard41h12"};  // outlines and holes
  config.capacities.run_ends = 1 << 16;                // so that no list overflows
  SearchArea whole(MarkerPlan(*backend, kWidth, kHeight, config));
  FrameLevels levels(whole.plan.geometry(), whole.plan.searches()[1].geometry, {});
  std::vector<GrayImage> images = {pictures::checkerboard(kWidth, kHeight, 13),
                                   pictures::checkerboard(kWidth, kHeight, 30), pictures::mazes(kWidth, kHeight, 3),
                                   pictures::mazes(kWidth, kHeight, 8)};
  for (u64 seed = 1; seed < 7; ++seed) images.push_back(pictures::quads(kWidth, kHeight, 40, 6, seed));
  pictures::Random random(9);
  std::size_t all = 0, in_windows = 0;
  for (const GrayImage& image : images) {
    pad_frame(image.view(), whole.plan.geometry(), whole.pixels());
    whole.enqueue(*stream);
    levels.measure(image.view());
    const Candidates frame = candidates_of(whole);
    for (const int side : {64, 112, 160, 240}) {
      SearchArea window(MarkerPlan::of_window(*backend, side, config));
      window.place.side = side;
      for (int k = 0; k < 12; ++k) {
        window.place.x = on_step(random.below(kWidth - side), kWidth - side);
        window.place.y = on_step(random.below(kHeight - side), kHeight - side);
        window.enqueue_window(image.view(), levels, *stream);
        const Candidates seen = candidates_of(window);
        for (std::size_t search = 0; search < 3; ++search) {
          all += frame.of_search[search].size();
          in_windows += seen.of_search[search].size();
          for (const auto& quad : seen.of_search[search]) {
            EXPECT_THAT(frame.of_search[search], ::testing::Contains(quad)) << side << " px, search " << search;
          }
        }
      }
    }
  }
  EXPECT_GT(in_windows, 300u);
  EXPECT_LT(in_windows, all);
}

/// The contrast that the host finds is the one that the device writes.
TEST(Window, LevelsAreTheFrames) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const std::unique_ptr<Stream> stream = backend->make_stream();
  std::vector<pictures::Frame> frames = pictures::frame_set();
  for (const std::string& name : sim::corpus_names()) {
    frames.push_back({name, sim::render(sim::corpus_scene(name, 4, 325, 243)), {}});
  }
  for (const u8 spread : {u8{3}, u8{9}, u8{14}, u8{30}}) {  // noise that decides the contrast
    frames.push_back({"noise", pictures::noise(333, 130, {100, static_cast<u8>(100 + spread)}, spread), {}});
  }
  for (const pictures::Frame& frame : frames) {
    for (const bool is_flat : {false, true}) {
      DetectorConfig config = frame.config;
      if (is_flat) {
        config.flat_field.clear();
        pictures::Random random(3);
        const int pixels = frame.image.width() * frame.image.height();
        for (int i = 0; i < pixels; ++i) config.flat_field.push_back(0.5F + static_cast<float>(random.below(100)) / 80);
      }
      SearchArea whole(MarkerPlan(*backend, frame.image.width(), frame.image.height(), config));
      const MarkerGeometry& g = whole.plan.geometry();
      FrameLevels levels(g, whole.plan.searches()[1].geometry,
                         config.flat_field.empty() ? std::vector<u32>() : pack_gains(config.flat_field, g));
      pad_frame(frame.image.view(), g, whole.pixels());
      whole.enqueue(*stream);
      levels.measure(frame.image.view());
      for (std::size_t scale = 0; scale < 2; ++scale) {
        EXPECT_EQ(levels.levels(scale)[3], static_cast<const u32*>(whole.plan.levels(scale).host())[3])
            << frame.name << " scale " << scale;
      }
    }
  }
}

TEST(Window, AFlatFieldIsTheFrames) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const sim::Scene scene = sim::corpus_scene("easy", 1, 400, 300);
  DetectorConfig config = config_for(scene);
  for (int i = 0; i < 400 * 300; ++i) config.flat_field.push_back(0.8F + static_cast<float>(i % 400) / 1000.0F);
  Pair pair(*backend, 400, 300, config);
  Tally tally;
  look_around(pair, sim::render(scene).view(), 8, 5, "flat field", tally);
  EXPECT_GT(tally.inside, 1);
}

TEST(Window, PhotographsWhereThereAreSome) {
  const char* const from_environment = std::getenv("BERTH_SHARED_DATA");
  const std::filesystem::path folder =
      std::filesystem::path(from_environment != nullptr ? from_environment : BERTH_SHARED_DATA_DEFAULT) / "apriltag";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is not there";
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".jpg" || entry.path().extension() == ".png") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Tally tally;
  for (std::size_t i = 0; i < paths.size(); i += 4) {
    const cv::Mat picture = cv::imread(paths[i].string(), cv::IMREAD_GRAYSCALE);
    if (picture.empty() || std::min(picture.cols, picture.rows) < 64) continue;
    Pair pair(*backend, picture.cols, picture.rows, {});
    look_around(pair, {picture.data, picture.cols, picture.rows, static_cast<int>(picture.step)}, 2, i,
                paths[i].filename().string(), tally);
  }
  EXPECT_GT(tally.inside, 0);
}

TEST(Window, LockstepComparesTheWindows) {
  const std::unique_ptr<Backend> simd = open_backend("simd"), cpu = open_backend("cpu");
  const GrayImage image = sim::render(sim::corpus_scene("easy", 3, 320, 240));
  DetectorConfig config;
  config.window_sides = {192};
  config.digests = true;
  Lockstep both(*simd, *cpu, 320, 240, config);
  const FrameResult& result = both.detect(image.view(), {}, {{192, 64, 24}});
  EXPECT_FALSE(both.difference());
  ASSERT_FALSE(result.digests.empty());
  EXPECT_EQ(result.digests[0].stage, "window0_tile_minima");
}

TEST(Window, RefusesWhatItCannotDo) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const GrayImage image = pictures::uniform(320, 240, 90);
  for (const int side : {48, 100, 256}) {
    DetectorConfig bad;
    bad.window_sides = {side};
    EXPECT_THAT([&] { Detector(*backend, 320, 240, bad); }, ThrowsMessage<Error>(HasSubstr("window side")));
  }
  DetectorConfig config;
  config.window_sides = {96, 64};
  Detector detector(*backend, 320, 240, config);
  const auto refusal = [&](const std::vector<SearchWindow>& windows) {
    return test::complaint([&] { detector.detect(image.view(), {}, windows); });
  };
  EXPECT_THAT(refusal({{96, 4, 0}}), HasSubstr("multiples of 8"));
  EXPECT_THAT(refusal({{96, 232, 0}}), HasSubstr("in the frame of 320x240"));
  // Multiples of 8 whose sums with the side are beyond the greatest int.
  EXPECT_THAT(refusal({{96, 2147483640, 0}}), HasSubstr("in the frame of 320x240"));
  EXPECT_THAT(refusal({{96, 0, 2147483640}}), HasSubstr("in the frame of 320x240"));
  EXPECT_THAT(refusal({{2147483647, 8, 8}}), HasSubstr("in the frame of 320x240"));
  EXPECT_THAT(refusal({{80, 0, 0}}), HasSubstr("window_sides"));
  EXPECT_THAT(refusal({{96, 0, 0}, {96, 8, 8}}), HasSubstr("window_sides"));
  EXPECT_EQ(refusal({{96, 224, 144}, {64, 0, 0}}), "");
}

}  // namespace
}  // namespace berth
