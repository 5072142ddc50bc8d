#pragma once

#include <string>
#include <vector>

#include "navset/shape.hpp"

namespace berth::navset {

/// Triangles in a tree of boxes, moved and scaled so that the circle around their box's middle has radius 1.
class Mesh {
 public:
  using Triangle = std::array<Vec3, 3>;

  /// At least one triangle of some size, or Error.
  explicit Mesh(std::vector<Triangle> triangles);

  bool intersect(const Vec3& origin, const Vec3& direction, double t_min, double& t, Vec3& normal) const;
  double radius() const { return 1; }
  std::size_t triangle_count() const { return triangles_.size(); }

 private:
  struct Node {
    Vec3 low, high;
    int first, count;  // triangles of a leaf; count 0: an inner node
    int right;         // the left child follows its parent
  };
  int build(int first, int last);

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

/// The triangles of a 3D Studio file (.3ds). Throws Error where the file cannot be read or is no such file.
/// Source: the chunk layout as documented by Jochen Wilhelmy's and Martin van Velsen's format notes.
std::vector<Mesh::Triangle> read_3ds(const std::string& path);

}  // namespace berth::navset
