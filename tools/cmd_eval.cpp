// berth eval: how well a network tells the target from everything else, on a set of labelled images.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

#include "berth/error.hpp"
#include "commands.hpp"
#include "eval_tables.hpp"
#include "frame/digest.hpp"
#include "navigation/window_scorer.hpp"
#include "orb_matcher.hpp"
#include "output_file.hpp"
#include "roc_svg.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth eval lite.berthnet sets/disjoint                          accuracy, misses and false positives, by threshold
  berth eval lite.berthnet sets/disjoint --backend simd,vulkan    both must give the same bits
  berth eval lite.berthnet sets/disjoint --limit 500 --threads 2
  berth eval lite.berthnet sets/disjoint --orb --plots plots      ORB on the same images; curves as SVG

A set is what berth_navset makes (training/README.md).)";

struct EvalCommand {
  std::string network;
  std::string set;
  std::string part = "test";
  std::vector<std::string> backends;
  BackendOptions backend;
  double threshold = 0.5;
  int limit = 0;
  int batch = 8;
  bool orb = false;
  std::string plots;
};

/// Of a share; as the tables have it.
int q15(double threshold) { return static_cast<int>(threshold * 32768); }

struct Run {
  std::string backend;
  std::string device;
  std::vector<WindowScore> scores;
  double seconds = 0;
};

void show_progress(Console& console, const std::string& name, std::size_t done, std::size_t count) {
  if (!console.out_is_terminal()) return;
  console.out() << (done < count ? fmt::format("\r{:<10} {} of {} images\x1b[K", name, done, count) : "\r\x1b[K")
                << std::flush;
}

Run run_on(const std::string& name, const EvalCommand& command, const Network& network, const LabelledSet& set,
           std::size_t count, Console& console) {
  const std::unique_ptr<Backend> backend = open_backend(name, command.backend);
  Run run{name, backend->device().name, {}, 0};
  WindowScorer scorer(*backend, network, command.batch);
  const std::size_t each = static_cast<std::size_t>(network.side * network.side);
  std::vector<u8> pixels(each * static_cast<std::size_t>(command.batch));
  for (std::size_t first = 0; first < count; first += static_cast<std::size_t>(command.batch)) {
    const std::size_t here = std::min(count - first, static_cast<std::size_t>(command.batch));
    for (std::size_t k = 0; k < here; ++k) set.read(set.images()[first + k], pixels.data() + k * each);
    const auto start = std::chrono::steady_clock::now();
    std::vector<WindowScore> scores = scorer.score(pixels.data(), static_cast<int>(here));
    run.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::move(scores.begin(), scores.end(), std::back_inserter(run.scores));
    show_progress(console, name, first + here, count);
  }
  return run;
}

u64 digest_of(const Run& run) {
  u64 digest = digest_words(nullptr, 0);
  for (const WindowScore& score : run.scores) {
    std::vector<u32> words(score.sums.begin(), score.sums.end());
    const NetworkOutput& o = score.output;
    for (const s32 value : {o.score_q15, o.x_q16, o.y_q16, o.d_q16}) words.push_back(static_cast<u32>(value));
    digest = digest_words(words.data(), words.size(), digest);
  }
  return digest;
}

/// Index of the first image whose sums differ, or how many there are.
std::size_t first_difference(const Run& a, const Run& b) {
  std::size_t i = 0;
  while (i < a.scores.size() && a.scores[i].sums == b.scores[i].sums) ++i;
  return i;
}

/// ORB's decisions, by matches alone and by those that a homography agrees with.
std::vector<Rival> run_orb(const EvalCommand& command, const Network& network, const LabelledSet& set,
                           std::size_t count, Console& console) {
  const OrbMatcher matcher(command.set, network.side);
  std::vector<Rival> rivals = {{"ORB", {}}, {"ORB, homography", {}}};
  std::vector<u8> pixels(static_cast<std::size_t>(network.side) * static_cast<std::size_t>(network.side));
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t k = 0; k < count; ++k) {
    const LabelledImage& image = set.images()[k];
    set.read(image, pixels.data());
    const OrbEvidences evidences = matcher.match(pixels.data());
    for (std::size_t i = 0; i < evidences.size(); ++i) {
      rivals[0].decisions[i].count(image.present, evidences[i].matches >= OrbMatcher::kLeast);
      rivals[1].decisions[i].count(image.present, evidences[i].inliers >= OrbMatcher::kLeast);
    }
    show_progress(console, "ORB", k + 1, count);
  }
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  console.out() << fmt::format(
      "\nORB: {} features, {} views of the training part, at least {} good matches or inliers; {:.1f} images/s\n",
      OrbMatcher::kFeatures, matcher.templates(), OrbMatcher::kLeast, static_cast<double>(count) / spent.count());
  return rivals;
}

void write_plots(const EvalCommand& command, const std::string& network, const std::vector<Judged>& judged,
                 const std::vector<Rival>& rivals, Console& console) {
  RocPlot plot{network, curve_of(judged), q15(command.threshold), {}};
  for (const Rival& rival : rivals) {
    MarkedSeries series{rival.name + ", ratio 0.45 to 0.80", {}};
    for (std::size_t i = 0; i < kTableThresholds.size(); ++i) {
      series.marks.push_back({fmt::format("{:.2f}", kTableThresholds[i] / 100.0), rival.decisions[i]});
    }
    plot.others.push_back(series);
  }
  console.out() << '\n';
  for (const auto& [name, drawing] :
       {std::pair("roc.svg", roc_svg(plot)), std::pair("precision-recall.svg", precision_recall_svg(plot))}) {
    const std::string path = (std::filesystem::path(command.plots) / name).string();
    write_file(path, "the drawing", drawing);
    console.out() << "written: " << path << '\n';
  }
}

int run_eval(const EvalCommand& command, Console& console) {
  const Network network = read_network(command.network);
  const LabelledSet set(command.set, command.part, network.side);
  const std::size_t count =
      command.limit > 0 ? std::min(set.images().size(), static_cast<std::size_t>(command.limit)) : set.images().size();
  // Before minutes of work, not after.
  if (!command.plots.empty()) make_folder(command.plots, "choose another for --plots");
  const std::vector<std::string> names = command.backends.empty() ? std::vector<std::string>{"simd"} : command.backends;
  std::vector<Run> runs;
  for (const std::string& name : names) runs.push_back(run_on(name, command, network, set, count, console));

  console.out() << fmt::format("{} ({} parameters) on {} images of {}, {} part\n\n", network.name, network.parameters(),
                               count, command.set, command.part);
  console.out() << "| backend | images/s | digest of sums and outputs | on |\n|---|---|---|---|\n";
  int exit_code = kOk;
  for (const Run& run : runs) {
    console.out() << fmt::format("| {} | {:.1f} | {:016x} | {} |\n", run.backend,
                                 static_cast<double>(count) / run.seconds, digest_of(run), run.device);
  }
  for (std::size_t i = 1; i < runs.size(); ++i) {
    const std::size_t at = first_difference(runs[0], runs[i]);
    if (at == count) continue;
    exit_code = kNoResult;
    console.out() << fmt::format("\n{} differs from {}: first in image {}\n", runs[i].backend, runs[0].backend,
                                 set.images()[at].index);
  }

  std::vector<Judged> judged;
  for (std::size_t i = 0; i < count; ++i) judged.push_back({set.images()[i], runs[0].scores[i].output});
  const int threshold = q15(command.threshold);
  const Decisions decisions = decide(judged, threshold);
  console.out() << fmt::format("\nat {:.2f}: accuracy {:.3f} %, {} errors of {}: {} of {} missed, {} of {} false\n",
                               command.threshold, 100 * decisions.accuracy(), decisions.wrong(), decisions.all(),
                               decisions.missed, decisions.present(), decisions.false_found, decisions.absent())
                << threshold_table(judged) << confusion_tables(judged, threshold);
  if (network.heads.geometry > 0) console.out() << geometry_table(judged, threshold) << range_table(judged, threshold);
  std::vector<Rival> rivals;
  if (command.orb) {
    rivals = run_orb(command, network, set, count, console);
    console.out() << rates_table(judged, rivals);
  }
  if (!command.plots.empty()) write_plots(command, network.name, judged, rivals, console);
  return exit_code;
}

}  // namespace

void add_eval(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("eval", "Judge a navigation network on a set of labelled images");
  const auto options = std::make_shared<EvalCommand>();
  command->add_option("network", options->network, "the network's file (.berthnet)")->required()->type_name("FILE");
  command->add_option("set", options->set, "folder of the set")->required()->type_name("DIR");
  command->add_option("--part", options->part, "train, test or all")
      ->check(CLI::IsMember({"train", "test", "all"}))
      ->capture_default_str();
  command->add_option("--backend", options->backends, "backends, of which the first is judged; all must agree [simd]")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--device", options->backend.device, "its device, by index or by a part of its name")
      ->type_name("DEVICE");
  command->add_option("--threads", options->backend.threads, "threads of the CPU backends, 0 for every core")
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--threshold", options->threshold, "least score of a target found")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--limit", options->limit, "the first N images only; 0 for all")
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--batch", options->batch, "images a launch")->check(CLI::Range(1, 64))->capture_default_str();
  command->add_flag("--orb", options->orb, "an ORB matcher beside the network, with templates of the training part");
  command->add_option("--plots", options->plots, "draw roc.svg and precision-recall.svg there")->type_name("DIR");
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_eval(*options, console); });
}

}  // namespace berth::cli
