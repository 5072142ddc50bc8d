#include "camera/image_file.hpp"
#include "camera/sources.hpp"

namespace berth {
namespace {

class ImagesSource final : public Source {
 public:
  explicit ImagesSource(std::vector<std::string> paths) : paths_(std::move(paths)) {}

  std::optional<SourceFrame> next() override {
    if (at_ == paths_.size()) return std::nullopt;
    SourceFrame frame;
    frame.stamp.sequence = at_;
    frame.label = paths_[at_];
    // Moved on before reading: after an Error the next call goes on with the next file.
    ++at_;
    frame.image = read_gray_image(frame.label);
    return frame;
  }

  std::optional<std::size_t> size() const override { return paths_.size(); }

 private:
  std::vector<std::string> paths_;
  std::size_t at_ = 0;
};

}  // namespace

std::unique_ptr<Source> open_images(std::vector<std::string> paths) {
  return std::make_unique<ImagesSource>(std::move(paths));
}

}  // namespace berth
