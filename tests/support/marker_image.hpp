#pragma once

#include <string>

namespace berth::test {

/// 320 × 200 or so with tag36h11 id 7; see tests/data.
inline const std::string kImage = std::string(BERTH_TEST_DATA) + "/tag36h11_7.png";

}  // namespace berth::test
