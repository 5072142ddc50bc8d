#include "navset/render.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "berth/error.hpp"
#include "navset/mesh.hpp"
#include "navset/target.hpp"

namespace berth::navset {
namespace {

using ::testing::DoubleNear;

// Where a ray along z at (x, y) from z = -5 meets the shape, or -1.
double along_z(const Shape& shape, double x, double y) {
  double t = 1e30;
  Vec3 normal{};
  return intersect(shape, {x, y, -5}, {0, 0, 1}, 0, t, normal) ? t : -1;
}

Shape shape(ShapeKind kind, const Vec3& size) { return {kind, size, nullptr}; }

TEST(Shapes, AreHitWhereTheirEquationsSay) {
  EXPECT_THAT(along_z(shape(ShapeKind::box, {1, 2, 3}), 0.9, -1.9), DoubleNear(2, 1e-12));
  EXPECT_EQ(along_z(shape(ShapeKind::box, {1, 2, 3}), 1.1, 0), -1);
  EXPECT_THAT(along_z(shape(ShapeKind::sphere, {1, 1, 1}), 0.6, 0), DoubleNear(5 - 0.8, 1e-12));
  EXPECT_EQ(along_z(shape(ShapeKind::sphere, {1, 1, 1}), 0.8, 0.7), -1);
  // A cone of radius 2 at z = -1 and 1 at z = 1: from in front its base closes it, as a tube its inside is seen.
  EXPECT_THAT(along_z(shape(ShapeKind::frustum, {2, 1, 1}), 1.5, 0), DoubleNear(4, 1e-12));
  EXPECT_THAT(along_z(shape(ShapeKind::tube, {2, 1, 1}), 1.5, 0), DoubleNear(5, 1e-12));
  EXPECT_EQ(along_z(shape(ShapeKind::tube, {2, 1, 1}), 0.5, 0), -1);
  EXPECT_EQ(along_z(shape(ShapeKind::ring, {2, 1, 0}), 0.5, 0), -1);
  EXPECT_THAT(along_z(shape(ShapeKind::ring, {2, 1, 0}), 1.5, 0), DoubleNear(5, 1e-12));
  EXPECT_EQ(along_z(shape(ShapeKind::plate, {1, 0.5, 0}), 0.5, 0.6), -1);
}

Scene sphere_at(double x, double z, double radius, Owner owner) {
  Scene scene;
  scene.place({{shape(ShapeKind::sphere, {radius, radius, radius}), Material{}, Pose{}}}, sim::translation(x, 0, z), 1,
              owner);
  return scene;
}

TEST(Drawing, CountsASpheresSilhouette) {
  const Camera camera;
  std::vector<double> radiance(256 * 256, 0.0);
  const Scene scene = sphere_at(0, 2, 0.2, Owner::target);
  const Sighting seen = draw(scene, camera, Light{}, {}, 2, radiance);
  // The silhouette's radius: f r / sqrt(z² - r²).
  const double radius = 500 * 0.2 / std::sqrt(4 - 0.04);
  EXPECT_NEAR(static_cast<double>(seen.silhouette) / 4, sim::kPi * radius * radius, 0.003 * sim::kPi * radius * radius);
  EXPECT_EQ(seen.visible, seen.silhouette);
  EXPECT_NEAR(seen.visible_box.x0, 127.5 - radius, 1);
  EXPECT_NEAR(seen.visible_box.y1, 127.5 + radius, 1);
}

TEST(Drawing, KnowsWhatIsHiddenAndWhatTheImagesEdgeCutsOff) {
  Camera camera;
  std::vector<double> radiance(256 * 256, 0.0);
  Scene scene = sphere_at(0, 2, 0.2, Owner::target);
  // A plate before its right half.
  scene.place({{shape(ShapeKind::plate, {1, 1, 0}), Material{}, Pose{}}}, sim::translation(1, 0, 1), 1, Owner::other);
  Sighting seen = draw(scene, camera, Light{}, {}, 2, radiance);
  EXPECT_NEAR(static_cast<double>(seen.visible) / static_cast<double>(seen.silhouette), 0.5, 0.01);
  EXPECT_LE(seen.visible_box.x1, 128);
  EXPECT_GT(seen.full_box.x1, 170);
  // The centre on the left edge.
  camera.cx = 0;
  seen = draw(sphere_at(0, 2, 0.2, Owner::target), camera, Light{}, {}, 2, radiance);
  EXPECT_NEAR(static_cast<double>(seen.visible) / static_cast<double>(seen.silhouette), 0.5, 0.02);
  EXPECT_EQ(seen.full_box.x0, 0);
}

TEST(Drawing, CastsShadows) {
  const Camera camera;
  Light light;
  light.ambient = 0;
  light.key = sim::normalized({1, 0, -1});
  Scene scene;
  scene.place({{shape(ShapeKind::plate, {2, 2, 0}), Material{}, Pose{}}}, sim::translation(0, 0, 2), 1, Owner::other);
  // Out of the picture, on the way from its middle to the light.
  scene.place({{shape(ShapeKind::sphere, {0.1, 0.1, 0.1}), Material{}, Pose{}}}, sim::translation(1, 0, 1), 1,
              Owner::other);
  std::vector<double> radiance(256 * 256, 0.0);
  draw(scene, camera, light, {}, 1, radiance);
  EXPECT_EQ(radiance[127 * 256 + 127], 0);
  EXPECT_GT(radiance[127 * 256 + 20], 0.3);
}

TEST(Target, HasItsFarthestPointsOnTheCircumscribedSphere) {
  for (const Livery& livery : liveries()) {
    double farthest = 0;
    for (const Part& part : target_model(livery, 1)) {
      const Vec3& s = part.shape.size;
      const bool round = part.shape.kind == ShapeKind::frustum || part.shape.kind == ShapeKind::tube;
      const double r = std::max(s[0], s[1]);
      for (int i = 0; i < 64; ++i) {
        // A box's corners; points round a frustum's ends.
        const int step = i / 2;
        const double a = 2 * sim::kPi * step / 32, end = (i & 1) != 0 ? s[2] : -s[2];
        const Vec3 local = round ? Vec3{r * sim::exact_cos(a), r * sim::exact_sin(a), end}
                                 : Vec3{(i & 2) != 0 ? s[0] : -s[0], (i & 4) != 0 ? s[1] : -s[1], end};
        farthest = std::max(farthest, sim::length(sim::transform(part.pose, local)));
      }
    }
    EXPECT_NEAR(farthest, kTargetDiameter_m / 2, 1e-9) << livery.name;
  }
}

template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string chunk(unsigned id, const std::string& body) {
  std::string bytes;
  put(bytes, static_cast<std::uint16_t>(id));
  put(bytes, static_cast<u32>(body.size() + 6));
  return bytes + body;
}

// A square of two triangles in z = 3, as a 3D Studio file.
std::string square_3ds(int last_corner = 3) {
  std::string corners, faces;
  put(corners, static_cast<std::uint16_t>(4));
  for (const float xy : {0.0f, 1.0f, 2.0f, 3.0f}) {
    put(corners, xy == 1 || xy == 2 ? 1.0f : -1.0f);
    put(corners, xy >= 2 ? 1.0f : -1.0f);
    put(corners, 3.0f);
  }
  put(faces, static_cast<std::uint16_t>(2));
  for (const int corner : {0, 1, 2, 0, 0, 2, last_corner, 0}) put(faces, static_cast<std::uint16_t>(corner));
  const std::string mesh = chunk(0x4100, chunk(0x4110, corners) + chunk(0x4120, faces));
  return chunk(0x4d4d, chunk(0x3d3d, chunk(0x4000, std::string("square\0", 7) + mesh)));
}

std::vector<Mesh::Triangle> read_bytes(const std::string& bytes) {
  std::string path = ::testing::TempDir() + "mesh-XXXXXX";
  const int file = mkstemp(path.data());
  if (file < 0) throw std::runtime_error("no temporary file");
  close(file);
  std::ofstream(path, std::ios::binary) << bytes;
  struct Remover {
    const std::string& path;
    ~Remover() { std::remove(path.c_str()); }
  } remover{path};
  return read_3ds(path);
}

TEST(Mesh, IsReadCentredAndHit) {
  const std::vector<Mesh::Triangle> triangles = read_bytes(square_3ds());
  ASSERT_EQ(triangles.size(), 2u);
  const Mesh mesh(triangles);
  Shape square = shape(ShapeKind::mesh, {2, 0, 0});
  square.mesh = &mesh;
  // Its corners are at distance 2 now: sides of 2 · sqrt(2), in z = 0.
  EXPECT_THAT(along_z(square, 1.4, -1.4), DoubleNear(5, 1e-12));
  EXPECT_EQ(along_z(square, 1.42, 0), -1);
}

TEST(Mesh, BadFilesAreRefused) {
  const std::string good = square_3ds();
  EXPECT_THROW(read_3ds("/no/such/file.3ds"), Error);
  EXPECT_THROW(read_bytes("P5 no mesh"), Error);
  EXPECT_THROW(read_bytes(square_3ds(4)), Error);
  for (std::size_t length = 0; length < good.size(); ++length) {
    EXPECT_THROW(read_bytes(good.substr(0, length)), Error) << length;
  }
  EXPECT_THROW(Mesh({}), Error);
  EXPECT_THROW(Mesh({{Vec3{1, 1, 1}, Vec3{1, 1, 1}, Vec3{1, 1, 1}}}), Error);
}

}  // namespace
}  // namespace berth::navset
