#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "berth/ops.hpp"

/// What operations cost: work counted in the kernel text, machines, and projections of one on the other
/// (docs/projection.md).
namespace berth::work {

/// Kinds of work, each with a price of its own on a machine.
enum class Kind {
  simple,    ///< sums, differences, bitwise logic
  shift,     ///< shifts, comparisons, minima, maxima
  multiply,  ///< 32-bit products
  divide,    ///< quotients and remainders
  popcount,
  dot,     ///< four s8 products and their sum
  bytes,   ///< minimum, maximum or comparison of a word's four bytes
  shared,  ///< words of the group's own memory, read or written
  load,    ///< words read from buffers
  store,   ///< words written to them
};
constexpr std::size_t kKinds = 10;
/// The kinds' names, as machine descriptions spell them.
constexpr std::array<const char*, kKinds> kKindNames = {"simple", "shift", "multiply", "divide", "popcount",
                                                        "dot",    "bytes", "shared",   "load",   "store"};
using Counts = std::array<std::uint64_t, kKinds>;

/// How many items may advance in lockstep: a GPU's warp, a vector's lanes. 1: each by itself.
constexpr std::array<int, 6> kLockstep = {1, 4, 8, 16, 32, 64};
/// The place in kLockstep; throws Error on a number that is not there.
std::size_t lockstep_index(int items);

/// What one launch did.
struct StepWork {
  Op op{};
  int groups = 0;
  /// Slots by kind for each of kLockstep: neighbouring items of a phase wait for the longest among them. The first is
  /// what the items did in all.
  std::array<Counts, kLockstep.size()> slots{};
  /// The longest of the groups: operations of the longest item of each phase, added up, …
  std::uint64_t span = 0;
  /// … loads from buffers that must follow each other, because an address or a branch needs what came before, …
  std::uint64_t chain = 0;
  /// … and steps of arithmetic that must (counted.hpp says what is one).
  std::uint64_t steps = 0;
  /// Operations of the group that did most.
  std::uint64_t most_in_group = 0;
};

}  // namespace berth::work
