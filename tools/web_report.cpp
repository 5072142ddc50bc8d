// A run as one page: its samples, thinned out where they are many, and its counts, in the live view's own drawings.
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <optional>
#include <string_view>

#include "berth/error.hpp"
#include "output_file.hpp"
#include "truth_score.hpp"
#include "web_assets.hpp"
#include "web_messages.hpp"
#include "web_samples.hpp"
#include "web_times.hpp"
#include "web_view.hpp"

namespace berth::cli {
namespace {

/// Samples in a report. Past it every other frame goes, and of those to come, too.
constexpr std::size_t kMostSamples = 24000;
constexpr std::size_t kMostChanges = 200;

std::string date_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc = {};
  gmtime_r(&now, &utc);
  std::array<char, 32> text = {};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &utc);
  return text.data();
}

/// JSON for the inside of a script element, which no text in it may end.
std::string embedded(const Json& json) {
  std::string text;
  for (const char c : to_line(json)) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

void put(std::string& page, std::string_view mark, const std::string& what) {
  const std::size_t at = page.find(mark);
  if (at != std::string::npos) page.replace(at, mark.size(), what);
}

class WebReport final : public FrameObserver {
 public:
  explicit WebReport(const WebOptions& options) : path_(options.report) {
    about_.source = options.source;
    about_.is_filtered = options.is_filtered;
    // A folder that is not there shows before the run, not after it.
    write_file(path_, "the report", "");
  }

  void begin(const ObservedStream& stream) override {
    sampler_.begin(stream);
    about_.backend = stream.backend;
    about_.width = stream.width;
    about_.height = stream.height;
    about_.camera = stream.config.camera;
  }

  void observe(const ObservedFrame& frame) override {
    const FrameResult& result = frame.result;
    const std::int64_t wall_ns = std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
    const bool has_clock = std::strcmp(result.stamp.clock, "none") != 0;
    const std::int64_t time_ns = has_clock ? result.stamp.mid_exposure_ns : wall_ns;
    if (frames_ == 0) {
      first_ns_ = time_ns;
      began_ns_ = wall_ns;
    }
    ended_ns_ = wall_ns;
    time_s_ = static_cast<double>(time_ns - first_ns_) / 1e9;
    times_.add(frame);
    const std::vector<WebSample>& samples = sampler_.take(frame, time_s_);
    with_pose_ += samples.empty() ? 0 : 1;
    ++states_[static_cast<std::size_t>(result.status)];
    if (frame.tracked != nullptr) ++searches_[static_cast<std::size_t>(frame.tracked->why)];
    note_changes(frame);
    if (frame.counts != nullptr) counts_ = *frame.counts;
    health_ = frame.health;
    if (frames_++ % every_ != 0) return;
    for (const WebSample& sample : samples) {
      kept_.push_back({frames_ - 1, sample});
      for (const TruthMarker& truth : frame.truth) {
        const WebObject& object = sampler_.objects()[static_cast<std::size_t>(sample.object)];
        if (object.name != truth.family + " " + std::to_string(truth.id)) continue;
        WebSample known;
        known.time_s = time_s_;
        known.object = sample.object;
        known.axes = six_axes(truth.pose, nullptr);
        known.closing_m_s = known.closing_deviation_m_s = known.range_deviation_m = known.error_px = std::nan("");
        truth_.push_back({frames_ - 1, known});
      }
    }
    if (kept_.size() > kMostSamples) thin_out();
  }

  void finish(std::ostream& people) override {
    std::string page(web_asset("report.html"));
    std::string scripts;
    for (const char* name : {"three.js", "format.js", "plot.js", "scene.js", "report.js"}) {
      scripts += fmt::format("<script>\n{}\n</script>\n", web_asset(name));
    }
    // The data first: nothing that stands in them is looked through for marks.
    put(page, "<!--scripts-->", scripts);
    put(page, "<!--style-->", fmt::format("<style>\n{}\n</style>", web_asset("view.css")));
    put(page, "<!--data-->",
        fmt::format("<script type=\"application/json\" id=\"data\">{}</script>", embedded(data())));
    write_file(path_, "the report", page);
    people << "report      " << path_ << '\n';
  }

 private:
  struct Kept {
    u64 frame;
    WebSample sample;
  };

  void thin_out() {
    every_ *= 2;
    const auto goes = [this](const Kept& kept) { return kept.frame % every_ != 0; };
    kept_.erase(std::remove_if(kept_.begin(), kept_.end(), goes), kept_.end());
    truth_.erase(std::remove_if(truth_.begin(), truth_.end(), goes), truth_.end());
  }

  void change(std::string what) {
    if (changes_.size() < kMostChanges) changes_.push_back({std::round(time_s_ * 1e3) / 1e3, std::move(what)});
  }

  void note_changes(const ObservedFrame& frame) {
    if (backend_ != frame.backend) {
      backend_ = frame.backend;
      change(std::string("backend: ") + frame.backend);
    }
    if (frames_ == 0 || mode_ != frame.mode) {
      mode_ = frame.mode;
      change(std::string("mode: ") + name_of(frame.mode));
    }
    if (frame.health.reopened != health_.reopened) change("the camera was opened again");
  }

  Json data() const {
    Json json = {{"about", to_json(about_)},
                 {"date", date_now()},
                 {"frames", frames_},
                 {"with_pose", with_pose_},
                 {"wall_s", std::round(static_cast<double>(ended_ns_ - began_ns_) / 1e6) / 1e3},
                 {"every", every_},
                 {"times", times_.json()},
                 {"objects", to_json(sampler_.objects())},
                 {"beyond", sampler_.beyond()},
                 {"samples", Json::array()},
                 {"truth", Json::array()},
                 {"changes", Json::array()},
                 {"camera",
                  {{"lost", health_.lost},
                   {"incomplete", health_.incomplete},
                   {"repeated", health_.repeated},
                   {"misdated", health_.misdated},
                   {"skipped", health_.skipped},
                   {"reopened", health_.reopened}}}};
    for (const Kept& kept : kept_) json["samples"].push_back(to_json(kept.sample));
    for (const Kept& kept : truth_) json["truth"].push_back(to_json(kept.sample));
    for (const auto& [time_s, what] : changes_) json["changes"].push_back({time_s, what});
    for (std::size_t i = 0; i < states_.size(); ++i) {
      if (states_[i] > 0) json["states"][name_of(static_cast<FrameStatus>(i))] = states_[i];
    }
    for (std::size_t i = 0; i < searches_.size(); ++i) {
      if (searches_[i] > 0) json["searches"][name_of(static_cast<SearchReason>(i))] = searches_[i];
    }
    if (!counts_) return json;
    json["pipeline"] = {{"offered", counts_->offered}, {"delivered", counts_->delivered}, {"late", counts_->late}};
    for (std::size_t i = 0; i < kDropCauses; ++i) {
      json["pipeline"]["dropped"][name_of(static_cast<DropCause>(i))] = counts_->dropped[i];
    }
    return json;
  }

  std::string path_;
  WebAbout about_;
  WebSampler sampler_;
  WebTimes times_;
  std::vector<Kept> kept_, truth_;
  u64 frames_ = 0, with_pose_ = 0, every_ = 1;
  double time_s_ = 0;
  std::int64_t first_ns_ = 0, began_ns_ = 0, ended_ns_ = 0;
  std::array<u64, 5> states_ = {};
  std::array<u64, kSearchReasons> searches_ = {};
  std::string backend_;
  Mode mode_ = Mode::search;
  std::vector<std::pair<double, std::string>> changes_;
  std::optional<PipelineCounts> counts_;
  SourceHealth health_;
};

}  // namespace

std::shared_ptr<FrameObserver> make_web_report(const WebOptions& options) {
  return std::make_shared<WebReport>(options);
}

}  // namespace berth::cli
