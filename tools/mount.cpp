#include "mount.hpp"

#include <cstdlib>

#include "exact_math.hpp"
#include "pose_algebra.hpp"

namespace berth::cli {
namespace {

/// `axes`: of what is mounted, at zero angles, in the vehicle's.
Pose mounted(const Mount& mount, const Mat3& axes) {
  const auto turn = [&](std::size_t i) { return radians(mount[i]); };
  const double sr = exact_sin(turn(3)), cr = exact_cos(turn(3)), sp = exact_sin(turn(4)), cp = exact_cos(turn(4)),
               sy = exact_sin(turn(5)), cy = exact_cos(turn(5));
  const Mat3 body = product(Mat3{cy, -sy, 0, sy, cy, 0, 0, 0, 1},
                            product(Mat3{cp, 0, sp, 0, 1, 0, -sp, 0, cp}, Mat3{1, 0, 0, 0, cr, -sr, 0, sr, cr}));
  return {product(body, axes), {mount[0], mount[1], mount[2]}};
}

}  // namespace

std::optional<Mount> read_mount(const std::string& text) {
  Mount mount = {};
  const char* at = text.c_str();
  for (std::size_t i = 0; i < mount.size(); ++i) {
    char* end = nullptr;
    mount[i] = std::strtod(at, &end);
    const char expected = i + 1 < mount.size() ? ',' : '\0';
    if (end == at || *end != expected || !(mount[i] > -1e4 && mount[i] < 1e4)) return std::nullopt;
    at = end + 1;
  }
  return mount;
}

Pose mounted_camera(const Mount& mount) { return mounted(mount, {0, 0, 1, -1, 0, 0, 0, -1, 0}); }
Pose mounted_marker(const Mount& mount) { return mounted(mount, {0, 0, -1, 1, 0, 0, 0, -1, 0}); }

}  // namespace berth::cli
