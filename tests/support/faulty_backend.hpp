#pragma once

#include <memory>
#include <string>

#include "berth/backend.hpp"

namespace berth::test {

/// What goes wrong on a backend, and in which frame: each plan counts its replays from 0.
struct Fault {
  /// A bit that turns over in a step's buffer right after the step; none where step < 0.
  int flip_step = -1;
  int flip_argument = 0;
  std::size_t flip_word = 0;
  int flip_bit = 0;
  int flip_frame = 0;
  /// The frame in which the device is lost for good; never where negative.
  int lose_frame = -1;
};

/// A backend that works as the one behind it does, but for one fault.
std::unique_ptr<Backend> make_faulty_backend(Backend& behind, const Fault& fault);

}  // namespace berth::test
