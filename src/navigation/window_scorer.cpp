#include "navigation/window_scorer.hpp"

#include <algorithm>

#include "berth/error.hpp"

namespace berth {
namespace {

std::size_t pixels_of(const Network& network, int count) {
  return static_cast<std::size_t>(count) * static_cast<std::size_t>(network.side * network.side);
}

}  // namespace

WindowScorer::WindowScorer(Backend& backend, const Network& network, int batch)
    : network_(network),
      device_(backend, network),
      frame_(backend.make_buffer(pixels_of(network, batch))),
      plan_(device_, {frame_.get(), network.side, network.side * batch, network.side}, batch, network.side,
            network.side),
      stream_(backend.make_stream()),
      pixels_(pixels_of(network, batch)),
      sums_(plan_.sums().bytes() / 4) {
  std::vector<s32> windows;  // the images below each other
  for (int k = 0; k < batch; ++k) windows.insert(windows.end(), {0, k * network.side * 256, 256, 0});
  upload_at_start(backend, *stream_, plan_.windows(), windows.data(), windows.size() * 4);
}

std::vector<WindowScore> WindowScorer::score(const u8* images, int count) {
  std::copy_n(images, pixels_of(network_, count), pixels_.begin());
  stream_->upload(*frame_, pixels_.data(), pixels_.size());
  stream_->replay(plan_.plan());
  stream_->download(plan_.sums(), sums_.data(), plan_.sums().bytes());
  if (!stream_->finish()) throw Error(std::string(device_.backend().name()) + ": the device was lost");
  const int outputs = network_.heads.scores + network_.heads.geometry;
  std::vector<WindowScore> scores;
  for (int k = 0; k < count; ++k) {
    const s32* mine = sums_.data() + static_cast<std::ptrdiff_t>(k) * plan_.sums_each();
    scores.push_back({{mine, mine + outputs}, network_output(network_, mine)});
  }
  return scores;
}

}  // namespace berth
