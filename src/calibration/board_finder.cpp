#include "calibration/board_finder.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "as_mat.hpp"
#include "berth/detector.hpp"
#include "calibration/edge_width.hpp"

namespace berth {
namespace {

// A view with fewer points says little and may be a mistake.
constexpr std::size_t kLeastPoints = 9;

// Points on one line leave open how the board lies.
bool spans_a_plane(const std::vector<std::array<double, 2>>& places, const BoardView& view, double pitch_m) {
  for (std::size_t axis = 0; axis < 2; ++axis) {
    double low = places[view.points[0]][axis], high = low;
    for (const std::size_t point : view.points) {
      low = std::min(low, places[point][axis]);
      high = std::max(high, places[point][axis]);
    }
    if (!(high - low > 1.5 * pitch_m)) return false;
  }
  return true;
}

void add_point(BoardView& view, std::size_t point, double x_px, double y_px) {
  view.points.push_back(point);
  view.seen_px.push_back({x_px, y_px});
}

}  // namespace

struct BoardFinder::Impl {
  Impl(const Board& the_board, Backend& backend, int width, int height) : board(the_board) {
    board.check();
    places = board.points();
    if (board.kind == BoardKind::chessboard) return;
    DetectorConfig config;
    config.families = {board.family->name};
    detector = std::make_unique<Detector>(backend, width, height, config);
    markers = board.markers();
  }

  /// The board's markers by their number on it. One that is seen twice is not told apart from its like, and left out.
  std::map<std::size_t, std::array<std::array<double, 2>, 4>> seen_markers(View2D<const u8> image) {
    std::map<std::size_t, std::array<std::array<double, 2>, 4>> seen;
    std::map<std::size_t, int> times;
    for (const Detection& detection : detector->detect(image).detections) {
      const auto number = static_cast<std::size_t>(detection.id - board.first_id);
      if (detection.id < board.first_id || number >= markers.size()) continue;
      seen[number] = detection.corners;
      if (++times[number] > 1) seen.erase(number);
    }
    return seen;
  }

  void find_aprilgrid(View2D<const u8> image, BoardView& view) {
    for (const auto& [number, corners] : seen_markers(image)) {
      for (std::size_t k = 0; k < 4; ++k) add_point(view, 4 * number + k, corners[k][0], corners[k][1]);
    }
  }

  void find_chessboard(View2D<const u8> image, BoardView& view) const {
    const cv::Size inner(board.columns - 1, board.rows - 1);
    std::vector<cv::Point2f> corners;
    if (!cv::findChessboardCornersSB(as_mat(image), inner, corners, cv::CALIB_CB_NORMALIZE_IMAGE)) return;
    if (is_upside_down(image, corners)) std::reverse(corners.begin(), corners.end());
    double nearest = std::max(image.width, image.height);
    for (std::size_t i = 1; i < corners.size(); ++i) nearest = std::min(nearest, cv::norm(corners[i] - corners[i - 1]));
    refine(image, nearest, corners);
    for (std::size_t i = 0; i < corners.size(); ++i) add_point(view, i, corners[i].x, corners[i].y);
  }

  /// OpenCV does not tell which end of the board is which. The square within the first four corners is dark, the one
  /// to its right light. Where both ends look alike it does not matter.
  bool is_upside_down(View2D<const u8> image, const std::vector<cv::Point2f>& corners) const {
    const auto row = static_cast<std::size_t>(board.columns - 1);
    const auto grey = [&](std::size_t i) {
      const cv::Point2f middle = (corners[i] + corners[i + 1] + corners[i + row] + corners[i + row + 1]) / 4;
      return image.at(std::clamp(static_cast<int>(middle.x + 0.5F), 0, image.width - 1),
                      std::clamp(static_cast<int>(middle.y + 0.5F), 0, image.height - 1));
    };
    return grey(0) > grey(1);
  }

  /// Each corner of the chessboard from the two markers that touch it, then on the image itself.
  void find_charuco(View2D<const u8> image, BoardView& view) {
    const auto seen = seen_markers(image);
    const double h = board.marker_m / 2, reach_m = 0.75 * board.pitch_m;
    std::vector<std::size_t> numbers;
    std::vector<cv::Point2f> corners;
    double nearest = std::max(image.width, image.height);
    for (std::size_t i = 0; i < places.size(); ++i) {
      std::vector<cv::Point2d> on_board;
      std::vector<cv::Point2d> in_image;
      for (const auto& [number, marker_corners] : seen) {
        const std::array<double, 2>& at = markers[number].center_m;
        if (std::fabs(at[0] - places[i][0]) > reach_m || std::fabs(at[1] - places[i][1]) > reach_m) continue;
        for (const auto& [x, y] : {std::array{-h, -h}, std::array{-h, h}, std::array{h, h}, std::array{h, -h}}) {
          on_board.emplace_back(at[0] + x, at[1] + y);
        }
        for (const auto& corner : marker_corners) in_image.emplace_back(corner[0], corner[1]);
      }
      if (on_board.size() != 8) continue;
      const cv::Mat map = cv::findHomography(on_board, in_image);
      if (map.empty()) continue;
      std::vector<cv::Point2d> found;
      cv::perspectiveTransform(std::vector<cv::Point2d>{{places[i][0], places[i][1]}}, found, map);
      numbers.push_back(i);
      corners.emplace_back(found[0]);
      for (const cv::Point2d& corner : in_image) nearest = std::min(nearest, cv::norm(corner - found[0]));
    }
    if (corners.empty()) return;
    const std::vector<cv::Point2f> guessed = corners;
    refine(image, nearest, corners);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (!(cv::norm(corners[i] - guessed[i]) < 0.5 * nearest)) continue;  // it ran to something else
      add_point(view, numbers[i], corners[i].x, corners[i].y);
    }
  }

  /// To the subpixel, within windows that reach no other corner.
  static void refine(View2D<const u8> image, double nearest_px, std::vector<cv::Point2f>& corners) {
    const int half = std::min(8, std::max(2, static_cast<int>(0.45 * nearest_px)));
    cv::cornerSubPix(as_mat(image), corners, {half, half}, {-1, -1},
                     {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 60, 1e-4});
  }

  Board board;
  std::vector<std::array<double, 2>> places;
  std::vector<Board::Marker> markers;
  std::unique_ptr<Detector> detector;
};

BoardFinder::BoardFinder(const Board& board, Backend& backend, int width, int height)
    : impl_(std::make_unique<Impl>(board, backend, width, height)) {}
BoardFinder::~BoardFinder() = default;

std::optional<BoardView> BoardFinder::find(View2D<const u8> image) {
  BoardView view;
  switch (impl_->board.kind) {
    case BoardKind::aprilgrid:
      impl_->find_aprilgrid(image, view);
      break;
    case BoardKind::chessboard:
      impl_->find_chessboard(image, view);
      break;
    case BoardKind::charuco:
      impl_->find_charuco(image, view);
      break;
  }
  if (view.points.size() < kLeastPoints || !spans_a_plane(impl_->places, view, impl_->board.pitch_m)) {
    return std::nullopt;
  }
  view.edge_px = edge_width_px(impl_->board, view, image);
  return view;
}

}  // namespace berth
