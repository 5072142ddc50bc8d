#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "camera/sources.hpp"
#include "verify/faulty_camera.hpp"

namespace berth::cli {

/// A faulty camera as `berth run` has cameras, and what each of its frames is, for whoever judges the results.
class SoakSource final : public CameraSource {
 public:
  /// The film outlives it.
  SoakSource(FaultyFilm& film, const CameraModel& camera);

  std::optional<SourceFrame> next() override;
  SourceHealth health() const override { return camera_->health(); }
  std::optional<CameraModel> camera() const override { return model_; }
  int width() const override { return camera_->width(); }
  int height() const override { return camera_->height(); }
  FrameStamp await() override;
  bool fetch(View2D<u8> image) override;
  std::string label_of(const FrameStamp& stamp) const override { return camera_->label_of(stamp); }

  /// What was handed on by that number; none where nothing was. Forgets all before it. From any thread.
  std::optional<FilmedFrame> handed_on(u64 sequence);
  u64 handed_on_in_all() const;

 private:
  void note(u64 sequence);

  FaultyFilm& film_;
  const CameraModel model_;
  const std::unique_ptr<CameraSource> camera_;
  u64 awaited_ = 0;
  mutable std::mutex mutex_;
  std::map<u64, FilmedFrame> frames_;
  u64 handed_on_ = 0;
};

}  // namespace berth::cli
