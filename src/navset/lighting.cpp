#include "navset/lighting.hpp"

#include "navset/parts.hpp"

namespace berth::navset {

Light random_light(bool in_space, sim::Random& random, const char*& mood) {
  Light light;
  light.key = random_direction(random);
  if (light.key[2] > 0 && random.chance(0.6)) light.key[2] = -light.key[2];
  light.fill = random_direction(random);
  light.up = sim::normalized({random.uniform(-0.5, 0.5), -1, random.uniform(-0.5, 0.5)});
  const int mode =
      in_space ? (random.chance(0.85) ? random.integer(0, 1) : 2) : (random.chance(0.7) ? 2 : random.integer(0, 1));
  if (mode == 0) {
    mood = "sun";
    light.key_strength = random.uniform(0.9, 1.9);
    light.ambient = random.uniform(0.0, 0.05);
    light.fill_strength = random.chance(0.6) ? random.uniform(0.02, 0.2) : 0.0;
  } else if (mode == 1) {
    mood = "earthshine";
    light.key_strength = random.chance(0.4) ? random.uniform(0.1, 0.8) : 0.0;
    light.ambient = random.uniform(0.02, 0.2);
    light.fill_strength = random.uniform(0.3, 0.9);
  } else {
    mood = "lamps";
    light.key_strength = random.uniform(0.2, 1.0);
    light.ambient = random.uniform(0.12, 0.5);
    light.fill_strength = random.uniform(0.0, 0.5);
  }
  return light;
}

}  // namespace berth::navset
