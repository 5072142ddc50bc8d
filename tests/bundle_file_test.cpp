// Files of bundles: what is read from apriltag_ros' and WPILib's, with whose axes; what is written comes back; and what
// is wrong with a file is said with the file, the value and the remedy.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "berth/bundle.hpp"
#include "sim/geometry.hpp"
#include "sim/random.hpp"
#include "support/command_run.hpp"
#include "support/complaint.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

using test::complaint;
using test::ScratchFolder;
using test::text_of;
using testing::HasSubstr;

double difference(const Mat3& a, const Mat3& b) {
  double worst = 0;
  for (std::size_t i = 0; i < 9; ++i) worst = std::max(worst, std::fabs(a[i] - b[i]));
  return worst;
}

Bundle random_bundle(sim::Random& random) {
  const auto between = [&](double low, double high) { return random.uniform(low, high); };
  Bundle bundle;
  bundle.name = "dock: \"left\"\n#2";
  for (int id = 0; id < 50; ++id) {
    BundleMarker marker;
    marker.family = &family(id % 3 == 0 ? "tag36h11" : "aruco4x4_50");
    marker.id = id;
    marker.size_m = between(0.01, 0.3);
    marker.pose = {sim::rotation(between(-3, 3), between(-3, 3), between(-3, 3)),
                   {between(-1, 1), between(-1, 1), between(-9, 9)}};
    bundle.markers.push_back(marker);
  }
  return bundle;
}

TEST(BundleFile, ComesBackAsItWasWritten) {
  const ScratchFolder folder;
  sim::Random random(7);
  for (int round = 0; round < 20; ++round) {
    Bundle bundle = random_bundle(random);
    if (round % 2 == 0) bundle.deviation_m = random.uniform(1e-6, 1e-3);
    write_bundle(folder / "a.yaml", bundle);
    const std::vector<Bundle> read = read_bundles(folder / "a.yaml");
    ASSERT_EQ(read.size(), 1u);
    EXPECT_EQ(read[0].name, bundle.name);
    EXPECT_EQ(read[0].deviation_m, bundle.deviation_m);
    ASSERT_EQ(read[0].markers.size(), bundle.markers.size());
    for (std::size_t i = 0; i < bundle.markers.size(); ++i) {
      const BundleMarker &was = bundle.markers[i], &is = read[0].markers[i];
      EXPECT_EQ(is.family, was.family);
      EXPECT_EQ(is.id, was.id);
      EXPECT_EQ(is.size_m, was.size_m);
      EXPECT_EQ(is.pose.t, was.pose.t);
      EXPECT_LT(difference(is.pose.R, was.pose.R), 3e-15);
    }
    write_bundle(folder / "b.yaml", read[0]);
    EXPECT_EQ(text_of(folder / "a.yaml"), text_of(folder / "b.yaml"));
    const std::vector<Bundle> again = read_bundles(folder / "b.yaml");
    for (std::size_t i = 0; i < bundle.markers.size(); ++i) {
      EXPECT_EQ(again[0].markers[i].pose.R, read[0].markers[i].pose.R);
    }
  }
}

// apriltag_ros' marker: x right, y up, z towards the viewer. Its default is no rotation; the second one is turned so
// that, in the bundle's frame, it looks along x.
TEST(BundleFile, HasTheMarkersOfAprilTagRos) {
  const ScratchFolder folder;
  const std::string path = folder.write("tags.yaml", std::string(R"(standalone_tags: [{id: 9, size: 0.1}]
tag_bundles:
  [
    {
      name: 'dock',
      layout:
        [
          {id: 0, size: 0.10},
          {id: 7, size: 0.05, x: 0.2, y: -0.3, z: 0.01, qw: 0.707107, qx: 0, qy: 0.707107, qz: 0}
        ]
    },
    { family: tagStandard41h12, layout: [ {id: 3, size: 0.2, x: 1, family: tag25h9} , {id: 3, size: 0.2}] }
  ]
)"));
  const std::vector<Bundle> bundles = read_bundles(path);
  ASSERT_EQ(bundles.size(), 2u);
  EXPECT_EQ(bundles[0].name, "dock");
  ASSERT_EQ(bundles[0].markers.size(), 2u);
  const BundleMarker& plain = bundles[0].markers[0];
  EXPECT_EQ(plain.family, &family("tag36h11"));
  EXPECT_EQ(plain.pose.R, (Mat3{1, 0, 0, 0, -1, 0, 0, 0, -1}));
  const BundleMarker& turned = bundles[0].markers[1];
  EXPECT_EQ(turned.id, 7);
  EXPECT_EQ(turned.size_m, 0.05);
  EXPECT_EQ(turned.pose.t, (Vec3{0.2, -0.3, 0.01}));
  // A quarter turn about y takes what pointed out of the marker, z, to x, and what was right, x, to -z.
  EXPECT_LT(difference(turned.pose.R, {0, 0, -1, 0, -1, 0, -1, 0, 0}), 1e-6);
  EXPECT_EQ(bundles[1].name, "bundle_1");
  EXPECT_EQ(bundles[1].markers[0].family, &family("tag25h9"));
  EXPECT_EQ(bundles[1].markers[1].family, &family("tagStandard41h12"));
  EXPECT_EQ(bundles[1].find(family("tag25h9"), 3), &bundles[1].markers[0]);
  EXPECT_EQ(bundles[1].find(family("tag25h9"), 4), nullptr);
  EXPECT_EQ(bundles[1].find(family("tag36h11"), 3), nullptr);
}

constexpr const char* kField = R"({
  "tags": [
    {"ID": 1, "pose": {"translation": {"x": 15.0, "y": 0.5, "z": 1.25},
                       "rotation": {"quaternion": {"W": 0.0, "X": 0.0, "Y": 0.0, "Z": 1.0}}}},
    {"ID": 2, "pose": {"translation": {"x": 0.0, "y": 5.5, "z": 0.5},
                       "rotation": {"quaternion": {"W": 1.0, "X": 0.0, "Y": 0.0, "Z": 0.0}}}}
  ],
  "field": {"length": 16.5, "width": 8.2}
})";

// WPILib's field: x to the far wall, y left, z up. A marker without rotation looks along x: who faces it looks along
// -x, so that y is to his right. One that is turned by half a circle about z looks back along -x.
TEST(BundleFile, HasTheMarkersOfAWpilibField) {
  const ScratchFolder folder;
  const std::vector<Bundle> bundles = read_bundles(folder.write("field.json", std::string(kField)), 0.1651);
  ASSERT_EQ(bundles.size(), 1u);
  EXPECT_EQ(bundles[0].name, "field");
  ASSERT_EQ(bundles[0].markers.size(), 2u);
  const BundleMarker &far = bundles[0].markers[0], &near = bundles[0].markers[1];
  EXPECT_EQ(far.id, 1);
  EXPECT_EQ(far.size_m, 0.1651);
  EXPECT_EQ(far.family, &family("tag36h11"));
  EXPECT_EQ(far.pose.t, (Vec3{15.0, 0.5, 1.25}));
  EXPECT_EQ(column(near.pose.R, 0), (Vec3{0, 1, 0}));   // right
  EXPECT_EQ(column(near.pose.R, 1), (Vec3{0, 0, -1}));  // down
  EXPECT_EQ(column(near.pose.R, 2), (Vec3{-1, 0, 0}));  // into the wall
  EXPECT_EQ(column(far.pose.R, 0), (Vec3{0, -1, 0}));
  EXPECT_EQ(column(far.pose.R, 1), (Vec3{0, 0, -1}));
  EXPECT_EQ(column(far.pose.R, 2), (Vec3{1, 0, 0}));
  EXPECT_EQ(read_bundles(folder / "field.json", 0.1524, "tag16h5")[0].markers[0].family, &family("tag16h5"));
}

struct BadFile {
  const char* text;
  const char* says;
  const char* remedy;
};

TEST(BundleFile, SaysWhatIsWrong) {
  const ScratchFolder folder;
  for (const BadFile& bad : {
           BadFile{"{", "not a YAML file (line", "apriltag_ros"},
           {"", "no bundle in it", "apriltag_ros"},
           {"tags", "no bundle in it", "WPILib"},
           {"tag_bundles: []", "no bundle in it", "WPILib"},
           {"tag_bundles: 3", "tag_bundles: not a list", "list the bundles"},
           {"tag_bundles: [{name: a}]", "tag_bundles[0].layout: missing", "list the markers"},
           {"tag_bundles: [{layout: []}]", "it has no markers", "give at least one"},
           {"tag_bundles: [3]", "tag_bundles[0]: not a map", "list the markers"},
           {"tag_bundles: [{layout: [{size: 1}]}]", "layout[0].id: missing", "id"},
           {"tag_bundles: [{layout: [{id: 1}]}]", "layout[0].size: missing", "metres"},
           {"tag_bundles: [{layout: [{id: 1.5, size: 1}]}]", "layout[0].id: \"1.5\"", "a whole number"},
           {"tag_bundles: [{layout: [{id: 1, size: abc}]}]", "layout[0].size: \"abc\"", "a decimal number"},
           {"tag_bundles: [{layout: [{id: 1, size: [1]}]}]", "layout[0].size: not a single value", "one value"},
           {"tag_bundles: [{layout: [{id: 1, size: 1, x: .inf}]}]", "layout[0].x: \".inf\"", "a decimal number"},
           {"tag_bundles: [{layout: [{id: 1, size: 1, x: 2000}]}]", "layout[0].x: 2000 m", "metres"},
           {"tag_bundles: [{layout: [{id: 1, size: 0}]}]", "tag36h11 1 has size 0", "above 0"},
           {"tag_bundles: [{layout: [{id: 587, size: 1}]}]", "tag36h11 587 does not exist", "0 to 586"},
           {"tag_bundles: [{layout: [{id: 1, size: 1}, {id: 1, size: 2}]}]", "tag36h11 1 is there twice", "once"},
           {"tag_bundles: [{family: tag99, layout: [{id: 1, size: 1}]}]", "[0].family: unknown marker family \"tag99\"",
            "name one"},
           {"tag_bundles: [{layout: [{id: 1, size: 1, qw: 0.5}]}]", "layout[0]: the quaternion's length is 0.5",
            "unit quaternion"},
           {"tag_bundles: [{deviation: -1, layout: [{id: 1, size: 1}]}]", "its deviation is -1", "0 or above"},
           {"{\"tags\": [{\"ID\": 1}]}", "tags[0].pose: missing", "translation and rotation"},
           {"{\"tags\": [{\"ID\": 1, \"pose\": {\"translation\": {\"x\": 1, \"y\": 2}, \"rotation\": {\"quaternion\": "
            "{\"W\": 1, \"X\": 0, \"Y\": 0, \"Z\": 0}}}}]}",
            "tags[0].pose.translation.z: missing", "x, y and z"},
       }) {
    const std::string path = folder.write("bad.yaml", std::string(bad.text));
    const std::string said = complaint([&] { read_bundles(path, 0.1); });
    EXPECT_THAT(said, HasSubstr(path)) << bad.text;
    EXPECT_THAT(said, HasSubstr(bad.says)) << bad.text;
    EXPECT_THAT(said, HasSubstr(bad.remedy)) << bad.text;
  }
  EXPECT_THAT(complaint([&] { read_bundles(folder / "none.yaml"); }), HasSubstr("none.yaml: cannot read"));
  EXPECT_THAT(complaint([&] { read_bundles(folder.write("field.json", std::string(kField))); }), HasSubstr("0.1651"));
  const Bundle bundle = read_bundles(folder / "field.json", 0.1)[0];
  EXPECT_THAT(complaint([&] { write_bundle(folder / "no/such.yaml", bundle); }), HasSubstr("cannot write"));
}

TEST(Bundle, ChecksWhatCodeMadeOfIt) {
  Bundle bundle;
  bundle.name = "made";
  BundleMarker marker;
  marker.size_m = 0.1;
  bundle.markers = {marker};
  EXPECT_THAT(complaint([&] { bundle.check(); }), HasSubstr("\"made\": marker 0 has no family"));
  bundle.markers[0].family = &family("tag36h11");
  EXPECT_EQ(complaint([&] { bundle.check(); }), "");
  bundle.markers[0].pose.R = {1, 0, 0, 0, 1, 0, 0, 0, -1};
  EXPECT_THAT(complaint([&] { bundle.check(); }), HasSubstr("no rotation")) << "a mirror image";
  bundle.markers[0].pose.R = {1, 0, 0, 0, 1, 0, 0, 0.1, 1};
  EXPECT_THAT(complaint([&] { bundle.check(); }), HasSubstr("no rotation")) << "a shear";
  bundle.markers[0].pose = {};
  bundle.markers[0].pose.t[1] = std::nan("");
  EXPECT_THAT(complaint([&] { bundle.check(); }), HasSubstr("finite place"));
}

TEST(BundleFile, ThoseThatComeWithBerthAreRead) {
  const Bundle approach = read_bundles(std::string(BERTH_SOURCE_DIR) + "/bundles/approach.yaml").at(0);
  EXPECT_EQ(approach.markers.size(), 5u);
  const Bundle nested = read_bundles(std::string(BERTH_SOURCE_DIR) + "/bundles/nested.yaml").at(0);
  EXPECT_EQ(nested.markers.at(0).pose.t, nested.markers.at(1).pose.t);
  EXPECT_EQ(nested.markers.at(0).family, &family("tagCustom48h12"));
}

}  // namespace
}  // namespace berth
