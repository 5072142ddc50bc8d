// How Berth's time grows with pixels, markers and clutter, and what the worst frames cost; libapriltag beside it. Times
// are processor ms a frame, the least of several runs, engines in turns.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>

#include "berth/error.hpp"
#include "clock.hpp"
#include "engines.hpp"
#include "run_main.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/pictures.hpp"
#include "svg_panel.hpp"

namespace berth::bench {
namespace {

struct Options {
  std::vector<std::string> engines = {"simd", "apriltag-d1-tuned"};
  std::string svg;
  int repeat = 7;
  bool quick = false;
};

struct Point {
  double at = 0;
  std::string name;
  std::vector<double> ms;  // an engine each
  std::vector<std::size_t> found;
};
struct Series {
  std::string title, across;
  std::vector<Point> points;
};

Point time_picture(double at, const std::string& name, View2D<const u8> image,
                   const std::vector<std::unique_ptr<Engine>>& engines, int repeat) {
  Point point{at, name, std::vector<double>(engines.size(), 1e9), {}};
  for (int round = 0; round <= repeat; ++round) {  // the first warms up
    for (std::size_t i = 0; i < engines.size(); ++i) {
      const double start = ms_on(CLOCK_PROCESS_CPUTIME_ID);
      engines[i]->run(image);
      if (round > 0) point.ms[i] = std::min(point.ms[i], ms_on(CLOCK_PROCESS_CPUTIME_ID) - start);
    }
  }
  for (const auto& engine : engines) point.found.push_back(engine->found().size());
  return point;
}

GrayImage corpus_image(const char* corpus, int index, int width, int height) {
  const sim::Scene scene = sim::corpus_scene(corpus, index, width, height);
  return sim::Renderer(scene.camera).render(scene);
}

/// The first `count` cells of a wall of 10 x 10 markers, 1 m away.
GrayImage marker_wall(int count) {
  constexpr int kWidth = 1280, kHeight = 960, kSide = 10;
  sim::Scene scene;
  scene.camera = paper_camera(kWidth, kHeight);
  scene.void_albedo = 0.6;
  const double step_x = 0.9 * kWidth / scene.camera.fx / kSide;
  const double step_y = 0.9 * kHeight / scene.camera.fy / kSide;
  for (int i = 0; i < count; ++i) {
    sim::SceneMarker marker;
    marker.id = i;
    marker.size_m = 0.6 * std::min(step_x, step_y);
    const int column = i % kSide, row = i / kSide;
    marker.pose.t = {(column - 4.5) * step_x, (row - 4.5) * step_y, 1};
    scene.markers.push_back(marker);
  }
  return sim::Renderer(scene.camera).render(scene);
}

std::vector<u8> all_levels() {
  std::vector<u8> levels;
  for (int level = 0; level < 256; ++level) levels.push_back(static_cast<u8>(level));
  return levels;
}

std::vector<Series> measure(const Options& options) {
  std::vector<std::unique_ptr<Engine>> engines;
  for (const std::string& name : options.engines) engines.push_back(make_engine(name, 1));
  const auto time = [&](double at, const std::string& name, const GrayImage& image) {
    return time_picture(at, name, image.view(), engines, options.repeat);
  };
  std::vector<Series> all;
  Series pixels{"Pixels: frame 50 of the simulated dock", "million pixels", {}};
  using Size = std::array<int, 2>;
  std::vector<Size> sizes = {{640, 480}, {1280, 720}, {1920, 1080}, {2560, 1440}, {3840, 2160}};
  if (options.quick) sizes.resize(2);
  for (const Size& size : sizes) {
    pixels.points.push_back(time(size[0] * size[1] / 1e6, fmt::format("{}×{}", size[0], size[1]),
                                 corpus_image("dock", 50, size[0], size[1])));
  }
  all.push_back(pixels);
  Series markers{"Markers: 1280×960, a wall of them", "markers", {}};
  for (const int count : {1, 10, 25, 50, 75, 100}) {
    markers.points.push_back(time(count, fmt::format("{} markers", count), marker_wall(count)));
  }
  all.push_back(markers);
  Series clutter{"Clutter: 640×480, dark squares without a code", "squares", {}};
  for (const int count : {0, 100, 200, 400, 600, 800}) {
    clutter.points.push_back(time(count, fmt::format("{} squares", count), pictures::hollow_squares(640, 480, count)));
  }
  all.push_back(clutter);
  Series worst{"Worst cases, 640×480", "case", {}};
  const std::pair<const char*, GrayImage> cases[] = {
      {"dock, frame 50", corpus_image("dock", 50, 640, 480)},
      {"hard, frame 50", corpus_image("hard", 50, 640, 480)},
      {"cluttered, frame 50", corpus_image("cluttered", 50, 640, 480)},
      {"noise, all levels", pictures::noise(640, 480, all_levels(), 1)},
      {"noise, two levels", pictures::noise(640, 480, {90, 160}, 2)},
      {"checkerboard of 1 px", pictures::checkerboard(640, 480, 1)},
      {"checkerboard of 4 px", pictures::checkerboard(640, 480, 4)},
      {"checkerboard of 8 px", pictures::checkerboard(640, 480, 8)},
      {"checkerboard of 10 px", pictures::checkerboard(640, 480, 10)},
      {"checkerboard of 16 px", pictures::checkerboard(640, 480, 16)},
      {"mazes", pictures::mazes(640, 480, 3)},
      {"800 squares without a code", pictures::hollow_squares(640, 480, 800)},
  };
  for (const auto& [name, image] : cases) {
    worst.points.push_back(time(static_cast<double>(worst.points.size()), name, image));
  }
  all.push_back(worst);
  return all;
}

void print(const Series& series, const Options& options) {
  fmt::print("\n**{}**\n\n| |", series.title);
  for (const std::string& engine : options.engines) fmt::print(" {} ms | times the first | found |", engine);
  fmt::print("\n|---|");
  for (std::size_t i = 0; i < options.engines.size(); ++i) fmt::print("---:|---:|---:|");
  fmt::print("\n");
  for (const Point& point : series.points) {
    fmt::print("| {} |", point.name);
    for (std::size_t i = 0; i < point.ms.size(); ++i) {
      fmt::print(" {:.3f} | {:.2f} | {} |", point.ms[i], point.ms[i] / series.points.front().ms[i], point.found[i]);
    }
    fmt::print("\n");
  }
  std::fflush(stdout);
}

/// A panel each for pixels, markers and clutter, of the first engine: its time over what grows.
std::string svg_of(const std::vector<Series>& all, const Options& options) {
  constexpr double kSide = 240, kApart = 330;
  std::string svg =
      cli::svg_head(3 * kApart + 40, 360, "Time of " + options.engines.front() + ", processor ms a frame");
  for (std::size_t i = 0; i < 3; ++i) {
    const Series& series = all[i];
    cli::SvgPanel panel(64 + kApart * static_cast<double>(i), 72, kSide,
                        cli::svg_escaped(series.title.substr(0, series.title.find(':'))), series.across, "ms");
    cli::SvgPoints points;
    double most = 0;
    for (const Point& point : series.points) {
      points.push_back({point.at, point.ms.front()});
      most = std::max(most, point.ms.front());
    }
    panel.fit(0, series.points.back().at * 1.05, 0, most * 1.1);
    svg += panel.frame(true) + cli::svg_polyline(panel, points, "#2b6cb0", 2);
    for (const auto& point : points) svg += cli::svg_dot(panel, point, "#2b6cb0", 3);
  }
  return svg + "</svg>\n";
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("How time grows with pixels, markers and clutter; the worst frames. Processor ms a frame, one thread.");
  app.add_option("--engines", options.engines, "as compare_apriltag's; the first is drawn")->delimiter(',');
  app.add_option("--repeat", options.repeat, "runs a picture; the best counts")->check(CLI::Range(1, 1000));
  app.add_option("--svg", options.svg, "a drawing of the first engine's growth");
  app.add_flag("--quick", options.quick, "no image above 1280 × 960");
  CLI11_PARSE(app, argc, argv);
  const std::vector<Series> all = measure(options);
  for (const Series& series : all) print(series, options);
  if (options.svg.empty()) return 0;
  std::ofstream file(options.svg);
  file << svg_of(all, options);
  if (!file.flush()) throw Error(options.svg + ": the drawing cannot be written; check the path");
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("growth", berth::bench::run, argc, argv); }
