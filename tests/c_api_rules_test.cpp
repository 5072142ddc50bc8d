// The rules of include/berth.h: errors, handles, structs of other versions, and what libberth.so shows.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "berth.h"
#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "support/c_handles.hpp"
#include "support/command_output.hpp"
#include "support/command_run.hpp"

namespace berth {
namespace {

using test::detector_of;
using test::empty;
using test::Handle;
using test::photo;
using test::settings_for;
using testing::HasSubstr;

TEST(CApi, TheFirstFailureStaysAndNullHandlesAreNoCrash) {
  berth_error error{};
  berth_backend* backend = berth_backend_open("quantum", nullptr, &error);
  EXPECT_EQ(backend, nullptr);
  EXPECT_EQ(error.code, BERTH_SETUP_FAILED);
  const std::string first = error.message;
  EXPECT_THAT(first, HasSubstr("no backend 'quantum'"));
  EXPECT_EQ(berth_detector_open(backend, nullptr, 640, 480, &error), nullptr);
  EXPECT_EQ(berth_detector_detect(nullptr, nullptr, 0, nullptr, &error), BERTH_BAD_ARGUMENT);
  EXPECT_EQ(berth_detector_markers(nullptr), 0u);
  EXPECT_EQ(berth_backend_description(nullptr), nullptr);
  EXPECT_EQ(error.message, first);
  error.code = BERTH_OK;
  EXPECT_EQ(berth_settings_add_family(nullptr, "tag36h11", &error), BERTH_BAD_ARGUMENT);
  EXPECT_STREQ(error.message, "settings is NULL");
  berth_detector_close(nullptr);
  berth_settings_free(nullptr);
  berth_backend_close(nullptr);
  berth_filter_close(nullptr);
}

TEST(CApi, WhatIsWrongIsNamedWithItsRemedy) {
  const Handle<berth_settings> settings = settings_for(320, 240);
  const Handle<berth_backend> backend(berth_backend_open(nullptr, nullptr, nullptr));
  ASSERT_NE(backend, nullptr);
  EXPECT_THAT(berth_backend_description(backend.get()), HasSubstr(" on "));
  const Handle<berth_detector> detector(berth_detector_open(backend.get(), settings.get(), 320, 240, nullptr));
  const GrayImage image = photo();
  const auto expect = [](berth_code code, const char* part, auto call) {
    berth_error error{};
    call(&error);
    EXPECT_EQ(error.code, code) << error.message;
    EXPECT_THAT(error.message, HasSubstr(part));
  };
  berth_marker marker = empty<berth_marker>();
  expect(BERTH_BAD_ARGUMENT, "there is no frame yet; call berth_detector_detect first",
         [&](berth_error* error) { berth_detector_marker(detector.get(), 0, &marker, error); });
  ASSERT_EQ(berth_detector_detect(detector.get(), image.view().data, 320, nullptr, nullptr), BERTH_OK);
  expect(BERTH_BAD_ARGUMENT, "marker 1 is not there; the frame has 1",
         [&](berth_error* error) { berth_detector_marker(detector.get(), 1, &marker, error); });
  expect(BERTH_BAD_ARGUMENT, "stride is 319 bytes; rows have 320",
         [&](berth_error* error) { berth_detector_detect(detector.get(), image.view().data, 319, nullptr, error); });
  expect(BERTH_BAD_ARGUMENT, "pixels is NULL",
         [&](berth_error* error) { berth_detector_detect(detector.get(), nullptr, 320, nullptr, error); });
  expect(BERTH_BAD_ARGUMENT, "marker->struct_size is 0; set it to sizeof the struct", [&](berth_error* error) {
    berth_marker forgotten{};
    berth_detector_marker(detector.get(), 0, &forgotten, error);
  });
  expect(BERTH_SETUP_FAILED, "the camera is for images of 320x240, the detector for 640x480",
         [&](berth_error* error) { berth_detector_open(backend.get(), settings.get(), 640, 480, error); });
  expect(BERTH_SETUP_FAILED, "tag36h11",
         [&](berth_error* error) { berth_settings_add_family(settings.get(), "tag36h12", error); });
  expect(BERTH_SETUP_FAILED, "/nowhere/camera.yaml", [&](berth_error* error) {
    berth_camera camera = empty<berth_camera>();
    berth_camera_read(&camera, "/nowhere/camera.yaml", error);
  });
  expect(BERTH_BAD_ARGUMENT, "camera: width and height", [&](berth_error* error) {
    berth_camera camera = empty<berth_camera>();
    berth_settings_set_camera(settings.get(), &camera, error);
  });
  expect(BERTH_BAD_ARGUMENT, "begin one with berth_settings_add_bundle", [&](berth_error* error) {
    const berth_pose place{};
    berth_settings_add_bundle_marker(settings.get(), "tag36h11", 0, 0.1, &place, error);
  });
  expect(BERTH_SETUP_FAILED, "pose filter: marker_size_m is", [&](berth_error* error) {
    berth_filter_settings filter = empty<berth_filter_settings>();
    berth_camera camera = empty<berth_camera>();
    berth_camera_paper(&camera, 320, 240, error);
    filter.camera = &camera;
    berth_filter_open(&filter, error);
  });
}

TEST(CApi, AProgramOfALaterVersionGetsWhatThisOneKnows) {
  struct LaterFrame {
    berth_frame known;
    std::uint64_t later;
  };
  struct LaterStamp {
    berth_stamp known;
    std::uint64_t later;
  };
  const GrayImage image = photo();
  const Handle<berth_settings> settings = settings_for(320, 240);
  const Handle<berth_detector> detector = detector_of(settings.get(), 320, 240);
  LaterStamp stamp{};
  stamp.known.struct_size = sizeof stamp;
  stamp.known.sequence = 5;
  ASSERT_EQ(berth_detector_detect(detector.get(), image.view().data, 320, &stamp.known, nullptr), BERTH_OK);
  LaterFrame frame{};
  frame.known.struct_size = sizeof frame;
  frame.later = 99;
  ASSERT_EQ(berth_detector_frame(detector.get(), &frame.known, nullptr), BERTH_OK);
  EXPECT_EQ(frame.known.sequence, 5u);
  EXPECT_EQ(frame.known.struct_size, sizeof frame);
  EXPECT_EQ(frame.later, 0u);
  stamp.later = 1;
  berth_error error{};
  EXPECT_EQ(berth_detector_detect(detector.get(), image.view().data, 320, &stamp.known, &error), BERTH_BAD_ARGUMENT);
  EXPECT_THAT(error.message, HasSubstr("stamp has members that this library"));
}

TEST(CApi, NamesAreListed) {
  std::vector<std::string> backends, families;
  for (std::size_t i = 0; berth_backend_name(i) != nullptr; ++i) backends.emplace_back(berth_backend_name(i));
  for (std::size_t i = 0; berth_family_name(i) != nullptr; ++i) families.emplace_back(berth_family_name(i));
  EXPECT_EQ(backends, backend_names());
  EXPECT_EQ(families, family_names());
  EXPECT_EQ(berth_version(), std::to_string(BERTH_VERSION_MAJOR) + "." + std::to_string(BERTH_VERSION_MINOR) + "." +
                                 std::to_string(BERTH_VERSION_PATCH));
}

TEST(CApi, TheLibraryShowsTheHeadersFunctionsAndNoMore) {
  // A declaration begins in the first column, with a type in small letters, and has its name before the parenthesis.
  std::set<std::string> declared;
  std::istringstream header(test::text_of(BERTH_SOURCE_DIR "/include/berth.h"));
  for (std::string line; std::getline(header, line);) {
    const std::size_t end = line.find('(');
    if (line.empty() || line[0] < 'a' || line[0] > 'z' || end == std::string::npos) continue;
    declared.insert(line.substr(line.rfind(' ', end) + 1, end - line.rfind(' ', end) - 1));
  }
  const auto [text, status] = test::output_of("nm -D --defined-only --format=posix '" BERTH_C_LIBRARY "'");
  ASSERT_EQ(status, 0);
  std::set<std::string> exported;
  std::istringstream symbols(text);
  for (std::string line; std::getline(symbols, line);) {
    std::string name, kind;
    std::istringstream(line) >> name >> kind;
    if (kind != "A") exported.insert(name.substr(0, name.find('@')));  // A: the version's own name
  }
  EXPECT_GT(declared.size(), 30u);
  EXPECT_EQ(exported, declared);
}

}  // namespace
}  // namespace berth
