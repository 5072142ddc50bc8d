#pragma once

#include <array>
#include <string>
#include <vector>

#include "berth/types.hpp"

namespace berth {

/// One image of a navigation set and the truth of it (training/README.md). Image coordinates in px of the image.
struct LabelledImage {
  std::size_t index = 0;  // in images.u8
  bool present = false;
  std::string subject;
  double visible = 0;  // share of the target
  double d = 0;        // circumscribed diameter
  double x = 0;
  double y = 0;
  double depth_m = 0;
  std::array<int, 4> box{};  // of what is visible: left, top, right, bottom, the last ones included
  std::string light;
  std::string background;
  std::string livery;  // of a target or of what resembles one
};

/// A set that berth_navset wrote: images.u8, u8[count, side, side], and labels.csv.
class LabelledSet {
 public:
  /// Reads the labels of a part: "train", "test" or "all". Throws Error naming the file and what is wrong with it.
  LabelledSet(const std::string& folder, const std::string& part, int side);

  const std::vector<LabelledImage>& images() const { return images_; }
  /// Reads one image's side × side bytes. Throws Error.
  void read(const LabelledImage& image, u8* pixels) const;

 private:
  std::string path_;  // of images.u8
  std::size_t image_bytes_;
  std::vector<LabelledImage> images_;
};

}  // namespace berth
