#include "empty_pictures.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <opencv2/imgproc.hpp>

#include "as_mat.hpp"
#include "berth/error.hpp"
#include "camera/image_file.hpp"
#include "sim/corpus.hpp"
#include "sim/random.hpp"
#include "target/marker_pattern.hpp"

namespace berth::bench {
namespace {

using sim::Random;

/// What every picture is made from.
struct Sheet {
  Sheet(u64 seed, cv::Size image_size) : random(seed), size(image_size) {}

  double level() { return random.uniform(10, 245); }
  cv::Point2f point() {
    const double x = random.uniform(0, size.width);
    const double y = random.uniform(0, size.height);
    return {static_cast<float>(x), static_cast<float>(y)};
  }
  /// A plain ground, lit from one side.
  cv::Mat ground() {
    const double middle = level();
    const double slope_x = random.uniform(-0.15, 0.15);
    const double slope_y = random.uniform(-0.15, 0.15);
    cv::Mat image(size, CV_32F);
    for (int y = 0; y < size.height; ++y) {
      float* row = image.ptr<float>(y);
      for (int x = 0; x < size.width; ++x) {
        row[x] = static_cast<float>(middle + slope_x * (x - size.width / 2) + slope_y * (y - size.height / 2));
      }
    }
    return image;
  }
  /// Draws a square picture somewhere, turned and tilted, `side` px wide.
  void place(cv::Mat& image, const cv::Mat& square, double side) {
    const cv::Point2f middle = point();
    const double angle = random.uniform(0, 360);
    cv::Mat view = cv::getRotationMatrix2D({0, 0}, angle, 1);
    const float n = static_cast<float>(square.cols);
    const std::array<cv::Point2f, 4> from = {{{0, 0}, {n, 0}, {n, n}, {0, n}}};
    std::array<cv::Point2f, 4> to;
    for (std::size_t i = 0; i < 4; ++i) {
      // A corner may come in by a quarter of the side: tilts to about 50°.
      const double u = (i == 1 || i == 2 ? 0.5 : -0.5) * side * random.uniform(0.75, 1);
      const double v = (i >= 2 ? 0.5 : -0.5) * side * random.uniform(0.75, 1);
      to[i] = {static_cast<float>(middle.x + view.at<double>(0, 0) * u + view.at<double>(0, 1) * v),
               static_cast<float>(middle.y + view.at<double>(1, 0) * u + view.at<double>(1, 1) * v)};
    }
    cv::warpPerspective(square, image, cv::getPerspectiveTransform(from, to), size, cv::INTER_AREA,
                        cv::BORDER_TRANSPARENT);
  }
  /// Through a lens and onto a sensor.
  GrayImage seen(cv::Mat image) {
    const double blur = random.uniform(0.3, 1.6);
    cv::GaussianBlur(image, image, {0, 0}, blur);
    const double noise = random.uniform(0, 6);
    cv::Mat grain(size, CV_32F);
    cv::RNG rng(random.bits());
    rng.fill(grain, cv::RNG::NORMAL, 0, noise);
    image += grain;
    GrayImage gray(size.width, size.height);
    cv::Mat out(size, CV_8U, gray.view().row(0), static_cast<std::size_t>(gray.view().stride));
    image.convertTo(out, CV_8U);
    return gray;
  }

  Random random;
  cv::Size size;
};

/// Squares of `modules` × `modules` cells, 8 px each, of levels that `cell` says.
template <typename Cell>
cv::Mat cells(int modules, const Cell& cell) {
  constexpr int kPixels = 8;
  cv::Mat square(modules * kPixels, modules * kPixels, CV_32F);
  for (int y = 0; y < modules; ++y) {
    for (int x = 0; x < modules; ++x) {
      square(cv::Rect(x * kPixels, y * kPixels, kPixels, kPixels)) = static_cast<float>(cell(x, y));
    }
  }
  return square;
}

/// Noise of sensors and of nothing: white or smoothed, faint or hard.
cv::Mat noise(Sheet& sheet) {
  cv::Mat image = sheet.ground();
  cv::Mat grain(sheet.size, CV_32F);
  cv::RNG rng(sheet.random.bits());
  rng.fill(grain, cv::RNG::NORMAL, 0, sheet.random.uniform(2, 90));
  if (sheet.random.chance(0.6)) {
    const double sigma = sheet.random.uniform(0.5, 6);
    cv::GaussianBlur(grain, grain, {0, 0}, sigma);
    grain *= 2 * sigma;
  }
  return image + grain;
}

/// Random surfaces of several wavelengths, half of them in a few flat tones: stone, foliage, camouflage.
cv::Mat texture(Sheet& sheet) {
  cv::Mat image = sheet.ground();
  const double amplitude = sheet.random.uniform(20, 150);
  double share = amplitude;
  for (int pixels = sheet.random.integer(3, 6); pixels >= 1; --pixels, share *= 0.6) {
    const cv::Size coarse(std::max(2, sheet.size.width >> pixels), std::max(2, sheet.size.height >> pixels));
    cv::Mat octave(coarse, CV_32F);
    cv::RNG rng(sheet.random.bits());
    rng.fill(octave, cv::RNG::UNIFORM, -share, share);
    cv::resize(octave, octave, sheet.size, 0, 0, sheet.random.chance(0.3) ? cv::INTER_NEAREST : cv::INTER_CUBIC);
    image += octave;
  }
  if (sheet.random.chance(0.5)) {
    const double step = sheet.random.uniform(30, 110);
    for (int y = 0; y < image.rows; ++y) {
      float* row = image.ptr<float>(y);
      for (int x = 0; x < image.cols; ++x) row[x] = static_cast<float>(cvFloor(row[x] / step) * step);
    }
  }
  return image;
}

/// Lines of print in many sizes and turns, some of them in frames.
cv::Mat text(Sheet& sheet) {
  cv::Mat image = sheet.ground();
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789 .,:;-+/#%&@[](){}|=";
  const int lines = sheet.random.integer(4, 24);
  for (int i = 0; i < lines; ++i) {
    std::string line;
    const int length = sheet.random.integer(1, 24);
    for (int k = 0; k < length; ++k) {
      line += letters[static_cast<std::size_t>(sheet.random.integer(0, static_cast<int>(letters.size()) - 1))];
    }
    const int font = sheet.random.integer(0, 7);
    const double scale = sheet.random.uniform(0.3, 2.5);
    const int thickness = sheet.random.integer(1, 5);
    const cv::Scalar ink(sheet.level());
    const cv::Point2f at = sheet.point();
    cv::putText(image, line, at, font, scale, ink, thickness, cv::LINE_AA);
    if (!sheet.random.chance(0.3)) continue;
    int below = 0;
    const cv::Size box = cv::getTextSize(line, font, scale, thickness, &below);
    const int room = 2 + sheet.random.integer(0, 8);
    cv::rectangle(image,
                  cv::Rect(cv::Point(at) - cv::Point(room, box.height + room),
                           cv::Size(box.width + 2 * room, box.height + below + 2 * room)),
                  ink, thickness);
  }
  cv::Mat turned;
  const double angle = sheet.random.uniform(0, 360);
  const cv::Point2f middle(static_cast<float>(sheet.size.width) / 2, static_cast<float>(sheet.size.height) / 2);
  cv::warpAffine(image, turned, cv::getRotationMatrix2D(middle, angle, 1), sheet.size, cv::INTER_LINEAR,
                 cv::BORDER_REFLECT);
  return turned;
}

/// A few squares of two tones, `least` px wide and more, each as `draw` makes it of them.
template <typename Draw>
cv::Mat squares(Sheet& sheet, double least, const Draw& draw) {
  cv::Mat image = sheet.ground();
  const int things = sheet.random.integer(1, 6);
  for (int i = 0; i < things; ++i) {
    const double dark = sheet.random.uniform(5, 120);
    const double light = dark + sheet.random.uniform(20, 130);
    const cv::Mat square = draw(dark, light);
    sheet.place(image, square, sheet.random.uniform(least, 0.9 * sheet.size.height));
  }
  return image;
}

/// Chessboards, windows, nested squares, bars and dots: regular squares, seen at a slant.
cv::Mat grids(Sheet& sheet) {
  return squares(sheet, 24, [&](double dark, double light) {
    const int n = sheet.random.integer(4, 14);
    const int kind = sheet.random.integer(0, 4);
    const int period = sheet.random.integer(2, 4);
    return cells(n, [&](int x, int y) {
      const int ring = std::min({x, y, n - 1 - x, n - 1 - y});
      const bool lit = kind == 0   ? (x + y) % 2 == 0
                       : kind == 1 ? x % period == 0 || y % period == 0
                       : kind == 2 ? ring % 2 == 0
                       : kind == 3 ? x % period == 0
                                   : x % period != 0 && y % period != 0;
      return lit ? light : dark;
    });
  });
}

/// Random cells without a border around them, as in crosswords and the codes of other makes.
cv::Mat random_cells(Sheet& sheet) {
  return squares(sheet, 40, [&](double dark, double light) {
    const double share = sheet.random.uniform(0.2, 0.8);
    return cells(sheet.random.integer(8, 33),
                 [&](int /*x*/, int /*y*/) { return sheet.random.chance(share) ? light : dark; });
  });
}

/// Markers of one family, on their light margin.
cv::Mat markers(Sheet& sheet, const MarkerFamily& family) {
  cv::Mat image = sheet.ground();
  const int things = sheet.random.integer(1, 5);
  for (int i = 0; i < things; ++i) {
    const int id = sheet.random.integer(0, static_cast<int>(family.codes.size()) - 1);
    const std::vector<u8> pattern = marker_pattern(family, id);
    const double dark = sheet.random.uniform(5, 60);
    const double light = dark + sheet.random.uniform(30, 180);
    const int inner = family.total_width;
    const cv::Mat square = cells(inner + 2, [&](int x, int y) {
      if (x < 1 || y < 1 || x > inner || y > inner) return light;
      return pattern[static_cast<std::size_t>((y - 1) * inner + x - 1)] != 0 ? light : dark;
    });
    sheet.place(image, square, sheet.random.uniform(24, 0.6 * sheet.size.height));
  }
  return image;
}

/// A part of a photograph, turned, mirrored, and lit otherwise.
cv::Mat cut(Sheet& sheet, const GrayImage& photo) {
  const cv::Mat whole = as_mat(photo.view());
  const double x = sheet.random.uniform(0, whole.cols);
  const double y = sheet.random.uniform(0, whole.rows);
  const cv::Point2f middle(static_cast<float>(x), static_cast<float>(y));
  const double angle = sheet.random.uniform(0, 360);
  const double scale = sheet.random.uniform(0.4, 2.5);
  cv::Mat to_image = cv::getRotationMatrix2D(middle, angle, scale);
  to_image.at<double>(0, 2) += sheet.size.width / 2.0 - middle.x;
  to_image.at<double>(1, 2) += sheet.size.height / 2.0 - middle.y;
  cv::Mat image;
  cv::warpAffine(whole, image, to_image, sheet.size, cv::INTER_LINEAR, cv::BORDER_REFLECT);
  if (sheet.random.chance(0.5)) cv::flip(image, image, 1);
  const double gain = sheet.random.uniform(0.3, 1.3);
  const double offset = sheet.random.uniform(-20, 40);
  image.convertTo(image, CV_32F, gain, offset);
  return image;
}

}  // namespace

EmptyPictures::EmptyPictures(std::vector<const MarkerFamily*> families, const std::vector<std::string>& photos)
    : families_(std::move(families)), kinds_({"noise", "texture", "text", "grids", "cells", "families", "room"}) {
  for (const std::string& path : photos) photos_.push_back(read_gray_image(path));
  if (!photos_.empty()) kinds_.emplace_back("photos");
}

EmptyPicture EmptyPictures::make(const std::string& kind, int number) {
  const bool is_large = number % 8 == 7;
  const cv::Size size = is_large ? cv::Size(640, 480) : cv::Size(320, 240);
  u64 seed = sim::scatter(static_cast<u64>(number));
  for (const char letter : kind) seed = sim::scatter(seed ^ static_cast<u64>(letter));
  Sheet sheet(seed, size);
  if (kind == "noise") return {sheet.seen(noise(sheet)), nullptr};
  if (kind == "texture") return {sheet.seen(texture(sheet)), nullptr};
  if (kind == "text") return {sheet.seen(text(sheet)), nullptr};
  if (kind == "grids") return {sheet.seen(grids(sheet)), nullptr};
  if (kind == "cells") return {sheet.seen(random_cells(sheet)), nullptr};
  if (kind == "families") {
    const MarkerFamily& shown = *families_[static_cast<std::size_t>(number) % families_.size()];
    return {sheet.seen(markers(sheet, shown)), &shown};
  }
  if (kind == "photos" && !photos_.empty()) {
    return {sheet.seen(cut(sheet, photos_[static_cast<std::size_t>(number) % photos_.size()])), nullptr};
  }
  if (kind != "room") throw Error("\"" + kind + "\" is no kind of picture");
  sim::Scene scene = sim::corpus_scene("cluttered", number, size.width, size.height);
  scene.markers.clear();
  std::unique_ptr<sim::Renderer>& renderer = is_large ? large_ : small_;
  if (!renderer) renderer = std::make_unique<sim::Renderer>(scene.camera);
  return {renderer->render(scene), nullptr};
}

}  // namespace berth::bench
