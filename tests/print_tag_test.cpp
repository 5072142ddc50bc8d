// Printed markers: what is on the page is read back, at the size that was asked for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "berth/bundle.hpp"
#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "support/command_run.hpp"
#include "support/scratch_folder.hpp"
#include "tag_sheet.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kDots = 4;  // a millimetre

GrayImage rasterised(const cli::PrintPage& page, double width_mm, double height_mm) {
  GrayImage image(static_cast<int>(width_mm * kDots), static_cast<int>(height_mm * kDots));
  const auto view = image.view();
  std::fill_n(view.data, static_cast<std::ptrdiff_t>(view.width) * view.height, u8{250});
  for (const cli::PrintPage::Rectangle& r : page.rectangles()) {
    const auto dot = [](double mm) { return static_cast<int>(std::lround(mm * kDots)); };
    for (int y = dot(r.y); y < dot(r.y + r.height); ++y) {
      std::fill_n(view.data + static_cast<std::ptrdiff_t>(y) * view.width + dot(r.x), dot(r.x + r.width) - dot(r.x),
                  u8{10});
    }
  }
  return image;
}

TEST(TagSheet, IsReadBackAtItsSize) {
  for (const char* name : {"tag36h11", "tagStandard41h12", "tagCircle21h7", "aruco5x5_100"}) {
    SCOPED_TRACE(name);
    cli::TagSheet sheet;
    sheet.family = &family(name);
    sheet.first_id = 3;
    sheet.columns = 2;
    sheet.rows = 3;
    sheet.side_mm = 5.0 * sheet.family->border_width;
    const GrayImage image = rasterised(cli::draw_sheet(sheet), sheet.width_mm, sheet.height_mm);
    const auto backend = open_backend("simd");
    DetectorConfig config;
    config.families = {name};
    Detector detector(*backend, image.width(), image.height(), config);
    const FrameResult& result = detector.detect(image.view());
    ASSERT_EQ(result.detections.size(), 6u);
    std::vector<const Detection*> by_id(6);
    for (const Detection& d : result.detections) by_id.at(static_cast<std::size_t>(d.id - 3)) = &d;
    for (std::size_t i = 0; i < 6; ++i) {
      ASSERT_NE(by_id[i], nullptr) << i;
      const auto& c = by_id[i]->corners;
      EXPECT_NEAR(c[3][0] - c[0][0], sheet.side_mm * kDots, 0.5);  // upright: upper left to upper right
      EXPECT_NEAR(c[1][1] - c[0][1], sheet.side_mm * kDots, 0.5);
      const auto& first = by_id[0]->corners[0];
      const std::size_t column = i % 2, row = i / 2;
      EXPECT_NEAR(c[0][0] - first[0], static_cast<double>(column) * sheet.pitch_mm() * kDots, 1);
      EXPECT_NEAR(c[0][1] - first[1], static_cast<double>(row) * sheet.pitch_mm() * kDots, 1);
    }
  }
}

TEST(BundleSheet, IsReadBackInItsPlaces) {
  for (const char* name : {"approach", "nested"}) {
    SCOPED_TRACE(name);
    Bundle bundle = read_bundles(std::string(BERTH_SOURCE_DIR) + "/bundles/" + name + ".yaml").at(0);
    BundleMarker& last = bundle.markers.back();  // on its side: x is down on the page, y left
    const std::array<double, 9> on_side = {0, -1, 0, -1, 0, 0, 0, 0, -1};
    last.pose.R = on_side;
    const GrayImage image = rasterised(cli::draw_bundle(bundle, 297, 420), 297, 420);
    const auto backend = open_backend("simd");
    DetectorConfig config;
    config.families = {last.family->name};
    Detector detector(*backend, image.width(), image.height(), config);
    std::vector<Detection> found = detector.detect(image.view()).detections;
    ASSERT_EQ(found.size(), bundle.markers.size());
    std::sort(found.begin(), found.end(), [](const Detection& a, const Detection& b) { return a.id < b.id; });
    for (std::size_t i = 0; i < found.size(); ++i) {
      const BundleMarker& marker = bundle.markers[i];
      // The file's y is up, the page's down.
      EXPECT_NEAR(found[i].center[0] - found[0].center[0], marker.pose.t[0] * 1000 * kDots, 1);
      EXPECT_NEAR(found[i].center[1] - found[0].center[1], -marker.pose.t[1] * 1000 * kDots, 1);
      const auto& c = found[i].corners;
      const std::size_t along = &marker == &last ? 1 : 0;
      EXPECT_NEAR(c[3][along] - c[0][along], marker.size_m * 1000 * kDots, 0.7) << "its x";
    }
  }
}

std::string complaint_about(const Bundle& bundle) {
  try {
    cli::draw_bundle(bundle, 297, 420);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(BundleSheet, IsRefusedWhereItCannotBePrinted) {
  const Bundle nested = read_bundles(std::string(BERTH_SOURCE_DIR) + "/bundles/nested.yaml").at(0);
  EXPECT_EQ(complaint_about(nested), "");
  Bundle bundle = nested;
  bundle.markers[1].pose.t[0] = 0.02;
  EXPECT_THAT(complaint_about(bundle), HasSubstr("tagCustom48h12 1 stands on tagCustom48h12 0"));
  bundle.markers[1].pose.t = {0, 0, 0.01};
  EXPECT_THAT(complaint_about(bundle), HasSubstr("not in the plane"));
  bundle = nested;
  bundle.markers[1].size_m = bundle.markers[0].size_m;
  EXPECT_THAT(complaint_about(bundle), HasSubstr("overlap"));
  bundle.markers[1].pose.t = {1, 0, 0};
  EXPECT_THAT(complaint_about(bundle), HasSubstr("larger --paper"));
  bundle.markers[1].pose.R = {0.8, 0.6, 0, 0.6, -0.8, 0, 0, 0, -1};
  EXPECT_THAT(complaint_about(bundle), HasSubstr("turned by quarters"));
}

TEST(CliPrintTag, PrintsABundle) {
  const test::ScratchFolder folder;
  const std::string file = std::string(BERTH_SOURCE_DIR) + "/bundles/nested.yaml";
  const auto run = test::run_berth({"print-tag", "--bundle", file, "--paper", "a3", "--out", folder / "board.pdf"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(test::text_of(folder / "board.pdf"), StartsWith("%PDF-1.6"));
  EXPECT_THAT(run.out, HasSubstr("bundle nested, 2 markers"));
  EXPECT_EQ(test::run_berth({"print-tag", "--out", folder / "no.pdf"}).exit_code, 2);
  const auto both = test::run_berth({"print-tag", "tag36h11", "7", "--bundle", file, "--out", folder / "no.pdf"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("leave FAMILY"));
}

TEST(CliPrintTag, WritesAPageOfTrueSize) {
  const test::ScratchFolder folder;
  const auto run = test::run_berth({"print-tag", "tag36h11", "7", "--size", "0.08", "--out", folder / "tag.svg"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string svg = test::text_of(folder / "tag.svg");
  EXPECT_THAT(svg, StartsWith("<svg "));
  EXPECT_THAT(svg, HasSubstr("width=\"210.0000mm\" height=\"297.0000mm\" viewBox=\"0 0 210.0000 297.0000\""));
  EXPECT_THAT(svg, HasSubstr(">80 mm</text>"));
  EXPECT_THAT(svg, HasSubstr("tag36h11 7, side 80 mm"));
}

// A reader finds every object where the table says it is.
TEST(CliPrintTag, WritesAWellFormedPdf) {
  const test::ScratchFolder folder;
  const auto run = test::run_berth(
      {"print-tag", "aruco4x4_50", "3", "--size", "0.1", "--paper", "letter", "--out", folder / "tag.pdf"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string pdf = test::text_of(folder / "tag.pdf");
  EXPECT_THAT(pdf, StartsWith("%PDF-1."));
  EXPECT_THAT(pdf, HasSubstr("/MediaBox [0 0 612.0000 792.0000]"));
  const std::size_t start = std::strtoul(pdf.c_str() + pdf.rfind("startxref") + 10, nullptr, 10);
  ASSERT_EQ(pdf.compare(start, 7, "xref\n0 "), 0);
  const int count = std::atoi(pdf.c_str() + start + 7);
  ASSERT_EQ(count, 6);
  std::size_t entry = pdf.find("f \n", start) + 3;
  for (int i = 1; i < count; ++i, entry += 20) {
    const std::size_t at = std::strtoul(pdf.c_str() + entry, nullptr, 10);
    const std::string head = std::to_string(i) + " 0 obj";
    EXPECT_EQ(pdf.compare(at, head.size(), head), 0) << i;
  }
  const std::size_t stream = pdf.find("stream\n") + 7;
  const std::size_t length = std::strtoul(pdf.c_str() + pdf.find("/Length ") + 8, nullptr, 10);
  EXPECT_EQ(pdf.compare(stream + length, 9, "endstream"), 0);
}

TEST(CliPrintTag, KeepsTheRulerOnASmallPageAndItsOwnGap) {
  const test::ScratchFolder folder;
  const std::string out = folder / "tag.svg";
  ASSERT_EQ(
      test::run_berth({"print-tag", "tag36h11", "7", "--size", "0.02", "--paper", "148x210", "--out", out}).exit_code,
      0);
  EXPECT_THAT(test::text_of(out), HasSubstr("x1=\"40.0000\" y1="));  // the ruler: 148 - 8 - 100
  const std::vector<std::string> tight = {"print-tag", "aruco5x5_100", "0",     "--size", "0.04",
                                          "--grid",    "2x1",          "--out", out,      "--gap"};
  auto arguments = tight;
  arguments.push_back("0.01714");
  const auto refused = test::run_berth(arguments);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("give 0.01715 or more"));
  arguments.back() = "0.01715";
  EXPECT_EQ(test::run_berth(arguments).exit_code, 0);
}

TEST(CliPrintTag, SaysWhatDoesNotFit) {
  const auto refused = [](std::vector<std::string> arguments, const char* words) {
    arguments.insert(arguments.begin(), "print-tag");
    const auto run = test::run_berth(arguments);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.err, HasSubstr(words));
  };
  const test::ScratchFolder folder;
  const std::string out = folder / "tag.pdf";
  refused({"tag36h11", "7", "--size", "0.3", "--out", out}, "choose larger --paper");
  refused({"tag36h11", "900", "--size", "0.05", "--out", out}, "no marker 900");
  refused({"tag36h12", "0", "--size", "0.05", "--out", out}, "tag36h11");
  refused({"tag36h11", "586", "--size", "0.01", "--grid", "2x1", "--out", out}, "no marker 587");
  refused({"tag36h11", "-1", "--size", "0.05", "--out", out}, "ids are 0 to 586");
  for (const char* grid : {"2by2", "2.5x3", "0x1", "2x3x", "101x1"}) {
    refused({"tag36h11", "0", "--size", "0.05", "--grid", grid, "--out", out}, "3x4");
  }
  refused({"tag36h11", "0", "--size", "0.05", "--paper", "infx100", "--out", out}, "a4, a3, letter");
  refused({"tag36h11", "0", "--size", "0.02", "--paper", "100x200", "--out", out}, "choose larger --paper");
  refused({"tag36h11", "0", "--size", "0.05", "--grid", "2x2", "--gap", "0.001", "--out", out}, "no module of white");
  refused({"tag36h11", "0", "--size", "0.05", "--paper", "b5", "--out", out}, "a4, a3, letter");
  refused({"tag36h11", "0", "--size", "0.05", "--out", folder / "tag.png"}, ".pdf or .svg");
}

}  // namespace
}  // namespace berth
