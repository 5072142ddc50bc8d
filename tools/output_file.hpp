#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace berth::cli {

/// Writes the whole file. Throws Error "PATH: WHAT cannot be written; …", of a full disk too.
void write_file(const std::string& path, const std::string& what, const std::string& bytes);
void write_png(const std::string& path, const std::string& what, const cv::Mat& picture);

/// With all above it. Throws Error that ends in `remedy`.
void make_folder(const std::string& path, const std::string& remedy);

}  // namespace berth::cli
