#include "support/op_case.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include "frame/marker_plan.hpp"
#include "support/frame_set.hpp"
#include "support/pictures.hpp"

namespace berth::cases {
namespace {

constexpr std::size_t kGuardWords = 64;
constexpr u32 kGuard = 0xa5c3f00du;

}  // namespace

std::vector<OpCase> cases_from_frame(const std::string& name, Op op, View2D<const u8> image,
                                     const DetectorConfig& config) {
  const std::unique_ptr<Backend> reference = open_backend("reference");
  MarkerPlan plan(*reference, image.width, image.height, config);
  pad_frame(image, plan.geometry(), static_cast<u8*>(plan.frame().host()));
  const std::unique_ptr<Stream> stream = reference->make_stream();
  std::vector<OpCase> cases;
  for (const Step& step : plan.steps()) {
    if (step.op == op) {
      OpCase op_case{
          name + (cases.empty() ? "" : "_" + std::to_string(cases.size() + 1)), op, step.params, {}, step.items};
      for (Buffer* buffer : step.buffers) {
        const u32* words = static_cast<const u32*>(buffer->host());
        op_case.buffers.emplace_back(words, words + buffer->bytes() / 4);
      }
      cases.push_back(std::move(op_case));
    }
    const std::unique_ptr<Plan> one = reference->record({step});
    stream->replay(*one);
  }
  return cases;
}

std::vector<OpCase> frame_cases(Op op) {
  std::vector<OpCase> cases;
  for (const pictures::Frame& frame : pictures::frame_set()) {
    for (OpCase& op_case : cases_from_frame(frame.name, op, frame.image.view(), frame.config)) {
      cases.push_back(std::move(op_case));
    }
  }
  return cases;
}

std::vector<u32> random_bytes(std::size_t words, const std::vector<u8>& levels, u64 seed) {
  pictures::Random random(seed);
  std::vector<u32> made(words);
  for (u32& word : made) {
    for (int k = 0; k < 4; ++k) {
      word = word << 8 | levels[static_cast<std::size_t>(random.below(static_cast<int>(levels.size())))];
    }
  }
  return made;
}

std::vector<OpCase> cases_for(Op op) {
  switch (op) {
#define X(op)  \
  case Op::op: \
    return op##_cases();
    BERTH_OPS(X)
#undef X
  }
  return {};
}

std::vector<std::vector<u32>> run_case(const OpCase& op_case, Backend& backend) {
  const std::unique_ptr<Stream> stream = backend.make_stream();
  std::vector<std::vector<u32>> contents = op_case.buffers;
  std::vector<std::unique_ptr<Buffer>> buffers;
  Step step{op_case.op, op_case.params, {}, op_case.items};
  for (std::vector<u32>& words : contents) {
    words.insert(words.end(), kGuardWords, kGuard);
    buffers.push_back(backend.make_buffer(words.size() * 4));
    stream->upload(*buffers.back(), words.data(), words.size() * 4);
    step.buffers.push_back(buffers.back().get());
  }
  const std::unique_ptr<Plan> plan = backend.record({step});
  stream->replay(*plan);
  stream->finish();
  for (std::size_t i = 0; i < contents.size(); ++i) {
    stream->download(*buffers[i], contents[i].data(), contents[i].size() * 4);
  }
  stream->finish();
  return contents;
}

std::string first_difference(const OpCase& op_case, const std::vector<std::vector<u32>>& expected,
                             const std::vector<std::vector<u32>>& found) {
  for (std::size_t buffer = 0; buffer < expected.size(); ++buffer) {
    for (std::size_t i = 0; i < expected[buffer].size(); ++i) {
      if (expected[buffer][i] == found[buffer][i]) continue;
      char text[160];
      std::snprintf(text, sizeof text, "%s: buffer %zu, word %zu of %zu is 0x%08x, not 0x%08x", op_case.name.c_str(),
                    buffer, i, op_case.buffers[buffer].size(), found[buffer][i], expected[buffer][i]);
      return text;
    }
  }
  return "";
}

}  // namespace berth::cases
