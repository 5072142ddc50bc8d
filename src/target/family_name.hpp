#pragma once

#include <cstddef>

namespace berth {

/// A family's name, in the order of family_names(); null past the last. Static, and takes no memory.
const char* family_name_at(std::size_t index);

}  // namespace berth
