#include "calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "berth/error.hpp"
#include "pose_algebra.hpp"
#include "target/bent_sides.hpp"
#include "target/quad_map.hpp"

namespace berth {
namespace {

// Views of one plane leave the focal length open (Zhang 2000, section 2.4); these bounds are well before that.
constexpr double kLeastTilt_deg = 15;
constexpr double kMostFocalDeviation = 0.01;
constexpr double kMostRms_px = 1;
// Each brings the corners some ten times nearer to where they are.
constexpr int kStraighteningRounds = 2;

struct Points {
  std::vector<std::vector<cv::Point3f>> on_board;
  std::vector<std::vector<cv::Point2f>> in_image;
};

struct Solution {
  cv::Matx33d matrix = cv::Matx33d::eye();
  cv::Mat coefficients;
  std::vector<cv::Mat> turns, shifts;
};

Points points_of(const Board& board, const ViewSet& set) {
  const std::vector<std::array<double, 2>> places = board.points();
  Points points;
  for (const BoardView& view : set.views()) {
    auto& on_board = points.on_board.emplace_back();
    auto& in_image = points.in_image.emplace_back();
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      const std::array<double, 2>& place = places[view.points[i]];
      on_board.emplace_back(static_cast<float>(place[0]), static_cast<float>(place[1]), 0.0F);
      in_image.emplace_back(static_cast<float>(view.seen_px[i][0]), static_cast<float>(view.seen_px[i][1]));
    }
  }
  return points;
}

const cv::TermCriteria kUntilSettled{cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-9};

Solution solve_brown(const Points& points, cv::Size size) {
  Solution solution;
  cv::calibrateCamera(points.on_board, points.in_image, size, solution.matrix, solution.coefficients, solution.turns,
                      solution.shifts, 0, kUntilSettled);
  return solution;
}

// OpenCV's fisheye calibration starts from a focal length alone, and from a bad one it ends badly or throws.
Solution solve_fisheye(const Points& points, cv::Size size) {
  std::optional<Solution> best;
  double least = 0;
  std::string complaint;
  for (const double field_rad : {CV_PI, CV_PI / 1.5, CV_PI / 2.5}) {
    Solution solution;
    const double focal = std::max(size.width, size.height) / field_rad;
    solution.matrix = {focal, 0, (size.width - 1) / 2.0, 0, focal, (size.height - 1) / 2.0, 0, 0, 1};
    solution.coefficients = cv::Mat::zeros(4, 1, CV_64F);
    try {
      const double rms = cv::fisheye::calibrate(
          points.on_board, points.in_image, size, solution.matrix, solution.coefficients, solution.turns,
          solution.shifts,
          cv::fisheye::CALIB_USE_INTRINSIC_GUESS | cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW,
          kUntilSettled);
      if (!best || rms < least) {
        best = solution;
        least = rms;
      }
    } catch (const cv::Exception& error) {
      complaint = error.err;
    }
  }
  if (!best) throw Error("calibration: no solution (OpenCV: " + complaint + "); take more, and more different, views");
  return *best;
}

// Predicted points and their derivatives: by the inner parameters (fx, fy, cx, cy, coefficients), then by the pose.
struct Prediction {
  std::vector<cv::Point2d> image;
  cv::Mat by_inner, by_pose;
};

Prediction predict(const Solution& solution, LensModel lens, std::size_t view, const std::vector<cv::Point3f>& board) {
  Prediction prediction;
  const std::vector<cv::Point3d> points(board.begin(), board.end());
  cv::Mat slopes;
  if (lens == LensModel::equidistant) {
    cv::fisheye::projectPoints(points, prediction.image, solution.turns[view], solution.shifts[view], solution.matrix,
                               solution.coefficients, 0, slopes);  // f, c, k1 … k4, turn, shift, skew
    prediction.by_inner = slopes.colRange(0, 8);
    prediction.by_pose = slopes.colRange(8, 14);
  } else {
    cv::projectPoints(points, solution.turns[view], solution.shifts[view], solution.matrix, solution.coefficients,
                      prediction.image, slopes);  // turn, shift, f, c, k1 …
    prediction.by_inner = slopes.colRange(6, 15);
    prediction.by_pose = slopes.colRange(0, 6);
  }
  return prediction;
}

// The inverse of a normal matrix whose parameters' scales differ by many orders.
cv::Mat inverse_of(const cv::Mat& normal) {
  cv::Mat scale(normal.rows, 1, CV_64F);
  for (int i = 0; i < normal.rows; ++i) scale.at<double>(i) = 1 / std::sqrt(normal.at<double>(i, i));
  const cv::Mat scales = scale * scale.t();
  cv::Mat inverse;
  cv::invert(normal.mul(scales), inverse, cv::DECOMP_SVD);
  return inverse.mul(scales);
}

CameraModel camera_of(const Solution& solution, LensModel lens, const ViewSet& set) {
  CameraModel camera;
  camera.width = set.width();
  camera.height = set.height();
  camera.fx = solution.matrix(0, 0);
  camera.fy = solution.matrix(1, 1);
  camera.cx = solution.matrix(0, 2);
  camera.cy = solution.matrix(1, 2);
  camera.lens = lens;
  for (int i = 0; i < static_cast<int>(solution.coefficients.total()); ++i) {
    camera.distortion.at(static_cast<std::size_t>(i)) = solution.coefficients.at<double>(i);
  }
  return camera;
}

Pose pose_of(const cv::Mat& turn, const cv::Mat& shift) {
  cv::Matx33d rotation;
  cv::Rodrigues(turn, rotation);
  Pose pose;
  std::copy(rotation.val, rotation.val + 9, pose.R.begin());
  std::copy(shift.ptr<double>(), shift.ptr<double>() + 3, pose.t.begin());
  return pose;
}

Corners shift_of(const CameraModel& camera, const Pose& marker, double size_m) {
  Corners rays;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec3 at = transform(marker, corner_places(size_m)[k]);
    rays[k] = {at[0] / at[2], at[1] / at[2]};
  }
  return bent_side_shift(camera, rays);
}

// What the views' points would be if the detector had found the markers' corners, and not where lines along their bent
// sides meet: that depends on the lens, and is told from the solution so far.
std::vector<std::vector<cv::Point2f>> straightened(const Board& board, const ViewSet& set, const CameraModel& camera,
                                                   const Solution& solution) {
  const std::vector<Board::Marker> markers = board.markers();
  std::vector<std::vector<cv::Point2f>> points;
  for (std::size_t v = 0; v < set.views().size(); ++v) {
    const BoardView& view = set.views()[v];
    const Pose pose = pose_of(solution.turns[v], solution.shifts[v]);
    auto& own = points.emplace_back();
    for (std::size_t i = 0; i < view.points.size(); ++i) {
      const std::array<double, 2>& center = markers[view.points[i] / 4].center_m;
      const auto shifts = shift_of(camera, compose(pose, translation(center[0], center[1], 0)), board.marker_m);
      const std::array<double, 2>& shift = shifts[view.points[i] % 4];
      own.emplace_back(static_cast<float>(view.seen_px[i][0] - shift[0]),
                       static_cast<float>(view.seen_px[i][1] - shift[1]));
    }
  }
  return points;
}

}  // namespace

std::vector<std::string> parameter_names(LensModel lens) {
  if (lens == LensModel::equidistant) return {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"};
  return {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
}

std::vector<double> parameters(const CameraModel& camera) {
  std::vector<double> values = {camera.fx, camera.fy, camera.cx, camera.cy};
  const std::size_t coefficients = parameter_names(camera.lens).size() - values.size();
  for (std::size_t i = 0; i < coefficients; ++i) values.push_back(camera.distortion[i]);
  return values;
}

CalibrationDeviation deviation_of(const Calibration& calibration) {
  const std::vector<double>& all = calibration.deviations;
  CalibrationDeviation deviation;
  deviation.fx = all[0];
  deviation.fy = all[1];
  deviation.cx = all[2];
  deviation.cy = all[3];
  std::copy(all.begin() + 4, all.end(), deviation.distortion.begin());
  return deviation;
}

Calibration calibrate(const Board& board, const ViewSet& set, LensModel lens) try {
  Points points = points_of(board, set);
  const auto solve = lens == LensModel::equidistant ? solve_fisheye : solve_brown;
  const cv::Size size(set.width(), set.height());
  Solution solution = solve(points, size);
  if (board.kind == BoardKind::aprilgrid) {
    for (int round = 0; round < kStraighteningRounds; ++round) {
      points.in_image = straightened(board, set, camera_of(solution, lens, set), solution);
      solution = solve(points, size);
    }
  }
  Calibration result;
  result.camera = camera_of(solution, lens, set);
  // The normal equations with each view's pose eliminated (Schur's complement) are those of the inner parameters.
  const auto inner = static_cast<int>(parameter_names(lens).size());
  cv::Mat normal = cv::Mat::zeros(inner, inner, CV_64F);
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t v = 0; v < points.in_image.size(); ++v) {
    const Prediction prediction = predict(solution, lens, v, points.on_board[v]);
    const cv::Mat &a = prediction.by_inner, &b = prediction.by_pose;
    const cv::Mat mixed = a.t() * b;
    normal += a.t() * a - mixed * inverse_of(b.t() * b) * mixed.t();
    Calibration::View view;
    view.pose = pose_of(solution.turns[v], solution.shifts[v]);
    double own = 0;
    for (std::size_t i = 0; i < prediction.image.size(); ++i) {
      const cv::Point2f& seen = points.in_image[v][i];
      const std::array<double, 2> off = {seen.x - prediction.image[i].x, seen.y - prediction.image[i].y};
      own += off[0] * off[0] + off[1] * off[1];
      view.residuals_px.push_back(off);
    }
    view.rms_px = std::sqrt(own / static_cast<double>(view.residuals_px.size()));
    squares += own;
    count += view.residuals_px.size();
    result.views.push_back(std::move(view));
  }
  result.rms_px = std::sqrt(squares / static_cast<double>(count));
  const double freedom = 2.0 * static_cast<double>(count) - inner - 6.0 * static_cast<double>(result.views.size());
  const cv::Mat covariance = inverse_of(normal) * (squares / freedom);
  for (int i = 0; i < inner; ++i) result.deviations.push_back(std::sqrt(covariance.at<double>(i, i)));
  return result;
} catch (const cv::Exception& error) {
  throw Error("calibration: no solution (OpenCV: " + error.err + "); take more, and more different, views");
}

double Calibration::tilt_range_deg() const {
  double least = 1;
  for (const View& a : views) {
    for (const View& b : views) least = std::min(least, dot(column(a.pose.R, 2), column(b.pose.R, 2)));
  }
  return std::acos(std::max(-1.0, least)) * 180 / CV_PI;
}

std::vector<std::string> Calibration::objections(const ViewSet& set) const {
  std::vector<std::string> all;
  const auto number = [](double value) {
    const std::string text = std::to_string(value);
    return text.substr(0, text.find('.') + 3);
  };
  const double deviation = std::max(deviations[0] / camera.fx, deviations[1] / camera.fy);
  if (tilt_range_deg() < kLeastTilt_deg) {
    all.push_back("one plane: the boards of all views are parallel to " + number(tilt_range_deg()) +
                  " degrees, which leaves the focal length open; lean the board 20 to 45 degrees, each way");
  } else if (!(deviation < kMostFocalDeviation)) {
    all.push_back("the focal length is known to " + number(100 * deviation) +
                  " % only; lean the board more, and bring it nearer");
  }
  if (!(rms_px < kMostRms_px)) {
    std::size_t worst = 0;
    for (std::size_t v = 1; v < views.size(); ++v) worst = views[v].rms_px > views[worst].rms_px ? v : worst;
    all.push_back("the board's points are " + number(rms_px) + " px from where they should be, most in " +
                  set.views()[worst].label + " (" + number(views[worst].rms_px) +
                  " px); check the board's kind, grid and sizes, that it is flat, and the lens model");
  }
  return all;
}

}  // namespace berth
