#include "output_file.hpp"

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "berth/error.hpp"

namespace berth::cli {

void write_file(const std::string& path, const std::string& what, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  file.close();
  if (!file) throw Error(path + ": " + what + " cannot be written; check the folder, its permissions and space");
}

void write_png(const std::string& path, const std::string& what, const cv::Mat& picture) {
  // Encoded here and written as bytes: cv::imwrite tells neither which part failed nor that the disk is full.
  std::vector<unsigned char> png;
  if (!cv::imencode(".png", picture, png)) throw Error(path + ": the picture cannot be encoded as PNG");
  write_file(path, what, std::string(png.begin(), png.end()));
}

void make_folder(const std::string& path, const std::string& remedy) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) throw Error(path + ": the folder cannot be made (" + error.message() + "); " + remedy);
}

}  // namespace berth::cli
