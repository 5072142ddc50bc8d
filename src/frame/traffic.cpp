#include "frame/traffic.hpp"

#include <algorithm>
#include <map>

namespace berth {
namespace {

/// Words of a list of quadrilaterals or edges that are touched: every slot's first, and the rest of those in use.
std::size_t slot_words(const std::vector<u32>& words, std::size_t width) {
  std::size_t touched = 0;
  for (std::size_t at = 0; at < words.size(); at += width) {
    const auto begin = words.begin() + static_cast<std::ptrdiff_t>(at);
    const bool used =
        std::any_of(begin, begin + static_cast<std::ptrdiff_t>(width), [](u32 word) { return word != 0; });
    touched += used ? width : 1;
  }
  return touched;
}

std::vector<StepTraffic> traffic_of(const std::vector<Step>& steps, const std::map<const Buffer*, std::size_t>& lists) {
  std::vector<StepTraffic> traffic;
  for (const Step& step : steps) {
    StepTraffic one;
    one.op = step.op;
    one.groups = (step.items + kGroupSize - 1) / kGroupSize;
    for (std::size_t i = 0; i < step.buffers.size(); ++i) {
      const auto found = lists.find(step.buffers[i]);
      const std::size_t bytes = found != lists.end() ? found->second : step.buffers[i]->bytes();
      (args_of(step.op)[i].read_only ? one.read : one.written) += bytes;
      one.arguments.push_back({step.buffers[i], bytes});
    }
    traffic.push_back(one);
  }
  return traffic;
}

}  // namespace

std::vector<StepTraffic> step_traffic(const std::vector<Step>& steps) { return traffic_of(steps, {}); }

std::vector<StepTraffic> step_traffic(StageReader& reader) {
  std::map<const Buffer*, std::size_t> touched;
  const std::vector<Stage>& stages = reader.plan().stages();
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const std::vector<u32>& words = reader.read(i);
    std::size_t count = words.size();
    if (stages[i].length == Stage::Length::quads) count = slot_words(words, QUAD_WORDS);
    if (stages[i].length == Stage::Length::edges) count = slot_words(words, EDGE_WORDS);
    touched[stages[i].buffer] = count * 4;
  }
  return traffic_of(reader.plan().steps(), touched);
}

}  // namespace berth
