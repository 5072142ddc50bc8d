#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "berth/image.hpp"
#include "navset/render.hpp"

namespace berth::navset {

enum class BackdropKind { lab, station, earth, stars, abstract, photo };
const char* name_of(BackdropKind kind);

/// Pictures to cut backgrounds from: rendered ones, each a function of its number alone, drawn when first asked for,
/// and grey photographs from a folder. Safe to use from several threads.
class Gallery {
 public:
  static constexpr int kRendered = 1000;
  static constexpr int kSide_px = 512;

  /// `photo_folder` holds index.txt, a line "FILE SOURCE" a picture, and the PGM files (training/backgrounds.py makes
  /// it); "" for none. Throws Error where a file is missing or no square 8-bit PGM.
  explicit Gallery(const std::string& photo_folder);

  int count() const { return static_cast<int>(entries_.size()); }
  int photo_count() const { return count() - kRendered; }
  /// 64-bit FNV-1a of all photographs' pixels, in order.
  u64 photo_hash() const { return photo_hash_; }

  BackdropKind kind(int index) const { return entry(index).kind; }
  /// "lab-17", or a photograph's file name without its ending.
  const std::string& name(int index) const { return entry(index).name; }
  /// Whether the `disjoint` set's test part owns it: three in ten, all crops of one photograph on the same side.
  bool held_out(int index) const { return entry(index).held_out; }
  View2D<const u8> pixels(int index) const;

 private:
  struct Entry {
    BackdropKind kind;
    std::string name;
    bool held_out;
    mutable std::unique_ptr<std::once_flag> once;
    mutable GrayImage image;
  };
  const Entry& entry(int index) const { return entries_[static_cast<std::size_t>(index)]; }
  void read_photos(const std::string& folder);

  std::vector<Entry> entries_;
  u64 photo_hash_ = 0;
};

/// Renders backdrop `number` of a kind, kSide_px square.
GrayImage render_backdrop(BackdropKind kind, u64 number, int side_px);

}  // namespace berth::navset
