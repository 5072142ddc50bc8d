// Whether Berth is still as much faster than its peers, and finds as much, as bench/expected_ratios.toml says: same
// frames, same run, ratios of medians. Absolute times say nothing on a shared machine and are not looked at.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "clock.hpp"
#include "engines.hpp"
#include "run_main.hpp"
#include "score.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "sim/toml_reader.hpp"

namespace berth::bench {
namespace {

const char* const kPeers[] = {"apriltag-d1-tuned", "apriltag-d2-tuned", "aruco"};

struct Expectation {
  std::string corpus;
  std::vector<double> ratios;  // of each peer: its time over Berth's
  double recall = 0;
};
struct Expectations {
  int frames = 0, repeat = 0;
  double slack = 0;  // a ratio may be this share of what is expected
  std::vector<Expectation> corpora;
};

Expectations read_expectations(const std::string& path) {
  sim::TomlReader root = sim::TomlReader::open(path, "file of expected ratios");
  Expectations expected;
  expected.frames = root.integer("frames", 12, 1, 1000);
  expected.repeat = root.integer("repeat", 5, 1, 100);
  expected.slack = root.number("slack", 0.5, 0.01, 1);
  for (sim::TomlReader& table : root.tables("corpus")) {
    Expectation one;
    one.corpus = table.choice("name", "", sim::corpus_names());
    one.ratios = table.numbers("ratios", {0, 0, 0}, 0, 1e4);
    one.recall = table.number("recall", 1, 0, 1);
    table.finish();
    expected.corpora.push_back(std::move(one));
  }
  root.finish();
  return expected;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

struct Measured {
  std::vector<double> ms;  // medians, Berth's first
  Score berth;
};

Measured measure(const Expectation& one, const Expectations& expected, int width, int height) {
  std::vector<std::unique_ptr<Engine>> engines;
  engines.push_back(make_engine("simd", 1));
  for (const char* peer : kPeers) engines.push_back(make_engine(peer, 1));
  std::vector<std::vector<double>> times(engines.size());
  Measured measured;
  for (int i = 0; i < expected.frames; ++i) {
    const sim::Scene scene = sim::corpus_scene(one.corpus, i * sim::kCorpusFrames / expected.frames, width, height);
    const GrayImage image = sim::Renderer(scene.camera).render(scene);
    std::vector<double> best(engines.size(), 1e9);
    for (int round = 0; round < expected.repeat; ++round) {
      for (std::size_t k = 0; k < engines.size(); ++k) {
        // The calling thread's own time: what else runs here weighs least on it.
        const double start = ms_on(CLOCK_THREAD_CPUTIME_ID);
        engines[k]->run(image.view());
        best[k] = std::min(best[k], ms_on(CLOCK_THREAD_CPUTIME_ID) - start);
      }
    }
    for (std::size_t k = 0; k < engines.size(); ++k) times[k].push_back(best[k]);
    measured.berth.add(sim::truth(scene), engines.front()->found());
  }
  for (const auto& all : times) measured.ms.push_back(median(all));
  return measured;
}

int run(int argc, char** argv) {
  std::string path;
  int width = 640, height = 480;
  CLI::App app(
      "Ratios of peers' times to Berth's, same frames and run, against a file of expected ones. Exit code 1 "
      "where one is below its slack, recall is lower or something is found that is not there.");
  app.add_option("FILE", path, "expected ratios, e.g. bench/expected_ratios.toml")->required();
  CLI11_PARSE(app, argc, argv);
  const Expectations expected = read_expectations(path);
  bool good = true;
  fmt::print("| frames | simd ms | {} | {} | {} | recall % | false |\n|---|---:|---:|---:|---:|---:|---:|\n", kPeers[0],
             kPeers[1], kPeers[2]);
  for (const Expectation& one : expected.corpora) {
    const Measured measured = measure(one, expected, width, height);
    fmt::print("| {} | {:.3f} |", one.corpus, measured.ms[0]);
    for (std::size_t k = 0; k < one.ratios.size(); ++k) {
      const double ratio = measured.ms[k + 1] / measured.ms[0];
      const bool enough = ratio >= one.ratios[k] * expected.slack;
      good = good && enough;
      fmt::print(" {:.1f} of {:.1f}{} |", ratio, one.ratios[k], enough ? "" : ": TOO SLOW");
    }
    const bool found = measured.berth.recall() >= one.recall && measured.berth.false_positives == 0;
    good = good && found;
    fmt::print(" {:.1f}{} | {} |\n", 100 * measured.berth.recall(), found ? "" : ": TOO FEW OR WRONG",
               measured.berth.false_positives);
    std::fflush(stdout);
  }
  fmt::print("{}\n", good ? "as fast as expected" : "slower than expected, or wrong: see above");
  return good ? 0 : 1;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("check_ratios", berth::bench::run, argc, argv); }
