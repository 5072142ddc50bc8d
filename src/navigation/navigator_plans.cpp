#include "navigation/navigator_plans.hpp"

#include <algorithm>
#include <utility>

#include "divide_up.hpp"
#include "navigation/candidates.hpp"

namespace berth {
namespace {

/// The search sees the frame this high, px: what is smaller than 40 px there is not what the network was trained on.
constexpr int kSearchHeight = 480;
/// The target's middle may be this far from a window's for the network to know it, search px.
constexpr int kReach = 32;

int search_step(int height) { return std::clamp(height * 256 / kSearchHeight, kMinStep, kMaxStep); }

/// Length of the search's window: grid positions from kReach before the frame's first pixel to kReach after its last.
int search_length(int frame, int step, int side, int spacing) {
  const int seen = (frame * 256 + step - 1) / step;
  return side + std::max(0, round_up(seen - 2 * kReach, spacing));
}

/// Where a window of `length` search px begins that lies in the middle of the frame.
s32 search_corner(int frame_length, int length, int step) { return (frame_length * 256 - length * step) / 2; }

}  // namespace

NavigatorPlans::NavigatorPlans(Backend& backend_, Network network_, int width_, int height_)
    : backend(backend_),
      width(width_),
      height(height_),
      network(std::move(network_)),
      device(backend_, network),
      padded_width(round_up(width_, 4)),
      padded(static_cast<std::size_t>(padded_width) * static_cast<std::size_t>(height_)),
      frame(backend_.make_buffer(padded.size())),
      step(search_step(height_)),
      spacing(position_spacing(network)),
      search(device, view(), 1, search_length(width_, step, network.side, spacing),
             search_length(height_, step, network.side, spacing)),
      close(device, view(), kCloseLooks, network.side, network.side),
      follow(device, view(), 1, network.side, network.side),
      stream(backend_.make_stream()),
      whole{search_corner(width_, search.width(), step), search_corner(height_, search.height(), step), step, 0},
      search_sums(search.sums().bytes() / 4),
      close_sums(close.sums().bytes() / 4) {
  upload_at_start(backend_, *stream, search.windows(), whole.data(), sizeof whole);
}

bool NavigatorPlans::run(NetworkPlan& plan, std::vector<s32>& sums) {
  stream->replay(plan.plan());
  stream->download(plan.sums(), sums.data(), plan.sums().bytes());
  return stream->finish();
}

void NavigatorPlans::list_constants(std::vector<ConstantMemory>& to) const {
  for (const std::vector<Buffer*>& layer : device.constants()) {
    for (Buffer* buffer : layer) {
      if (buffer->host() != nullptr) to.push_back({"network weights", buffer->host(), buffer->bytes()});
    }
  }
  to.push_back({"network tables", network.logistic.data(), sizeof network.logistic});
  for (const FixedScale* scale : {&network.score, &network.x, &network.y, &network.d}) {
    to.push_back({"network tables", scale, sizeof *scale});
  }
  for (const NetworkPlan* plan : {&search, &close, &follow}) plan->list_constants(to);
}

}  // namespace berth
