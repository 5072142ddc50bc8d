#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "berth.h"
#include "berth/image.hpp"
#include "camera/image_file.hpp"

namespace berth::test {

/// Of the marker in photo().
constexpr double kSide_m = 0.1;

struct Close {
  void operator()(berth_backend* handle) const { berth_backend_close(handle); }
  void operator()(berth_settings* handle) const { berth_settings_free(handle); }
  void operator()(berth_detector* handle) const { berth_detector_close(handle); }
  void operator()(berth_filter* handle) const { berth_filter_close(handle); }
};
template <class T>
using Handle = std::unique_ptr<T, Close>;

/// A struct as a caller hands it over.
template <class T>
T empty() {
  T value{};
  value.struct_size = sizeof(T);
  return value;
}

inline GrayImage photo() { return read_gray_image(BERTH_TEST_DATA "/tag36h11_7.png"); }

inline Handle<berth_settings> settings_for(int width, int height) {
  berth_error error{};
  Handle<berth_settings> settings(berth_settings_new(&error));
  berth_camera camera = empty<berth_camera>();
  berth_camera_paper(&camera, width, height, &error);
  berth_settings_set_camera(settings.get(), &camera, &error);
  berth_settings_set_marker_size(settings.get(), kSide_m, &error);
  EXPECT_EQ(error.code, BERTH_OK) << error.message;
  return settings;
}

inline Handle<berth_detector> detector_of(const berth_settings* settings, int width, int height) {
  berth_error error{};
  // Closed before the detector, which may go on.
  const Handle<berth_backend> backend(berth_backend_open("simd", nullptr, &error));
  Handle<berth_detector> detector(berth_detector_open(backend.get(), settings, width, height, &error));
  EXPECT_EQ(error.code, BERTH_OK) << error.message;
  return detector;
}

}  // namespace berth::test
