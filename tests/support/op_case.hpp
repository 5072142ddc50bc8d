#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "berth/image.hpp"

namespace berth::cases {

/// One launch of one operation on given buffers: run on every backend, it must leave the reference's bits in all of
/// them, outputs, inputs and what lies between.
struct OpCase {
  std::string name;
  Op op;
  std::vector<std::byte> params;
  std::vector<std::vector<u32>> buffers;
  int items;
};

/// A case from a parameter struct, which names the operation.
template <class P>
OpCase make_case(std::string name, const P& params, std::vector<std::vector<u32>> buffers, int items) {
  const std::byte* bytes = reinterpret_cast<const std::byte*>(&params);
  return {std::move(name), OpOf<P>::value, {bytes, bytes + sizeof(P)}, std::move(buffers), items};
}

/// Every launch of `op` in the docking plan of an image, with the buffers as the reference left them before it.
std::vector<OpCase> cases_from_frame(const std::string& name, Op op, View2D<const u8> image,
                                     const DetectorConfig& config = {});

/// cases_from_frame for every frame of pictures::frame_set().
std::vector<OpCase> frame_cases(Op op);

/// Words made of bytes that are each one of the levels.
std::vector<u32> random_bytes(std::size_t words, const std::vector<u8>& levels, u64 seed);

/// The cases of one operation: tests/cases/<op>.cpp.
std::vector<OpCase> cases_for(Op op);

/// The buffers after the case ran on the backend, each followed by its guard words.
std::vector<std::vector<u32>> run_case(const OpCase& op_case, Backend& backend);

/// Where two runs of a case first differ, in words; empty where they do not.
std::string first_difference(const OpCase& op_case, const std::vector<std::vector<u32>>& expected,
                             const std::vector<std::vector<u32>>& found);

#define X(op) std::vector<OpCase> op##_cases();
BERTH_OPS(X)
#undef X

}  // namespace berth::cases
