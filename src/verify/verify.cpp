#include "verify/verify.hpp"

#include <chrono>
#include <optional>

#include "frame/marker_plan.hpp"
#include "frame/stages.hpp"
#include "support/frame_set.hpp"
#include "support/op_case.hpp"

namespace berth {
namespace {

/// A plan and what it wrote for one image.
class FrameRun {
 public:
  FrameRun(Backend& backend, View2D<const u8> image, const DetectorConfig& config)
      : plan_(backend, image.width, image.height, config), stream_(backend.make_stream()) {
    std::vector<u8> frame(plan_.geometry().frame_bytes());
    pad_frame(image, plan_.geometry(), frame.data());
    stream_->upload(plan_.frame(), frame.data(), frame.size());
    stream_->replay(plan_.plan());
    stream_->finish();
  }
  MarkerPlan& plan() { return plan_; }
  StageReader reader() { return {plan_, *stream_}; }

 private:
  MarkerPlan plan_;
  std::unique_ptr<Stream> stream_;
};

std::string compare_frame(Backend& candidate, Backend& reference, const std::string& name, View2D<const u8> image,
                          const DetectorConfig& config) {
  FrameRun expected(reference, image, config);
  FrameRun found(candidate, image, config);
  StageReader expected_reader = expected.reader();
  StageReader found_reader = found.reader();
  const std::optional<StageDifference> difference = first_difference(found_reader, expected_reader);
  return difference ? "frame " + name + ", " + to_string(*difference) : "";
}

}  // namespace

VerifyReport verify_backend(Backend& candidate, Backend& reference, const VerifyOptions& options) {
  const auto started = std::chrono::steady_clock::now();
  VerifyReport report;
  const std::vector<pictures::Frame> frames = pictures::frame_set();
  const int all = static_cast<int>(all_ops().size() + frames.size() + options.images.size());
  int done = 0;
  const auto note = [&](const std::string& difference) {
    if (!difference.empty() && report.ok) {
      report.ok = false;
      report.first_difference = difference;
    }
  };
  const auto step = [&] {
    if (options.progress) options.progress(++done, all);
  };
  for (const Op op : all_ops()) {
    for (const cases::OpCase& op_case : cases::cases_for(op)) {
      const std::string difference =
          cases::first_difference(op_case, cases::run_case(op_case, reference), cases::run_case(op_case, candidate));
      if (!difference.empty()) note(std::string("operation ") + name_of(op) + ", case " + difference);
      ++report.cases;
    }
    step();
  }
  for (const pictures::Frame& frame : frames) {
    note(compare_frame(candidate, reference, frame.name, frame.image.view(), frame.config));
    ++report.frames;
    step();
  }
  DetectorConfig both;
  both.families = {"tag36h11", "tagStandard41h12"};
  for (const VerifyImage& image : options.images) {
    note(compare_frame(candidate, reference, image.name, image.image.view(), both));
    ++report.frames;
    step();
  }
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return report;
}

}  // namespace berth
