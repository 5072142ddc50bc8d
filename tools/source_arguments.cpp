#include "source_arguments.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include "berth/error.hpp"
#include "camera/image_file.hpp"
#include "camera/sources.hpp"

namespace berth::cli {

std::unique_ptr<Source> open_arguments(const std::vector<std::string>& images, const std::string& source) {
  if (images.empty() == source.empty()) throw Error("command line: give images, or a --source");
  if (!source.empty()) return open_source(source);
  std::vector<std::string> paths;
  for (const std::string& image : images) {
    std::error_code ignored;
    if (!std::filesystem::is_directory(image, ignored)) {
      paths.push_back(image);
      continue;
    }
    for (std::string& path : list_images(image, false)) paths.push_back(std::move(path));
  }
  return open_images(paths);
}

std::optional<SourceFrame> next_readable(Source& source, Console& console, const InterruptWatch& interrupt) {
  while (!interrupt.came()) {
    try {
      return source.next();
    } catch (const Error& error) {
      console.complain(error.what());
    }
  }
  return std::nullopt;
}

}  // namespace berth::cli
