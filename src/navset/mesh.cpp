#include "navset/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>

#include "berth/error.hpp"

namespace berth::navset {
namespace {

Vec3 difference(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

void include(const Vec3& p, Vec3& low, Vec3& high) {
  for (int i = 0; i < 3; ++i) {
    low[i] = std::min(low[i], p[i]);
    high[i] = std::max(high[i], p[i]);
  }
}

// Möller & Trumbore 1997.
bool intersect_triangle(const Mesh::Triangle& triangle, const Vec3& o, const Vec3& d, double t_min, double& t,
                        Vec3& normal) {
  const Vec3 e1 = difference(triangle[1], triangle[0]), e2 = difference(triangle[2], triangle[0]);
  const Vec3 p = sim::cross(d, e2);
  const double determinant = sim::dot(e1, p);
  if (std::abs(determinant) < 1e-18) return false;
  const double inverse = 1 / determinant;
  const Vec3 s = difference(o, triangle[0]);
  const double u = sim::dot(s, p) * inverse;
  if (u < 0 || u > 1) return false;
  const Vec3 q = sim::cross(s, e1);
  const double v = sim::dot(d, q) * inverse;
  if (v < 0 || u + v > 1) return false;
  const double place = sim::dot(e2, q) * inverse;
  if (place <= t_min || place >= t) return false;
  t = place;
  normal = sim::cross(e1, e2);
  return true;
}

bool meets(const Vec3& low, const Vec3& high, const Vec3& o, const Vec3& inverse, double t_min, double t) {
  for (int i = 0; i < 3; ++i) {
    const double a = (low[i] - o[i]) * inverse[i], b = (high[i] - o[i]) * inverse[i];
    t_min = std::max(t_min, std::min(a, b));
    t = std::min(t, std::max(a, b));
  }
  return t_min <= t;
}

}  // namespace

Mesh::Mesh(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  if (triangles_.empty()) throw Error("mesh: no triangles");
  Vec3 low = triangles_[0][0], high = low;
  for (const Triangle& triangle : triangles_) {
    for (const Vec3& corner : triangle) include(corner, low, high);
  }
  const Vec3 middle = sim::scaled(sim::add(low, high), 0.5);
  double radius = 0;
  for (Triangle& triangle : triangles_) {
    for (Vec3& corner : triangle) {
      corner = difference(corner, middle);
      radius = std::max(radius, sim::length(corner));
    }
  }
  if (!(radius > 0) || !(radius < 1e30)) throw Error("mesh: no size");
  for (Triangle& triangle : triangles_) {
    for (Vec3& corner : triangle) corner = sim::scaled(corner, 1 / radius);
  }
  build(0, static_cast<int>(triangles_.size()));
}

int Mesh::build(int first, int last) {
  const auto at = static_cast<int>(nodes_.size());
  const auto begin = triangles_.begin() + first, end = triangles_.begin() + last;
  Vec3 low = (*begin)[0], high = low;
  for (auto triangle = begin; triangle != end; ++triangle) {
    for (const Vec3& corner : *triangle) include(corner, low, high);
  }
  nodes_.push_back({low, high, first, last - first, 0});
  if (last - first <= 4) return at;
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (high[i] - low[i] > high[axis] - low[axis]) axis = i;
  }
  // A stable sort: the tree, like everything here, is the same under every standard library.
  std::stable_sort(begin, end, [axis](const Triangle& a, const Triangle& b) {
    return a[0][axis] + a[1][axis] + a[2][axis] < b[0][axis] + b[1][axis] + b[2][axis];
  });
  const int middle = first + (last - first) / 2;
  nodes_[static_cast<std::size_t>(at)].count = 0;
  build(first, middle);
  const int right = build(middle, last);
  nodes_[static_cast<std::size_t>(at)].right = right;
  return at;
}

bool Mesh::intersect(const Vec3& o, const Vec3& d, double t_min, double& t, Vec3& normal) const {
  Vec3 inverse{};
  for (int i = 0; i < 3; ++i) inverse[i] = 1 / (std::abs(d[i]) < 1e-12 ? 1e-12 : d[i]);
  bool found = false;
  std::array<int, 64> stack{};
  int depth = 0;
  stack[0] = 0;
  while (depth >= 0) {
    const int at = stack[static_cast<std::size_t>(depth--)];
    const Node& node = nodes_[static_cast<std::size_t>(at)];
    if (!meets(node.low, node.high, o, inverse, t_min, t)) continue;
    if (node.count == 0) {
      stack[static_cast<std::size_t>(++depth)] = node.right;
      stack[static_cast<std::size_t>(++depth)] = at + 1;
      continue;
    }
    for (int i = node.first; i < node.first + node.count; ++i) {
      if (intersect_triangle(triangles_[static_cast<std::size_t>(i)], o, d, t_min, t, normal)) found = true;
    }
  }
  return found;
}

namespace {

class ChunkReader {
 public:
  explicit ChunkReader(const std::string& bytes) : bytes_(bytes) {}

  std::vector<Mesh::Triangle> triangles() {
    if (bytes_.size() < 6 || number<std::uint16_t>(0) != 0x4d4d) throw Error("no 3D Studio file");
    walk(0, bytes_.size());
    return std::move(triangles_);
  }

 private:
  template <class T>
  T number(std::size_t at) const {
    if (at + sizeof(T) > bytes_.size()) throw Error("3ds: the file ends early");
    T value;
    std::memcpy(&value, bytes_.data() + at, sizeof value);  // little-endian, as every machine Berth runs on
    return value;
  }

  void walk(std::size_t at, std::size_t end) {
    while (at + 6 <= end) {
      const unsigned id = number<std::uint16_t>(at);
      const std::size_t length = number<u32>(at + 2);
      if (length < 6 || length > end - at) throw Error("3ds: a chunk reaches past its parent");
      std::size_t body = at + 6;
      switch (id) {
        case 0x4000:  // an object: its name, then chunks
          while (number<u8>(body) != 0) ++body;
          ++body;
          walk(body, at + length);
          break;
        case 0x4d4d:  // the file
        case 0x3d3d:  // the scene
        case 0x4100:  // a mesh
          walk(body, at + length);
          break;
        case 0x4110:
          read_corners(body);
          break;
        case 0x4120:
          read_faces(body);
          break;
        default:
          break;
      }
      at += length;
    }
  }

  void read_corners(std::size_t body) {
    corners_.assign(number<std::uint16_t>(body), Vec3{});
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) corners_[i][k] = number<float>(body + 2 + 12 * i + 4 * k);
    }
  }

  void read_faces(std::size_t body) {
    const std::size_t count = number<std::uint16_t>(body);
    for (std::size_t i = 0; i < count; ++i) {
      Mesh::Triangle triangle{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t corner = number<std::uint16_t>(body + 2 + 8 * i + 2 * k);
        if (corner >= corners_.size()) throw Error("3ds: a face names a corner that is not there");
        triangle[k] = corners_[corner];
      }
      triangles_.push_back(triangle);
    }
  }

  const std::string& bytes_;
  std::vector<Vec3> corners_;
  std::vector<Mesh::Triangle> triangles_;
};

}  // namespace

std::vector<Mesh::Triangle> read_3ds(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error("cannot read " + path);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  try {
    return ChunkReader(bytes).triangles();
  } catch (const Error& error) {
    throw Error(path + ": " + error.what());
  }
}

}  // namespace berth::navset
