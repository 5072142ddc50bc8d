#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench_tables.hpp"
#include "berth/image.hpp"
#include "engine.hpp"
#include "frame_json.hpp"

namespace berth::cli {

struct BenchFrame {
  std::string name;
  GrayImage image;
};

/// Frames of the simulated dock, spread over the whole approach.
std::vector<BenchFrame> dock_frames(int count, int width, int height);

/// What frames took. `best` are medians over frames of the least of several runs of each; the latency is of all runs.
struct FrameTimes {
  struct {
    double processor = 0, wall = 0, device = 0, decode = 0, pose = 0;
  } best;  // ms
  struct {
    double p50 = 0, p99 = 0, most = 0;
  } latency;                     // ms
  double processor_s = 0;        // of all runs
  std::optional<double> joules;  // a frame, of the whole processor package; none where the machine does not tell
};
FrameTimes time_frames(Engine& engine, const std::vector<BenchFrame>& frames, int repeat);

/// A row for each backend.
struct BackendTimes {
  std::string backend, device, driver;
  FrameTimes times;
};
BenchTable frame_table(const std::string& title, const std::vector<BackendTimes>& all);
Json to_json(const BackendTimes& one);
/// Horizontal bars: a frame's wall time on each backend, as SVG.
std::string frame_bars_svg(const std::string& title, const std::vector<BackendTimes>& all);

}  // namespace berth::cli
