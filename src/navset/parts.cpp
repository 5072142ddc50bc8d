#include "navset/parts.hpp"

namespace berth::navset {

Mat3 random_attitude(sim::Random& random) {
  // A quaternion from the ball in four dimensions.
  for (;;) {
    const double w = random.uniform(-1, 1), x = random.uniform(-1, 1), y = random.uniform(-1, 1),
                 z = random.uniform(-1, 1);
    const double n = w * w + x * x + y * y + z * z;
    if (n < 0.01 || n > 1) continue;
    const double s = 2 / n;
    return {1 - s * (y * y + z * z), s * (x * y - w * z),     s * (x * z + w * y),
            s * (x * y + w * z),     1 - s * (x * x + z * z), s * (y * z - w * x),
            s * (x * z - w * y),     s * (y * z + w * x),     1 - s * (x * x + y * y)};
  }
}

Vec3 random_direction(sim::Random& random) {
  for (;;) {
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1), z = random.uniform(-1, 1);
    const double n = x * x + y * y + z * z;
    if (n > 0.01 && n <= 1) return sim::normalized({x, y, z});
  }
}

double log_uniform(sim::Random& random, double low, double high) {
  return low * exact_pow(high / low, random.uniform(0, 1));
}

}  // namespace berth::navset
