#include "verify/verify.hpp"

#include <chrono>
#include <map>
#include <optional>
#include <utility>

#include "frame/marker_plan.hpp"
#include "frame/stages.hpp"
#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "verify/mixed_frames.hpp"

namespace berth {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A plan for frames of one size on one backend.
class FrameRun {
 public:
  FrameRun(Backend& backend, int width, int height, const DetectorConfig& config)
      : plan_(backend, width, height, config), stream_(backend.make_stream()), frame_(plan_.geometry().frame_bytes()) {}

  /// Returns whether the device survived.
  bool run(View2D<const u8> image) {
    pad_frame(image, plan_.geometry(), frame_.data());
    stream_->upload(plan_.frame(), frame_.data(), frame_.size());
    stream_->replay(plan_.plan());
    return stream_->finish();
  }
  StageReader reader() { return {plan_, *stream_}; }

 private:
  MarkerPlan plan_;
  std::unique_ptr<Stream> stream_;
  std::vector<u8> frame_;
};

/// Empty where every word of the last frame agrees.
std::string compare(FrameRun& found, FrameRun& expected, const std::string& name) {
  StageReader found_reader = found.reader();
  StageReader expected_reader = expected.reader();
  const std::optional<StageDifference> difference = first_difference(found_reader, expected_reader);
  return difference ? "frame " + name + ", " + to_string(*difference) : "";
}

std::string compare_frame(Backend& candidate, Backend& reference, const std::string& name, View2D<const u8> image,
                          const DetectorConfig& config) {
  FrameRun expected(reference, image.width, image.height, config);
  FrameRun found(candidate, image.width, image.height, config);
  expected.run(image);
  if (!found.run(image)) return "frame " + name + ": the device was lost";
  return compare(found, expected, name);
}

DetectorConfig outlines_and_holes() {
  DetectorConfig config;
  config.families = {"tag36h11", "tagStandard41h12"};
  return config;
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
  const DetectorConfig both = outlines_and_holes();
  for (const VerifyImage& image : options.images) {
    note(compare_frame(candidate, reference, image.name, image.image.view(), both));
    ++report.frames;
    step();
  }
  report.seconds = seconds_since(started);
  return report;
}

std::vector<VerifyReport> verify_mixed(const std::vector<Backend*>& candidates, Backend& reference,
                                       const MixedOptions& options) {
  const auto started = std::chrono::steady_clock::now();
  // The runs of one size: the reference's, then the candidates'.
  std::map<std::pair<int, int>, std::vector<std::unique_ptr<FrameRun>>> runs;
  std::vector<VerifyReport> reports(candidates.size());
  MixedFrames frames;
  for (int i = 0; i < options.frames || seconds_since(started) < options.minutes * 60; ++i) {
    const MixedFrames::Frame frame = frames.make(i);
    const View2D<const u8> image = frame.image.view();
    std::vector<std::unique_ptr<FrameRun>>& sized = runs[{image.width, image.height}];
    if (sized.empty()) {
      const auto add = [&](Backend& backend) {
        sized.push_back(std::make_unique<FrameRun>(backend, image.width, image.height, outlines_and_holes()));
      };
      add(reference);
      for (Backend* candidate : candidates) add(*candidate);
    }
    sized[0]->run(image);
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      VerifyReport& report = reports[k];
      if (!report.ok) continue;
      const bool alive = sized[k + 1]->run(image);
      report.first_difference =
          alive ? compare(*sized[k + 1], *sized[0], frame.name) : "frame " + frame.name + ": the device was lost";
      report.ok = report.first_difference.empty();
      ++report.frames;
    }
    if (options.progress) options.progress(i + 1, seconds_since(started) / 60);
  }
  for (VerifyReport& report : reports) report.seconds = seconds_since(started);
  return reports;
}

}  // namespace berth
