#include "bench_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "berth/error.hpp"
#include "quantile.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "svg_panel.hpp"

namespace berth::cli {
namespace {

/// Joules that the processor's packages have used, by Linux' powercap counters (RAPL); none where there are none or
/// they may not be read. They wrap after hours or minutes: a negative difference is no measurement.
std::optional<double> joules_used() {
  namespace fs = std::filesystem;
  std::error_code error;
  std::optional<double> joules;
  for (fs::directory_iterator zone("/sys/class/powercap", error), end; !error && zone != end; zone.increment(error)) {
    const std::string name = zone->path().filename().string();
    // intel-rapl:0 is a package, intel-rapl:0:1 a part of it; AMD's driver has the same names.
    if (name.rfind("intel-rapl:", 0) != 0 || std::count(name.begin(), name.end(), ':') != 1) continue;
    double microjoules = 0;
    if (std::ifstream(zone->path() / "energy_uj") >> microjoules) joules = joules.value_or(0) + microjoules / 1e6;
  }
  return joules;
}

}  // namespace

std::vector<BenchFrame> dock_frames(int count, int width, int height) {
  std::vector<BenchFrame> frames;
  std::unique_ptr<sim::Renderer> renderer;
  for (int i = 0; i < count; ++i) {
    const sim::Scene scene = sim::corpus_scene("dock", i * sim::kCorpusFrames / count, width, height);
    if (!renderer) renderer = std::make_unique<sim::Renderer>(scene.camera);
    frames.push_back({"dock_" + std::to_string(i), renderer->render(scene)});
  }
  return frames;
}

FrameTimes time_frames(Engine& engine, const std::vector<BenchFrame>& frames, int repeat) {
  FrameTimes times;
  std::vector<double> processor, wall, device, decode, pose, all;
  for (const BenchFrame& frame : frames) engine.detect(frame.image.view(), {});
  const std::optional<double> joules = joules_used();
  for (const BenchFrame& frame : frames) {
    double best[5] = {1e9, 1e9, 1e9, 1e9, 1e9};
    for (int i = 0; i < repeat; ++i) {
      const TimedResult timed = engine.detect(frame.image.view(), {});
      if (timed.frame.status == FrameStatus::device_lost) throw Error(frame.name + ": the device was lost");
      const double now[5] = {ms_of(timed.cpu_ns), ms_of(timed.wall_ns), ms_of(timed.frame.times[0].ns),
                             ms_of(timed.frame.times[1].ns), ms_of(timed.frame.times[2].ns)};
      for (std::size_t k = 0; k < 5; ++k) best[k] = std::min(best[k], now[k]);
      all.push_back(now[1]);
      times.processor_s += now[0] / 1e3;
    }
    processor.push_back(best[0]);
    wall.push_back(best[1]);
    device.push_back(best[2]);
    decode.push_back(best[3]);
    pose.push_back(best[4]);
  }
  const std::optional<double> then = joules_used();
  if (joules && then && *then >= *joules) times.joules = (*then - *joules) / static_cast<double>(all.size());
  times.best = {quantile(processor, 0.5), quantile(wall, 0.5), quantile(device, 0.5), quantile(decode, 0.5),
                quantile(pose, 0.5)};
  times.latency = {quantile(all, 0.5), quantile(all, 0.99), quantile(all, 1)};
  return times;
}

BenchTable frame_table(const std::string& title, const std::vector<BackendTimes>& all) {
  BenchTable table;
  table.title = title;
  table.head = {"backend", "wall ms", "frames/s", "p50",   "p99", "most", "device",
                "decode",  "pose",    "cpu ms",   "cpu s", "J",   "on"};
  for (const BackendTimes& one : all) {
    const FrameTimes& t = one.times;
    const auto ms = [](double value) { return fmt::format("{:.3f}", value); };
    table.rows.push_back({one.backend, ms(t.best.wall), fmt::format("{:.0f}", 1e3 / t.best.wall), ms(t.latency.p50),
                          ms(t.latency.p99), ms(t.latency.most), ms(t.best.device), ms(t.best.decode), ms(t.best.pose),
                          ms(t.best.processor), fmt::format("{:.2f}", t.processor_s),
                          t.joules ? fmt::format("{:.4f}", *t.joules) : "not told here", one.device});
  }
  table.note =
      "wall, device, decode, pose, cpu: medians over frames of the best run; p50, p99, most: latency of all runs; cpu "
      "s: "
      "processor time of all runs; J: a frame, whole processor package.";
  return table;
}

Json to_json(const BackendTimes& one) {
  const FrameTimes& t = one.times;
  Json json = {{"backend", one.backend},
               {"device", one.device},
               {"driver", one.driver},
               {"wall_ms", t.best.wall},
               {"latency_p50_ms", t.latency.p50},
               {"latency_p99_ms", t.latency.p99},
               {"latency_most_ms", t.latency.most},
               {"device_ms", t.best.device},
               {"decode_ms", t.best.decode},
               {"pose_ms", t.best.pose},
               {"processor_ms", t.best.processor},
               {"processor_s", t.processor_s}};
  if (t.joules) json["joules"] = *t.joules;
  return json;
}

std::string frame_bars_svg(const std::string& title, const std::vector<BackendTimes>& all) {
  constexpr double kLeft = 110, kTop = 60, kRow = 34, kLong = 420;
  double most = 1e-9;
  for (const BackendTimes& one : all) most = std::max(most, one.times.best.wall);
  std::string svg = svg_head(680, kTop + kRow * static_cast<double>(all.size()) + 30, title);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double top = kTop + kRow * static_cast<double>(i);
    const double wall = all[i].times.best.wall;
    svg += fmt::format(
        "<text class='axis' x='{:.0f}' y='{:.0f}' text-anchor='end'>{}</text>"
        "<rect x='{:.0f}' y='{:.0f}' width='{:.1f}' height='20' fill='#2b6cb0'/>"
        "<text class='axis' x='{:.1f}' y='{:.0f}'>{:.2f} ms</text>\n",
        kLeft - 8, top + 15, svg_escaped(all[i].backend), kLeft, top, std::max(1.0, kLong * wall / most),
        kLeft + kLong * wall / most + 8, top + 15, wall);
  }
  return svg + "</svg>\n";
}

}  // namespace berth::cli
