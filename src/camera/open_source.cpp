#include <filesystem>

#include "berth/error.hpp"
#include "camera/image_file.hpp"
#include "camera/sources.hpp"
#include "sim/scenario.hpp"

namespace berth {
namespace {

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

}  // namespace

bool names_camera(const std::string& spec) {
  return spec.rfind("v4l2:", 0) == 0 || spec.rfind("aravis:", 0) == 0 || spec.rfind("gst:", 0) == 0;
}

std::unique_ptr<Source> open_source(const std::string& spec) {
  const std::size_t colon = spec.find(':');
  const std::string kind = colon == std::string::npos ? "" : spec.substr(0, colon);
  const std::string rest = colon == std::string::npos ? "" : spec.substr(colon + 1);
  if (kind == "sim") return open_scenario(rest);
  if (kind == "dir") return open_images(list_images(rest, false));
  if (kind == "file") return open_images({rest});
  if (kind == "video") return open_video(rest);
  if (kind == "mcap") return open_mcap(rest);
  if (kind == "v4l2") return open_v4l2(parse_v4l2(rest));
  if (kind == "aravis") return open_aravis(parse_aravis(rest));
  if (kind == "gst") return open_gst(parse_gst(rest));

  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(spec, error);
  if (!std::filesystem::exists(status)) {
    throw Error(spec +
                ": there is no such file or folder; give a path, or a source as sim:FILE, dir:DIR, file:IMAGE, "
                "video:FILE, mcap:FILE, v4l2:CAMERA, aravis:CAMERA or gst:PIPELINE");
  }
  if (std::filesystem::is_directory(status)) return open_images(list_images(spec, false));
  if (ends_with(spec, ".toml")) return open_scenario(spec);
  if (ends_with(spec, ".mcap")) return open_mcap(spec);
  if (has_image_name(spec)) return open_images({spec});
  return open_video(spec);
}

}  // namespace berth
