#pragma once

#include <string>
#include <vector>

#include "berth/image.hpp"

namespace berth {

/// Largest width and height of an image that Berth reads, px: 16384² pixels fill 256 MiB, and pixel indices times 4
/// still fit 32 bits.
constexpr int kMaxImageSide = 16384;

/// Reads a PNG, JPEG or PNM (P2, P3, P5, P6) file as 8-bit gray. The format is told by the content, not the name.
/// Colour: (19595 R + 38470 G + 7471 B + 32768) >> 16, except JPEG, whose stored luma is taken as it is. Alpha and the
/// orientation tag are ignored. 16 bit: value / 257, rounded to nearest; a PNM's `maxval` is scaled to 255 likewise.
/// Throws Error "PATH: what is wrong; what to do" for a file that cannot be read, is empty, damaged, cut short, of
/// another format, or larger than kMaxImageSide (told from the header, before any pixel is decoded).
GrayImage read_gray_image(const std::string& path);

/// Whether the name ends like an image: .png .jpg .jpeg .pgm .ppm .pnm, in any case.
bool has_image_name(const std::string& path);

/// The images of a folder (by name), sorted by the bytes of their path; with `recursive` those of its subfolders too.
/// Throws Error when the folder cannot be read or holds no image.
std::vector<std::string> list_images(const std::string& folder, bool recursive);

}  // namespace berth
