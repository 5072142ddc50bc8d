#include "camera/bad_input.hpp"
#include "camera/decoders.hpp"

namespace berth {
namespace {

bool is_space(u8 c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

class PnmReader {
 public:
  PnmReader(const std::vector<u8>& bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  /// The next unsigned number; '#' starts a comment up to the end of its line.
  u64 number(const char* field) {
    while (at_ < bytes_.size() && (is_space(bytes_[at_]) || bytes_[at_] == '#')) {
      if (bytes_[at_] == '#') {
        while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
      } else {
        ++at_;
      }
    }
    if (at_ == bytes_.size()) {
      throw bad_field(name_, field, "missing",
                      "the PNM is cut short (" + std::to_string(bytes_.size()) + " bytes), copy it again");
    }
    const std::size_t start = at_;
    u64 value = 0;
    while (at_ < bytes_.size() && bytes_[at_] >= '0' && bytes_[at_] <= '9' && value < 1000000000) {
      value = value * 10 + static_cast<u64>(bytes_[at_++] - '0');
    }
    if (at_ == start || (at_ < bytes_.size() && !is_space(bytes_[at_]) && bytes_[at_] != '#')) {
      throw bad_field(name_, field, "no number at byte " + std::to_string(start), "write the PNM again");
    }
    return value;
  }

  u32 sample(bool ascii, u32 maxval) {
    u32 value = 0;
    if (ascii) {
      value = static_cast<u32>(number("pixels"));
    } else {
      value = bytes_[at_++];
      if (maxval > 255) value = value << 8 | bytes_[at_++];
    }
    if (value > maxval) {
      throw bad_field(name_, "pixels", std::to_string(value) + ", above the header's maxval " + std::to_string(maxval),
                      "write the PNM again");
    }
    return value;
  }

  void start_of_binary_pixels(u64 needed) {
    ++at_;  // exactly one white-space byte follows maxval
    const u64 there = at_ < bytes_.size() ? bytes_.size() - at_ : 0;
    if (there < needed) {
      throw bad_field(name_, "pixels",
                      std::to_string(there) + " bytes where the header promises " + std::to_string(needed),
                      "the PNM is cut short, copy it again");
    }
  }

  void skip(std::size_t bytes) { at_ += bytes; }

 private:
  const std::vector<u8>& bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

}  // namespace

GrayImage decode_pnm(const std::vector<u8>& bytes, const std::string& name) {
  const bool ascii = bytes[1] == '2' || bytes[1] == '3';
  const u64 channels = bytes[1] == '3' || bytes[1] == '6' ? 3 : 1;
  PnmReader reader(bytes, name);
  reader.skip(2);
  const u64 width = reader.number("width");
  const u64 height = reader.number("height");
  check_image_size(width, height, name);
  const u64 maxval_given = reader.number("maxval");
  if (maxval_given < 1 || maxval_given > 65535) {
    throw bad_field(name, "maxval", std::to_string(maxval_given), "it must lie in 1…65535, write the PNM again");
  }
  const u32 maxval = static_cast<u32>(maxval_given);
  if (!ascii) reader.start_of_binary_pixels(width * height * channels * (maxval > 255 ? 2 : 1));
  GrayImage gray(static_cast<int>(width), static_cast<int>(height));
  for (int y = 0; y < gray.height(); ++y) {
    u8* row = gray.view().row(y);
    for (int x = 0; x < gray.width(); ++x) {
      u32 value = reader.sample(ascii, maxval);
      if (channels == 3) {
        const u32 green = reader.sample(ascii, maxval);
        value = luma(value, green, reader.sample(ascii, maxval));
      }
      row[x] = static_cast<u8>((value * 255 + maxval / 2) / maxval);
    }
  }
  return gray;
}

}  // namespace berth
