#pragma once

#include <cassert>
#include <cstddef>
#include <vector>

#include "berth/types.hpp"

namespace berth {

/// A borrowed image: `height` rows of `width` elements, each row `stride` elements after the one before.
template <class T>
struct View2D {
  T* data = nullptr;
  int width = 0;
  int height = 0;
  int stride = 0;

  T* row(int y) const {
    assert(y >= 0 && y < height);
    return data + static_cast<std::ptrdiff_t>(y) * stride;
  }
  T& at(int x, int y) const {
    assert(x >= 0 && x < width);
    return row(y)[x];
  }
  operator View2D<const T>() const { return {data, width, height, stride}; }
};

/// An owned 8-bit gray image, rows without padding.
class GrayImage {
 public:
  GrayImage() = default;
  GrayImage(int width, int height)
      : width_(width), height_(height), pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  View2D<u8> view() { return {pixels_.data(), width_, height_, width_}; }
  View2D<const u8> view() const { return {pixels_.data(), width_, height_, width_}; }

 private:
  int width_ = 0;
  int height_ = 0;
  std::vector<u8> pixels_;
};

}  // namespace berth
