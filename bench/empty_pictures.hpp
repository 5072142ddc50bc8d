#pragma once

#include <string>
#include <vector>

#include "berth/image.hpp"
#include "berth/marker.hpp"
#include "sim/render.hpp"

namespace berth::bench {

/// A picture in which no marker stands, or one of a family that is not the one looked for.
struct EmptyPicture {
  GrayImage image;
  /// The family of the markers in it; null where there is none.
  const MarkerFamily* shown = nullptr;
};

/// Pictures without end that hold no marker, by kind: what a camera sees that a detector may take for one. The same
/// kind and number are the same picture, whatever was made before. Mostly 320 × 240, each eighth 640 × 480.
class EmptyPictures {
 public:
  /// Families that `families` pictures show; photographs without markers that `photos` cuts from. Throws Error on a
  /// photograph that cannot be read.
  EmptyPictures(std::vector<const MarkerFamily*> families, const std::vector<std::string>& photos);

  /// noise, texture, text, grids, cells, families, room, and photos where there are some.
  const std::vector<std::string>& kinds() const { return kinds_; }
  EmptyPicture make(const std::string& kind, int number);

 private:
  std::vector<const MarkerFamily*> families_;
  std::vector<GrayImage> photos_;
  std::vector<std::string> kinds_;
  // One for each size: the lens is worked out once.
  std::unique_ptr<sim::Renderer> small_, large_;
};

}  // namespace berth::bench
