// The virtual six-axis table: its stops, its statistics, and that every method on it measures what it should.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/geometry.hpp"
#include "support/command_run.hpp"
#include "support/scratch_folder.hpp"
#include "table_report.hpp"

namespace berth {
namespace {

using testing::HasSubstr;

constexpr double kDegree = sim::kPi / 180;

TEST(TableErrors, AreThoseOfKnownPoses) {
  Pose truth = sim::translation(0.1, -0.2, 2);
  truth.R = sim::rotation(0.3, -0.4, 0.5);
  Pose found = truth;
  found.t = {0.11, -0.23, 2.07};
  found.R = sim::product(sim::rotation_y(-0.9), truth.R);
  const table::SixAxes error = table::pose_error(found, truth);
  const table::SixAxes expected = {0.01, -0.03, 0.07, 0, -0.9, 0};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(error[i], expected[i], 1e-12) << i;
  for (const double e : table::pose_error(truth, truth)) EXPECT_NEAR(e, 0, 1e-15);
}

TEST(TableErrors, HaveTheTextbooksStatistics) {
  table::ErrorSum sum;
  EXPECT_EQ(sum.rms(), 0);
  for (const double e : {1.0, -3.0, 2.0, 4.0}) sum.add(e);
  EXPECT_EQ(sum.count(), 4);
  EXPECT_NEAR(sum.mean(), 1, 1e-12);
  EXPECT_NEAR(sum.rms(), std::sqrt(30.0 / 4), 1e-12);
  EXPECT_NEAR(sum.deviation(), std::sqrt(26.0 / 3), 1e-12);
  EXPECT_EQ(sum.largest(), 4);

  table::SweepErrors errors;
  const Pose truth = sim::translation(0.6, 0, 0.8);  // 1 m away
  errors.add(sim::translation(0.6, 0, 0.805), truth);
  errors.add(sim::translation(0.603, 0.004, 0.8), truth);
  EXPECT_NEAR(errors.shares[2].largest(), 0.005, 1e-12);
  EXPECT_NEAR(errors.position_share.rms(), 0.005, 1e-12);
}

TEST(TableSweeps, MoveOneAxisFromEndToEnd) {
  const table::Nominal nominal{0.05, 0.7};
  const std::vector<std::array<double, 2>> ends = {{-0.3, 0.3}, {-0.2, 0.2}, {0.15, 1.5},
                                                   {-60, 60},   {-60, 60},   {-180, 180}};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    SCOPED_TRACE(table::axis_names()[axis]);
    const table::Sweep sweep = table::axis_sweep(axis, nominal, 7);
    ASSERT_EQ(sweep.stops.size(), 7u);
    EXPECT_NEAR(sweep.stops.front().travel, ends[axis][0], 1e-12);
    EXPECT_NEAR(sweep.stops.back().travel, ends[axis][1], 1e-12);
    for (const table::Stop& stop : sweep.stops) {
      table::SixAxes moved = table::pose_error(stop.truth, sim::translation(0, 0, nominal.range_m));
      const double travel = axis == 2 ? stop.travel - nominal.range_m : stop.travel * (axis < 3 ? 1 : kDegree);
      if (std::fabs(stop.travel) < 179) {  // half a turn is so either way round
        EXPECT_NEAR(moved[axis], travel, 1e-12);
        moved[axis] = 0;
        EXPECT_NEAR(sim::length({moved[3], moved[4], moved[5]}), 0, 1e-12);
      }
      if (axis < 3) moved[axis] = 0;
      EXPECT_NEAR(sim::length({moved[0], moved[1], moved[2]}), 0, 1e-12);
      EXPECT_EQ(stop.size_m, 0.05);
    }
  }
}

TEST(TableSweeps, GoAroundTheRectangle) {
  const table::Sweep sweep = table::rectangle_sweep({}, 21);
  double way = 0;
  double left = 0;
  double top = 0;
  for (std::size_t i = 0; i < sweep.stops.size(); ++i) {
    const auto& t = sweep.stops[i].truth.t;
    EXPECT_EQ(t[2], 1);
    left = std::min(left, t[0]);
    top = std::min(top, t[1]);
    if (i == 0) continue;
    const auto& before = sweep.stops[i - 1].truth.t;
    way += std::hypot(t[0] - before[0], t[1] - before[1]);
  }
  EXPECT_NEAR(way, 2, 1e-12);  // 10 cm a step, so that every corner is a stop
  EXPECT_NEAR(left, -0.3, 1e-12);
  EXPECT_NEAR(top, -0.2, 1e-12);
  EXPECT_NEAR(sweep.stops.back().truth.t[0], sweep.stops.front().truth.t[0], 1e-12);
}

TEST(TableSweeps, LookAtEachSizeFromEachRange) {
  const std::vector<table::Sweep> cells = table::range_grid(3, 5);
  ASSERT_EQ(cells.size(), table::grid_sizes_m().size() * table::grid_ranges_m().size());
  std::size_t i = 0;
  for (const double size_m : table::grid_sizes_m()) {
    for (const double range_m : table::grid_ranges_m()) {
      for (const table::Stop& stop : cells[i].stops) {
        EXPECT_EQ(stop.size_m, size_m);
        EXPECT_EQ(stop.truth.t[2], range_m);
        EXPECT_LT(std::fabs(stop.truth.t[0]), 0.051 * range_m);
      }
      ++i;
    }
  }
}

sim::Sensor noiseless() {
  sim::Sensor sensor;
  sensor.read_noise = 0;
  sensor.full_well_e = 0;
  return sensor;
}

// Quick, and fine enough for what is asked here.
constexpr int kCoarse = 1;

cli::EngineOptions simd() {
  cli::EngineOptions options;
  options.backend = "simd";
  return options;
}

// A corner order, a pixel's centre or an axis taken wrongly shows as degrees and centimetres.
TEST(TableReaders, AllMeasureTheSamePoseInTheSameFrame) {
  const CameraModel camera = paper_camera();
  const table::Stage stage(camera, noiseless(), kCoarse);
  cli::TableReaders readers(simd(), camera);
  table::Stop stop{0, 0.08, sim::translation(0.05, -0.03, 0.5)};
  stop.truth.R = sim::rotation(25 * kDegree, -20 * kDegree, 100 * kDegree);
  const auto readings = readers.read(stage.look(stop, 1).image.view(), stop.size_m);
  ASSERT_EQ(readings.size(), readers.names().size());
  for (std::size_t m = 0; m < readings.size(); ++m) {
    SCOPED_TRACE(readers.names()[m]);
    ASSERT_TRUE(readings[m]);
    const table::SixAxes error = table::pose_error(readings[m]->pose, stop.truth);
    EXPECT_LT(sim::length({error[0], error[1], error[2]}), 0.005 * 0.5);
    EXPECT_LT(sim::length({error[3], error[4], error[5]}), 2 * kDegree);
  }
}

TEST(TableRun, TellsAGoodMethodFromABadOne) {
  const CameraModel camera = paper_camera();
  const table::Stage stage(camera, noiseless(), kCoarse);
  cli::TableReaders readers(simd(), camera);
  int frames = 0;
  const auto run = [&](std::size_t axis) {
    return cli::run_sweep(table::axis_sweep(axis, {}, 7), stage, 1, readers, [&frames] { ++frames; });
  };
  const cli::TableSweep across = run(0);
  EXPECT_EQ(frames, 7);
  const table::SweepErrors x = across.errors(0);
  EXPECT_EQ(x.shown, 7);
  EXPECT_EQ(x.found, 7);
  EXPECT_LT(x.shares[0].rms(), 0.001);
  EXPECT_LT(x.corners_px.rms(), 0.15);
  EXPECT_GT(x.corners_px.rms(), 0);
  const cli::TableSweep turned = run(4);
  // Method 1, the paper's closed form, does not use all that the corners say (docs/pose.md).
  EXPECT_GT(turned.errors(1).axes[4].rms(), 3 * turned.errors(0).axes[4].rms());
}

TEST(TableRun, SetsEachFramesBoundBesideIt) {
  const table::Stage stage(paper_camera(), sim::Sensor(), kCoarse);
  cli::TableReaders readers(simd(), paper_camera());
  table::Sweep sweep{"mine", "frame", std::nullopt, {}};
  for (const double range_m : {0.5, 1.0}) sweep.stops.push_back({0, 0.0745, sim::translation(0, 0, range_m)});
  const cli::TableSweep run = cli::run_sweep(sweep, stage, 1, readers, [] {});
  ASSERT_TRUE(run.frames[0].bound && run.frames[1].bound);
  // Half the range, twice the side in px: four times the pixels and edges twice as long, each as steep as before.
  EXPECT_LT(run.frames[0].corner_bound_px, 0.8 * run.frames[1].corner_bound_px);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_LT((*run.frames[0].bound)[i], 0.6 * (*run.frames[1].bound)[i]) << i;
  EXPECT_EQ(run.bound().count(), 2);
  EXPECT_GT(run.bound().rms(2), (*run.frames[0].bound)[2]);
  EXPECT_LT(run.bound().rms(2), (*run.frames[1].bound)[2]);
}

TEST(TableRun, CountsOnlyWhatIsWhollyInView) {
  const CameraModel camera = paper_camera();
  const table::Stage stage(camera, noiseless(), kCoarse);
  cli::TableReaders readers(simd(), camera);
  table::Sweep sweep{"mine", "frame", std::nullopt, {}};
  sweep.stops.push_back({0, 0.08, sim::translation(0, 0, 1)});
  sweep.stops.push_back({1, 0.08, sim::translation(0.47, 0, 1)});  // over the right rim
  const cli::TableSweep run = cli::run_sweep(sweep, stage, 1, readers, [] {});
  EXPECT_TRUE(run.frames[0].shown);
  EXPECT_FALSE(run.frames[1].shown);
  EXPECT_TRUE(run.frames[0].bound);
  EXPECT_FALSE(run.frames[1].bound);
  EXPECT_EQ(run.errors(0).shown, 1);
}

TEST(TableRun, HasASecondCameraOnThePlate) {
  const CameraModel camera = paper_camera();
  const table::Stage stage(camera, noiseless(), kCoarse);
  cli::TableReaders readers(simd(), camera, 2);
  const std::size_t plate = readers.names().size() - 2, both = plate + 1;
  const auto run = [&](std::size_t axis) {
    return cli::run_sweep(table::axis_sweep(axis, {}, 5), stage, 1, readers, [] {});
  };
  const cli::TableSweep across = run(0);
  EXPECT_EQ(across.errors(plate).found, 5);
  EXPECT_EQ(across.errors(both).found, 5);
  EXPECT_LT(across.errors(both).shares[0].rms(), 0.001);
  // ±60° and ±30°: there the plate's camera looks elsewhere, and the first one's answer stands alone.
  const cli::TableSweep turned = run(4);
  EXPECT_EQ(turned.errors(plate).found, 1);
  EXPECT_EQ(turned.errors(both).found, 5);
  EXPECT_LE(turned.errors(both).axes[4].rms(), turned.errors(0).axes[4].rms());
}

TEST(CliTable, PrintsTablesAndWritesFiles) {
  const test::ScratchFolder folder;
  const auto run = test::run_berth({"table", "--only", "z,rectangle,still", "--frames", "4", "--backend", "simd",
                                    "--blur", "0.8", "--noise", "1.5", "--fineness", "1", "--out", folder / "out"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("side 74.5 mm: 50.0 px at 1 m"));
  EXPECT_THAT(run.out, HasSubstr("blur σ 0.8 px"));
  EXPECT_THAT(run.out, HasSubstr("read noise 1.5"));
  EXPECT_THAT(run.out, HasSubstr("blur computed at 1/1 px"));
  EXPECT_THAT(run.out, HasSubstr("| z 0.15 … 1.5 m | bound of one image | | – | "));
  EXPECT_THAT(run.out, HasSubstr("| z 0.15 … 1.5 m | Berth | 4/4 |"));
  EXPECT_THAT(run.out, HasSubstr("Z-XY RMS mm"));
  EXPECT_THAT(run.out, HasSubstr("mean error ± standard deviation"));
  EXPECT_EQ(run.out.find("Sizes and ranges"), std::string::npos);
  const std::string csv = test::text_of(folder / "out/table.csv");
  const auto methods = static_cast<std::ptrdiff_t>(cli::TableReaders(simd(), paper_camera()).names().size());
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 3 * 4 * methods);
  const std::string heading = csv.substr(0, csv.find('\n'));
  EXPECT_THAT(heading, HasSubstr("bound_rz_deg,bound_corner_px"));
  const std::string line = csv.substr(heading.size() + 1, csv.find('\n', heading.size() + 1) - heading.size() - 1);
  EXPECT_EQ(std::count(line.begin(), line.end(), ','), std::count(heading.begin(), heading.end(), ','));
  for (const char* name : {"out/axes.svg", "out/rectangle.svg", "out/trajectory.svg"}) {
    EXPECT_THAT(test::text_of(folder / name), HasSubstr("</svg>")) << name;
    EXPECT_EQ(test::text_of(folder / name).find("nan"), std::string::npos) << name;
  }
}

TEST(CliTable, SaysWhatItCannotDo) {
  const test::ScratchFolder folder;
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {"--only", "w"}, {"--frames", "1"}, {"--backend", "abacus"}, {"--camera", folder / "none.yaml"}}) {
    std::vector<std::string> arguments = {"table", "--out", folder / "out"};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    const auto run = test::run_berth(arguments);
    EXPECT_EQ(run.exit_code, 2) << wrong[0];
    EXPECT_THAT(run.err, HasSubstr(wrong[1]));
  }
}

}  // namespace
}  // namespace berth
