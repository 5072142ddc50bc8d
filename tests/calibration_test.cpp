// Calibration: boards that the simulator renders through a known lens are found where they are, and give the lens back
// within what the result says of itself. OpenCV's drawings and standard deviations are the judges of what is Berth's.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "calibration/board_finder.hpp"
#include "calibration/calibrate.hpp"
#include "sim/board.hpp"
#include "sim/geometry.hpp"
#include "sim/render.hpp"
#include "sim/scenario.hpp"
#include "support/command_run.hpp"
#include "support/marker_scene.hpp"
#include "support/scratch_folder.hpp"
#include "target/opencv_aruco.hpp"

namespace berth {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Board small_board(BoardKind kind) {
  Board board;
  board.kind = kind;
  board.columns = kind == BoardKind::aprilgrid ? 6 : 8;
  board.rows = kind == BoardKind::aprilgrid ? 5 : 7;
  board.pitch_m = kind == BoardKind::aprilgrid ? 0.045 : 0.034;
  board.marker_m = kind == BoardKind::aprilgrid ? 0.03 : 0.025;
  board.family = &family(kind == BoardKind::charuco ? "aruco4x4_50" : "tag36h11");
  return board;
}

std::string board_toml(const Board& board) {
  return std::string("[board]\nkind = \"") + name_of(board.kind) + "\"\ncolumns = " + std::to_string(board.columns) +
         "\nrows = " + std::to_string(board.rows) + "\npitch_m = " + std::to_string(board.pitch_m) +
         "\nmarker_m = " + std::to_string(board.marker_m) + "\nfamily = \"" + board.family->name + "\"\n";
}

constexpr const char* kStudio = "[target]\nbody = false\n[background]\nwall = false\nvoid_albedo = 0.3\n";
constexpr const char* kViews = "[trajectory]\nkind = \"views\"\nframes = ";

/// Every view that a scenario's frames give.
ViewSet views_of(const std::string& toml, const Board& board) {
  const test::ScratchFolder folder;
  const std::unique_ptr<Source> source = open_scenario(folder.write("board.toml", toml));
  const CameraModel camera = *source->camera();
  const auto backend = open_backend("simd");
  BoardFinder finder(board, *backend, camera.width, camera.height);
  ViewSet set(camera.width, camera.height, 100);
  while (const std::optional<SourceFrame> frame = source->next()) {
    std::optional<BoardView> view = finder.find(frame->image.view());
    if (!view) continue;
    view->label = frame->label;
    set.add(std::move(*view));
  }
  return set;
}

void expect_recovered(const Calibration& calibration, const CameraModel& truth) {
  const std::vector<std::string> names = parameter_names(truth.lens);
  const std::vector<double> found = parameters(calibration.camera), expected = parameters(truth);
  ASSERT_EQ(calibration.deviations.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_GT(calibration.deviations[i], 0) << names[i];
    EXPECT_LT(std::fabs(found[i] - expected[i]), 3 * calibration.deviations[i])
        << names[i] << ": " << found[i] << " for " << expected[i];
  }
}

class EveryBoard : public testing::TestWithParam<BoardKind> {};

TEST_P(EveryBoard, IsFoundWhereItIs) {
  const Board board = small_board(GetParam());
  sim::Scene scene;
  scene.camera = paper_camera();
  scene.background = sim::board_surfaces(board, 0.88, 0.05);
  Pose pose = translation(0.01, 0, 0.46);
  pose.R = sim::rotation(0.3, -0.35, 0.2);
  for (sim::Surface& surface : scene.background) surface.pose = compose(pose, surface.pose);
  const GrayImage image = sim::render(scene);
  const auto backend = open_backend("simd");
  BoardFinder finder(board, *backend, image.width(), image.height());
  const std::optional<BoardView> view = finder.find(image.view());
  ASSERT_TRUE(view);
  const auto places = board.points();
  EXPECT_EQ(view->points.size(), places.size());
  double squares = 0;
  for (std::size_t i = 0; i < view->points.size(); ++i) {
    const auto& place = places[view->points[i]];
    const Vec3 at = transform(pose, {place[0], place[1], 0});
    const auto expected = scene.camera.project(at[0] / at[2], at[1] / at[2]);
    const double off = std::hypot(view->seen_px[i][0] - expected[0], view->seen_px[i][1] - expected[1]);
    EXPECT_LT(off, 1) << i;
    squares += off * off;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(view->points.size())), 0.2);
  EXPECT_GT(view->edge_px, 1.5);
  EXPECT_LT(view->edge_px, 3);
  // Moved by 7 px during the exposure, across the upright edges alone.
  sim::Scene moving = scene;
  moving.motion.shift = {0.005, 0, 0};
  const std::optional<BoardView> blurred = finder.find(sim::render(moving).view());
  if (blurred) {
    EXPECT_EQ(ViewSet(640, 480, 100).add(*blurred), ViewSet::Verdict::blurred) << blurred->edge_px;
  }
  // No board, no view.
  scene.background.clear();
  EXPECT_FALSE(finder.find(sim::render(scene).view()));
}

// The paper's Table 2, scaled to 640 x 480: every parameter within three of the standard deviations that are reported.
TEST_P(EveryBoard, RecoversThePapersTable2From20Views) {
  const Board board = small_board(GetParam());
  const ViewSet set = views_of(
      // A chessboard counts only as a whole: it is held further away and nearer the middle.
      kStudio + board_toml(board) + kViews +
          (GetParam() == BoardKind::chessboard ? "20\nrange_m = [0.5, 0.7]\nview = [0.22, 0.15]\n"
                                               : "20\nrange_m = [0.34, 0.5]\nview = [0.28, 0.2]\n"),
      board);
  EXPECT_GE(set.views().size(), 19u);
  EXPECT_THAT(set.objections(), IsEmpty());
  const Calibration calibration = calibrate(board, set, LensModel::radial_tangential);
  EXPECT_THAT(calibration.objections(set), IsEmpty());
  EXPECT_LT(calibration.rms_px, 0.3);
  EXPECT_LT(calibration.deviations[0], 2);  // a result that claims to know nothing would pass anything
  EXPECT_LT(calibration.deviations[4], 0.02);
  expect_recovered(calibration, paper_camera());
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryBoard,
                         testing::Values(BoardKind::aprilgrid, BoardKind::chessboard, BoardKind::charuco),
                         [](const auto& kind) { return std::string(name_of(kind.param)); });

TEST(Calibrate, RecoversAFisheye) {
  const Board board = small_board(BoardKind::aprilgrid);
  CameraModel fisheye = paper_camera();
  fisheye.fx = 302;
  fisheye.fy = 301;
  fisheye.lens = LensModel::equidistant;
  fisheye.distortion = {-0.03, 0.012, -0.006, 0.001};
  const test::ScratchFolder folder;
  write_camera_info(folder / "fisheye.yaml", fisheye);
  const std::string studio =
      "[camera]\nfile = \"" + (folder / "fisheye.yaml") + "\"\n[target]\nbody = false\n[background]\nwall = false\n" +
      "[trajectory]\nkind = \"views\"\nframes = 24\nrange_m = [0.16, 0.24]\nview = [0.8, 0.55]\ntilt_deg = [10, 45]\n";
  const ViewSet set = views_of(studio + board_toml(board), board);
  EXPECT_THAT(set.objections(), IsEmpty());
  const Calibration calibration = calibrate(board, set, LensModel::equidistant);
  EXPECT_THAT(calibration.objections(set), IsEmpty());
  EXPECT_LT(calibration.rms_px, 0.3);
  EXPECT_LT(calibration.deviations[0], 2);
  expect_recovered(calibration, fisheye);
}

/// Views of a board by exact projection and independent noise.
ViewSet noisy_views(const Board& board, const CameraModel& camera, int count, double noise_px, double tilt_rad,
                    Random& random) {
  const auto places = board.points();
  ViewSet set(camera.width, camera.height, 100);
  for (int v = 0; v < count; ++v) {
    BoardView view;
    view.label = "view " + std::to_string(v);
    const double range = random.between(0.35, 0.5);
    Pose pose = translation(random.between(-0.25, 0.25) * range, random.between(-0.18, 0.18) * range, range);
    const double axis = 2.4 * v;
    pose.R = product(sim::rotation(tilt_rad * std::cos(axis), tilt_rad * std::sin(axis), 0),
                     sim::rotation(0, 0, random.between(-0.3, 0.3)));
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Vec3 at = transform(pose, {places[i][0], places[i][1], 0});
      const auto seen = camera.project(at[0] / at[2], at[1] / at[2]);
      const double noise_x = random.normal(), noise_y = random.normal();
      view.points.push_back(i);
      view.seen_px.push_back({seen[0] + noise_px * noise_x, seen[1] + noise_px * noise_y});
    }
    set.add(std::move(view));
  }
  return set;
}

TEST(Calibrate, ReportsTheStandardDeviationsOfOpenCv) {
  const Board board = small_board(BoardKind::chessboard);
  Random random(5);
  const ViewSet set = noisy_views(board, paper_camera(), 15, 0.1, 0.5, random);
  const Calibration calibration = calibrate(board, set, LensModel::radial_tangential);
  std::vector<std::vector<cv::Point3f>> on_board(set.views().size());
  std::vector<std::vector<cv::Point2f>> in_image(set.views().size());
  const auto places = board.points();
  for (std::size_t v = 0; v < set.views().size(); ++v) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      on_board[v].emplace_back(static_cast<float>(places[i][0]), static_cast<float>(places[i][1]), 0.0F);
      const auto& seen = set.views()[v].seen_px[i];
      in_image[v].emplace_back(static_cast<float>(seen[0]), static_cast<float>(seen[1]));
    }
  }
  cv::Mat matrix, coefficients, turns, shifts, deviations, extrinsic, errors;
  cv::calibrateCamera(on_board, in_image, {640, 480}, matrix, coefficients, turns, shifts, deviations, extrinsic,
                      errors, 0, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-12});
  // OpenCV 4.6 takes the points for the number of measurements, which are two a point.
  const double points = 15.0 * static_cast<double>(places.size()), unknowns = 9 + 6 * 15;
  const double expected = std::sqrt((points - unknowns) / (2 * points - unknowns));
  for (std::size_t i = 0; i < calibration.deviations.size(); ++i) {
    EXPECT_NEAR(calibration.deviations[i] / deviations.at<double>(static_cast<int>(i)), expected, 0.001) << i;
  }
}

// Errors over their standard deviations have mean square 1: over 25 noisy sets, 8 or 9 parameters each.
TEST(Calibrate, KnowsHowWellItKnows) {
  const Board board = small_board(BoardKind::chessboard);
  CameraModel fisheye = paper_camera();
  fisheye.lens = LensModel::equidistant;
  fisheye.distortion = {-0.03, 0.012, -0.006, 0.001};
  for (const CameraModel& camera : {paper_camera(), fisheye}) {
    Random random(11);
    double squares = 0;
    int count = 0;
    for (int trial = 0; trial < 25; ++trial) {
      const ViewSet set = noisy_views(board, camera, 12, 0.2, 0.5, random);
      const Calibration calibration = calibrate(board, set, camera.lens);
      const std::vector<double> found = parameters(calibration.camera), expected = parameters(camera);
      for (std::size_t i = 0; i < found.size(); ++i) {
        const double z = (found[i] - expected[i]) / calibration.deviations[i];
        squares += z * z;
        ++count;
      }
    }
    EXPECT_NEAR(squares / count, 1, 0.3);  // parameters of one set are correlated: wider than the chi-square's bounds
  }
}

TEST(Calibrate, RefusesOnePlane) {
  const Board board = small_board(BoardKind::chessboard);
  Random random(6);
  const ViewSet set = noisy_views(board, paper_camera(), 15, 0.1, 0, random);
  EXPECT_THAT(set.objections(), IsEmpty());
  const auto objections = calibrate(board, set, LensModel::radial_tangential).objections(set);
  ASSERT_FALSE(objections.empty());
  EXPECT_THAT(objections[0], testing::AnyOf(HasSubstr("one plane"), HasSubstr("the focal length is known to")));
}

TEST(Calibrate, RefusesPointsThatDoNotFit) {
  const Board board = small_board(BoardKind::chessboard);
  Board squat = board;
  Random random(7);
  const ViewSet set = noisy_views(board, paper_camera(), 15, 0.1, 0.5, random);
  squat.columns = 7;  // the same number of points in another shape
  squat.rows = 8;
  const auto objections = calibrate(squat, set, LensModel::radial_tangential).objections(set);
  EXPECT_THAT(objections, testing::Contains(HasSubstr("px from where they should be, most in view ")));
}

TEST(ViewSet, RefusesWithTheReason) {
  const Board board = small_board(BoardKind::aprilgrid);
  Random random(8);
  ViewSet few = noisy_views(board, paper_camera(), 4, 0.1, 0.5, random);
  EXPECT_THAT(few.objections(), testing::Contains(HasSubstr("too few views: 4 of the 10")));
  BoardView again = few.views()[2];
  EXPECT_EQ(few.add(again), ViewSet::Verdict::repeated);
  again.edge_px = 8;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(few.add(again), ViewSet::Verdict::blurred);
  EXPECT_THAT(few.objections(), testing::Contains(HasSubstr("blur: in 5 views")));
  // All in the upper left.
  ViewSet corner(640, 480, 100);
  for (int v = 0; v < 12; ++v) {
    BoardView view;
    for (std::size_t i = 0; i < 20; ++i) {
      view.points.push_back(i);
      view.seen_px.push_back({10.0 + 20 * v + static_cast<double>(i % 5), 10.0 + 5 * static_cast<double>(i)});
    }
    EXPECT_EQ(corner.add(std::move(view)), ViewSet::Verdict::taken);
  }
  EXPECT_THAT(corner.objections(), ElementsAre(HasSubstr("poor coverage")));
  EXPECT_THAT(corner.objections()[0], HasSubstr("lower right"));
  EXPECT_THAT(corner.objections()[0], testing::Not(HasSubstr("upper left")));
}

TEST(BoardFinder, FindsOpenCvsCharuco) {
  Board board = small_board(BoardKind::charuco);
  board.columns = 6;
  board.rows = 5;
  const aruco::CharucoBoard drawn({6, 5}, static_cast<float>(board.pitch_m), static_cast<float>(board.marker_m),
                                  aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50));
  cv::Mat picture;
  drawn.generateImage({640, 540}, picture, 20);  // 100 px a square, the first one's edge at 19.5
  const auto backend = open_backend("simd");
  BoardFinder finder(board, *backend, 640, 540);
  const auto view = finder.find({picture.data, 640, 540, 640});
  ASSERT_TRUE(view);
  ASSERT_EQ(view->points.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) {
    const std::size_t column = i % 5, row = i / 5;
    EXPECT_EQ(view->points[i], i);
    EXPECT_NEAR(view->seen_px[i][0], 119.5 + 100 * static_cast<double>(column), 0.1);
    EXPECT_NEAR(view->seen_px[i][1], 119.5 + 100 * static_cast<double>(row), 0.1);
  }
}

TEST(BoardFinder, RefusesBoardsThatCannotBe) {
  const auto refused = [](const Board& board, const char* words) {
    try {
      board.check();
      ADD_FAILURE() << words;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  };
  Board board = small_board(BoardKind::aprilgrid);
  board.columns = 1;
  refused(board, "give 2 to 100");
  board.columns = board.rows = 30;
  refused(board, "needs ids 0 to 899");
  board.columns = board.rows = 3;
  board.pitch_m = 0.035;
  refused(board, "leave too little white");
}

TEST(CliCalibrate, WritesTheCameraThePlotAndTheResult) {
  const test::ScratchFolder folder;
  const std::string scenario = "sim:" BERTH_SOURCE_DIR "/scenarios/calibration.toml";
  const std::vector<std::string> arguments = {
      "calibrate",        "--source", scenario, "--board",           "aprilgrid", "--grid",           "6x6",
      "--size",           "0.03",     "--out",  folder / "cam.yaml", "--plot",    folder / "res.svg", "--json",
      folder / "cam.json"};
  const auto run = test::run_berth(arguments);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("coverage [####"));
  const CameraModel camera = read_camera(folder / "cam.yaml");
  const auto result = nlohmann::json::parse(test::text_of(folder / "cam.json"));
  EXPECT_EQ(result["parameters"]["fx"]["value"], camera.fx);
  EXPECT_EQ(result["views"].size(), 20u);
  const std::vector<double> found = parameters(camera), expected = parameters(paper_camera());
  const std::vector<std::string> names = parameter_names(camera.lens);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double deviation = result["parameters"][names[i]]["deviation"];
    EXPECT_LT(std::fabs(found[i] - expected[i]), 3 * deviation) << names[i];
  }
  EXPECT_THAT(test::text_of(folder / "res.svg"), HasSubstr("All residuals"));
}

TEST(CliCalibrate, RefusesWithTheReasonAndWritesNothing) {
  const test::ScratchFolder folder;
  const std::string few = folder.write("few.toml", kStudio + board_toml(small_board(BoardKind::chessboard)) + kViews +
                                                       "3\nrange_m = [0.6, 0.7]\nview = [0, 0]\n");
  const auto run = test::run_berth({"calibrate", "--source", few, "--board", "chessboard", "--grid", "8x7", "--size",
                                    "0.034", "--out", folder / "cam.yaml"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("refused: too few views: 3 of the 10"));
  EXPECT_EQ(test::text_of(folder / "cam.yaml"), "");
  const auto refused = [&](std::vector<std::string> more, const char* words) {
    std::vector<std::string> arguments = {"calibrate", "--source", few, "--out", folder / "cam.yaml"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto bad = test::run_berth(arguments);
    EXPECT_EQ(bad.exit_code, 2);
    EXPECT_THAT(bad.err, HasSubstr(words));
  };
  refused({"--board", "chessboard", "--grid", "8by7", "--size", "0.034"}, "columns x rows");
  refused({"--board", "chessboard", "--grid", "8x7", "--size", "34mm"}, "give metres");
  refused({"--board", "chessboard", "--grid", "8x7", "--size", "0.034", "--marker", "0.02"}, "only a charuco");
  refused({"--board", "charuco", "--grid", "8x7", "--size", "0.034"}, "--marker");
  refused({"--board", "aprilgrid", "--grid", "8x7", "--size", "0.034", "--gap", "0.001"}, "too little white");
  refused({"--board", "circles", "--grid", "8x7", "--size", "0.034"}, "--board");
}

}  // namespace
}  // namespace berth
