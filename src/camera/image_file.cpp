#include "camera/image_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>

#include "camera/bad_input.hpp"
#include "camera/decoders.hpp"

namespace berth {
namespace {

namespace fs = std::filesystem;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

// 16384² pixels of three 16-bit channels, and room for metadata.
constexpr u64 kMaxFileBytes = u64{16384} * 16384 * 6 + (u64{64} << 20);

enum class Format { unknown, png, jpeg, pnm };

Format format_of(const u8* head, std::size_t n) {
  if (n >= 4 && std::memcmp(head, "\x89PNG", 4) == 0) return Format::png;
  if (n >= 2 && head[0] == 0xff && head[1] == 0xd8) return Format::jpeg;
  if (n >= 2 && head[0] == 'P' && (head[1] == '2' || head[1] == '3' || head[1] == '5' || head[1] == '6')) {
    return Format::pnm;
  }
  return Format::unknown;
}

Error unreadable(const std::string& path, int error) {
  const std::string remedy = error == ENOENT   ? "check the name"
                             : error == EACCES ? "give read permission"
                                               : "check the file and its disk";
  return Error(path + ": the file cannot be read (" + std::generic_category().message(error) + "); " + remedy);
}

}  // namespace

void check_image_size(u64 width, u64 height, const std::string& name) {
  const auto check = [&](const char* field, u64 value) {
    if (value >= 1 && value <= u64{kMaxImageSide}) return;
    throw bad_field(name, field, std::to_string(value),
                    value == 0 ? "the image must have at least 1 pixel a side, write it again"
                               : "at most " + std::to_string(kMaxImageSide) +
                                     " pixels a side are supported, scale or crop the image");
  };
  check("width", width);
  check("height", height);
}

GrayImage read_gray_image(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) throw Error(path + ": is a folder, not an image; name an image file in it");
  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) throw unreadable(path, errno);
  // The first bytes decide, so that a large file of another kind is not read whole.
  std::vector<u8> bytes(16);
  errno = 0;
  std::size_t n = std::fread(bytes.data(), 1, bytes.size(), file.get());
  if (std::ferror(file.get())) throw unreadable(path, errno);
  if (n == 0) throw Error(path + ": the file is empty (0 bytes); copy or record it again");
  const Format format = format_of(bytes.data(), n);
  if (format == Format::unknown) {
    throw Error(path + ": the content is no PNG, JPEG or PNM (P2, P3, P5, P6) image; convert it, e.g. to PNG");
  }
  while (n == bytes.size()) {
    if (n > kMaxFileBytes) {
      throw bad_field(path, "file size", "more than " + std::to_string(kMaxFileBytes) + " bytes",
                      "no image of a supported size needs that, check the file");
    }
    bytes.resize(2 * n < 65536 ? 65536 : 2 * n);
    n += std::fread(bytes.data() + n, 1, bytes.size() - n, file.get());
    if (std::ferror(file.get())) throw unreadable(path, errno);
  }
  bytes.resize(n);
  if (format == Format::png) return decode_png(bytes, path);
  if (format == Format::jpeg) return decode_jpeg(bytes, path);
  return decode_pnm(bytes, path);
}

bool has_image_name(const std::string& path) {
  const std::size_t dot = path.find_last_of("./");
  if (dot == std::string::npos || path[dot] != '.') return false;
  std::string ending = path.substr(dot + 1);
  for (char& c : ending) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  for (const char* known : {"png", "jpg", "jpeg", "pgm", "ppm", "pnm"}) {
    if (ending == known) return true;
  }
  return false;
}

namespace {

template <class Iterator>
void collect_images(const std::string& folder, std::vector<std::string>& images) {
  std::error_code error;
  Iterator entry(folder, error);
  for (; !error && entry != Iterator(); entry.increment(error)) {
    std::error_code ignored;
    if (has_image_name(entry->path().string()) && !entry->is_directory(ignored)) {
      images.push_back(entry->path().string());
    }
  }
  if (error) throw unreadable(folder, error.value());
}

}  // namespace

std::vector<std::string> list_images(const std::string& folder, bool recursive) {
  std::vector<std::string> images;
  if (recursive) {
    collect_images<fs::recursive_directory_iterator>(folder, images);
  } else {
    collect_images<fs::directory_iterator>(folder, images);
  }
  if (images.empty()) {
    throw Error(folder + ": the folder holds no image (.png .jpg .jpeg .pgm .ppm .pnm); name another" +
                (recursive ? "" : " or search its subfolders too"));
  }
  std::sort(images.begin(), images.end());
  return images;
}

}  // namespace berth
