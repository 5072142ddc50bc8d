// libjpeg itself rather than OpenCV's wrapper: the wrapper drops libjpeg's warnings, and a file cut in the middle would
// pass as an image whose lower half is gray. It also gives the stored luma without a round trip through colour.
#include <csetjmp>
#include <cstdio>
// jpeglib.h needs <cstdio> before it and jerror.h after it.
// clang-format off
#include <jpeglib.h>
#include <jerror.h>
// clang-format on

#include "camera/bad_input.hpp"
#include "camera/decoders.hpp"

namespace berth {
namespace {

struct Complaints {
  jpeg_error_mgr manager;
  std::jmp_buf jump;
  /// First fatal error or sign of damage; empty while there is none.
  char text[JMSG_LENGTH_MAX];
};

Complaints& complaints_of(j_common_ptr jpeg) { return *reinterpret_cast<Complaints*>(jpeg->err); }

void note(j_common_ptr jpeg) {
  Complaints& complaints = complaints_of(jpeg);
  if (complaints.text[0] == '\0') complaints.manager.format_message(jpeg, complaints.text);
}

[[noreturn]] void on_error(j_common_ptr jpeg) {
  note(jpeg);
  std::longjmp(complaints_of(jpeg).jump, 1);
}

void on_message(j_common_ptr jpeg, int level) {
  if (level >= 0) return;  // trace output
  const int code = jpeg->err->msg_code;
  // Oddities that leave every pixel as it was meant.
  if (code == JWRN_ADOBE_XFORM || code == JWRN_TOO_MUCH_DATA || code == JWRN_JFIF_MAJOR) return;
  note(jpeg);
}

/// libjpeg's C part, apart from objects with destructors, since errors leave it by longjmp. Either step returns whether
/// all is well; complaint() tells what is not.
class JpegReader {
 public:
  explicit JpegReader(const std::vector<u8>& bytes) : bytes_(bytes) {
    jpeg_.err = jpeg_std_error(&complaints_.manager);
    complaints_.manager.error_exit = on_error;
    complaints_.manager.emit_message = on_message;
    complaints_.text[0] = '\0';
  }
  ~JpegReader() { jpeg_destroy_decompress(&jpeg_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  bool read_header() {
    if (setjmp(complaints_.jump)) return false;
    // No earlier: to take up no bytes at all is an error, too.
    jpeg_create_decompress(&jpeg_);
    jpeg_mem_src(&jpeg_, bytes_.data(), static_cast<unsigned long>(bytes_.size()));
    jpeg_read_header(&jpeg_, TRUE);
    return complaints_.text[0] == '\0';
  }
  bool read_rows(View2D<u8> gray) {
    if (setjmp(complaints_.jump)) return false;
    jpeg_.out_color_space = JCS_GRAYSCALE;
    jpeg_.dct_method = JDCT_ISLOW;  // the exact integer transform
    jpeg_start_decompress(&jpeg_);
    while (jpeg_.output_scanline < jpeg_.output_height) {
      JSAMPROW row = gray.row(static_cast<int>(jpeg_.output_scanline));
      jpeg_read_scanlines(&jpeg_, &row, 1);
    }
    jpeg_finish_decompress(&jpeg_);
    return complaints_.text[0] == '\0';
  }
  bool has_luma() const { return jpeg_.jpeg_color_space != JCS_CMYK && jpeg_.jpeg_color_space != JCS_YCCK; }
  u64 width() const { return jpeg_.image_width; }
  u64 height() const { return jpeg_.image_height; }
  const char* complaint() const { return complaints_.text; }

 private:
  const std::vector<u8>& bytes_;
  jpeg_decompress_struct jpeg_ = {};
  Complaints complaints_ = {};
};

}  // namespace

GrayImage decode_jpeg(const std::vector<u8>& bytes, const std::string& name) {
  JpegReader reader(bytes);
  const auto damaged = [&] {
    return Error(name + ": the JPEG is damaged or cut short (" + reader.complaint() + "); copy it again");
  };
  if (!reader.read_header()) throw damaged();
  if (!reader.has_luma()) throw bad_field(name, "color space", "CMYK", "convert the image to gray or RGB");
  check_image_size(reader.width(), reader.height(), name);
  GrayImage gray(static_cast<int>(reader.width()), static_cast<int>(reader.height()));
  if (!reader.read_rows(gray.view())) throw damaged();
  return gray;
}

}  // namespace berth
