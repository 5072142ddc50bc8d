#include "annotate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "as_mat.hpp"
#include "output_file.hpp"

namespace berth::cli {
namespace {

const cv::Scalar kRed(60, 60, 255), kGreen(80, 230, 80), kBlue(255, 140, 60), kYellow(60, 230, 255), kBlack(0, 0, 0);

/// Side, px, that an image is enlarged to: below it numbers next to corners would cover the markers.
constexpr int kReadableSide = 960;
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
/// OpenCV's fixed point of drawing coordinates: 1/16 px.
constexpr int kShift = 4;

class Canvas {
 public:
  explicit Canvas(View2D<const u8> image) {
    const int side = std::max(image.width, image.height);
    enlargement_ = std::clamp((kReadableSide + side - 1) / side, 1, 8);
    cv::Mat large;
    cv::resize(as_mat(image), large, cv::Size(), enlargement_, enlargement_, cv::INTER_NEAREST);
    cv::cvtColor(large, picture_, cv::COLOR_GRAY2BGR);
    thickness_ = std::max(1, cvRound(side * enlargement_ / 900.0));
    text_px_ = 12.0 * std::max(1.0, side * enlargement_ / 1200.0);
  }

  const cv::Mat& picture() const { return picture_; }
  double text_px() const { return text_px_; }
  cv::Rect2d bounds() const { return {0, 0, static_cast<double>(picture_.cols), static_cast<double>(picture_.rows)}; }

  /// Image coordinates (pixel centres at integers) in the enlarged picture.
  cv::Point2d place(const std::array<double, 2>& p) const {
    return {(p[0] + 0.5) * enlargement_ - 0.5, (p[1] + 0.5) * enlargement_ - 0.5};
  }

  /// Every mark is drawn on a wider black one, so that it shows on any ground.
  void line(cv::Point2d a, cv::Point2d b, const cv::Scalar& colour) {
    cv::line(picture_, fixed(a), fixed(b), kBlack, thickness_ + 2, cv::LINE_AA, kShift);
    cv::line(picture_, fixed(a), fixed(b), colour, thickness_, cv::LINE_AA, kShift);
  }
  void dot(cv::Point2d at, const cv::Scalar& colour) {
    const double radius = 2.5 * thickness_ + 1;
    cv::circle(picture_, fixed(at), cvRound((radius + 1) * (1 << kShift)), kBlack, cv::FILLED, cv::LINE_AA, kShift);
    cv::circle(picture_, fixed(at), cvRound(radius * (1 << kShift)), colour, cv::FILLED, cv::LINE_AA, kShift);
  }
  cv::Size2d text_size(const std::string& text, double px) const {
    int baseline = 0;
    const cv::Size size = cv::getTextSize(text, kFont, scale_of(px), thickness_, &baseline);
    return {static_cast<double>(size.width), static_cast<double>(size.height)};
  }
  void text(const std::string& text, cv::Point2d centre, double px, const cv::Scalar& colour) {
    const cv::Size2d size = text_size(text, px);
    const cv::Point origin(cvRound(centre.x - size.width / 2), cvRound(centre.y + size.height / 2));
    cv::putText(picture_, text, origin, kFont, scale_of(px), kBlack, 3 * thickness_ + 1, cv::LINE_AA);
    cv::putText(picture_, text, origin, kFont, scale_of(px), colour, thickness_, cv::LINE_AA);
  }
  /// In the lower left corner.
  void caption(const std::string& words) {
    const cv::Size2d size = text_size(words, text_px_);
    text(words, {size.width / 2 + text_px_, picture_.rows - 1.2 * text_px_}, text_px_, kYellow);
  }

 private:
  /// Hershey's capitals are about 21 px high at scale 1.
  static double scale_of(double px) { return px / 21; }
  static cv::Point fixed(cv::Point2d p) {
    // Coordinates far outside (an axis that leaves the image) must not overflow the fixed point.
    const auto bounded = [](double v) { return cvRound(std::clamp(v, -60000.0, 60000.0) * (1 << kShift)); };
    return {bounded(p.x), bounded(p.y)};
  }

  cv::Mat picture_;
  int enlargement_ = 1;
  int thickness_ = 1;
  double text_px_ = 12;
};

/// The longest side of the quadrilateral.
double side_of(const std::array<std::array<double, 2>, 4>& corners) {
  double longest = 0;
  for (int i = 0; i < 4; ++i) {
    const double dx = corners[i][0] - corners[(i + 1) % 4][0], dy = corners[i][1] - corners[(i + 1) % 4][1];
    longest = std::max(longest, std::sqrt(dx * dx + dy * dy));
  }
  return longest;
}

/// A point of a target in the picture; none where it lies behind the camera.
std::optional<cv::Point2d> place_of(const Canvas& canvas, const Pose& pose, const CameraModel& camera, double x,
                                    double y, double z) {
  const auto row = [&](int i) { return pose.R[3 * i] * x + pose.R[3 * i + 1] * y + pose.R[3 * i + 2] * z + pose.t[i]; };
  if (!(row(2) > 1e-6)) return std::nullopt;
  return canvas.place(camera.project(row(0) / row(2), row(1) / row(2)));
}

void draw_axes(Canvas& canvas, const Pose& pose, double length_m, const CameraModel& camera) {
  const auto project = [&](double x, double y, double z) { return place_of(canvas, pose, camera, x, y, z); };
  const std::optional<cv::Point2d> origin = project(0, 0, 0);
  const std::array<cv::Scalar, 3> colours = {kRed, kGreen, kBlue};
  for (int axis = 0; axis < 3; ++axis) {
    const auto end = project(axis == 0 ? length_m : 0, axis == 1 ? length_m : 0, axis == 2 ? length_m : 0);
    if (origin && end) canvas.line(*origin, *end, colours[axis]);
  }
}

void draw_target(Canvas& canvas, const DiscTarget& target, const DiscPose& found, const CameraModel& camera) {
  constexpr int kSides = 48;
  double reach_m = 0;
  for (std::size_t k = 0; k < target.discs.size(); ++k) {
    const TargetDisc& disc = target.discs[k];
    reach_m = std::max(reach_m, std::hypot(disc.x_m, disc.y_m));
    std::optional<cv::Point2d> before;
    for (int i = 0; i <= kSides; ++i) {
      const double angle = 2 * CV_PI * i / kSides, radius = disc.diameter_m / 2;
      const std::optional<cv::Point2d> now = place_of(canvas, found.pose, camera, disc.x_m + radius * std::cos(angle),
                                                      disc.y_m + radius * std::sin(angle), 0);
      if (before && now) canvas.line(*before, *now, found.discs[k].seen ? kGreen : kRed);
      before = now;
    }
    if (found.discs[k].seen) canvas.dot(canvas.place(found.discs[k].center_px), kYellow);
  }
  draw_axes(canvas, found.pose, reach_m / 2, camera);
  const std::optional<cv::Point2d> label = place_of(canvas, found.pose, camera, 0, -reach_m, 0);
  if (label) canvas.text(target.name, *label, canvas.text_px(), kYellow);
}

using Quad = std::array<cv::Point2d, 4>;

cv::Rect2d box_of(const Quad& quad) {
  const auto [left, right] = std::minmax({quad[0].x, quad[1].x, quad[2].x, quad[3].x});
  const auto [top, bottom] = std::minmax({quad[0].y, quad[1].y, quad[2].y, quad[3].y});
  return {left, top, right - left, bottom - top};
}

/// Writes the label inside a large marker, else beside it where it covers the least of other markers and labels.
void draw_label(Canvas& canvas, const std::string& label, const Quad& quad, std::vector<cv::Rect2d>& taken) {
  const cv::Rect2d box = box_of(quad);
  const cv::Point2d middle = (quad[0] + quad[1] + quad[2] + quad[3]) / 4;
  const double px = std::clamp(0.1 * std::min(box.width, box.height), canvas.text_px(), 3 * canvas.text_px());
  const cv::Size2d size = canvas.text_size(label, px);
  if (size.width < 0.6 * box.width && size.height < 0.2 * box.height) {
    // In the upper half: the axes go right and down from the middle.
    canvas.text(label, middle * 0.5 + (quad[0] + quad[3]) * 0.25, px, kYellow);
    return;
  }
  const double gap = 1.6 * px, dx = box.width / 2 + size.width / 2 + gap, dy = box.height / 2 + size.height / 2 + gap;
  const cv::Point2d box_middle(box.x + box.width / 2, box.y + box.height / 2);
  const cv::Rect2d all = canvas.bounds();
  double least = 0;
  std::optional<cv::Rect2d> best;
  for (const cv::Point2d& shift : {cv::Point2d(0, dy), cv::Point2d(0, -dy), cv::Point2d(dx, 0), cv::Point2d(-dx, 0)}) {
    const cv::Point2d at = box_middle + shift;
    const cv::Rect2d place(at.x - size.width / 2, at.y - size.height / 2, size.width, size.height);
    double covered = 4 * (place.area() - (place & all).area());  // outside the picture is worst
    for (const cv::Rect2d& other : taken) covered += (place & other).area();
    if (!best || covered < least) {
      best = place;
      least = covered;
    }
  }
  taken.push_back(*best);
  canvas.text(label, {best->x + size.width / 2, best->y + size.height / 2}, px, kYellow);
}

}  // namespace

void write_annotated(const std::string& path, View2D<const u8> image, const std::vector<Detection>& detections,
                     const std::optional<CameraModel>& camera, const std::vector<DiscTarget>& targets,
                     const std::vector<DiscPose>& found) {
  Canvas canvas(image);
  const bool one_family = std::all_of(detections.begin(), detections.end(),
                                      [&](const Detection& d) { return d.family == detections.front().family; });
  std::vector<Quad> quads;
  std::vector<cv::Rect2d> taken;
  for (const Detection& detection : detections) {
    Quad quad;
    for (int i = 0; i < 4; ++i) quad[i] = canvas.place(detection.corners[i]);
    quads.push_back(quad);
    taken.push_back(box_of(quad));
  }
  for (std::size_t d = 0; d < quads.size(); ++d) {
    const Quad& quad = quads[d];
    for (int i = 1; i < 4; ++i) canvas.line(quad[i], quad[(i + 1) % 4], kGreen);
    canvas.line(quad[0], quad[1], kRed);
    if (detections[d].has_pose && camera) {
      // Half a side, from its size in the image: markers of one picture may differ in size.
      const Pose& pose = detections[d].pose;
      draw_axes(canvas, pose, side_of(detections[d].corners) / 2 * pose.t[2] / camera->fx, *camera);
    }
    canvas.dot(quad[0], kRed);
  }
  for (std::size_t d = 0; d < quads.size(); ++d) {
    const Quad& quad = quads[d];
    const cv::Point2d middle = (quad[0] + quad[1] + quad[2] + quad[3]) / 4;
    for (int i = 0; i < 4; ++i) {
      const cv::Point2d out = quad[i] - middle;
      const double length = std::max(1.0, std::sqrt(out.dot(out)));
      canvas.text(std::to_string(i + 1), quad[i] + out * (0.9 * canvas.text_px() / length), 0.75 * canvas.text_px(),
                  i == 0 ? kRed : kGreen);
    }
    const std::string family = one_family ? "id" : detections[d].family->name;
    draw_label(canvas, family + " " + std::to_string(detections[d].id), quad, taken);
  }
  for (std::size_t i = 0; camera && i < found.size(); ++i) {
    if (found[i].has_pose) draw_target(canvas, targets[i], found[i], *camera);
  }
  if (one_family && !detections.empty()) canvas.caption(detections[0].family->name);
  write_png(path, "the annotated picture", canvas.picture());
}

}  // namespace berth::cli
