// How often a marker is seen where none is: many pictures without markers through the whole detector at its default
// settings, each family by itself. Goes on where it stopped.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <fstream>
#include <map>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <thread>

#include "as_mat.hpp"
#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "camera/image_file.hpp"
#include "clock.hpp"
#include "empty_pictures.hpp"
#include "frame/detector_parts.hpp"
#include "frame/marker_plan.hpp"
#include "run_main.hpp"

namespace berth::bench {
namespace {

/// Pictures of one kind that are told as one line of the file.
constexpr int kBatch = 1000;

struct Options {
  std::string backend = "simd";
  std::vector<std::string> families = {"tag36h11",      "tagStandard41h12", "tagStandard52h13", "tag25h9",
                                       "tagCircle21h7", "tag16h5",          "aruco4x4_50",      "aruco5x5_100",
                                       "aruco6x6_250",  "aruco7x7_1000"};
  std::vector<std::string> photos;
  std::string file = "false-positives.tsv";
  std::string evidence;
  long frames = 1000000;
  int threads = 1;
};

/// Frames looked at, quadrilaterals examined in them, and false markers of each family.
struct Count {
  long frames = 0, quads = 0;
  std::vector<long> wrong;

  void add(const Count& other) {
    frames += other.frames;
    quads += other.quads;
    wrong.resize(other.wrong.size());
    for (std::size_t i = 0; i < wrong.size(); ++i) wrong[i] += other.wrong[i];
  }
};

/// Which pictures: batch n of a kind has its pictures from n * kBatch on.
struct Batch {
  std::string kind;
  int number = 0;
  bool operator<(const Batch& other) const { return kind != other.kind ? kind < other.kind : number < other.number; }
};
using Counts = std::map<Batch, Count>;

std::string heading(const Options& options) {
  return fmt::format("kind\tbatch\tframes\tquads\t{}", fmt::join(options.families, "\t"));
}

/// What the file says is done. Its last line may have been cut off: that batch is done again.
Counts read_done(const Options& options) {
  Counts done;
  std::ifstream file(options.file);
  std::string line;
  if (!std::getline(file, line)) return done;
  if (line != heading(options)) {
    throw Error(options.file + " is of other families; give --file another name or the same --families");
  }
  while (std::getline(file, line)) {
    std::istringstream words(line);
    Batch batch;
    Count count;
    words >> batch.kind >> batch.number >> count.frames >> count.quads;
    for (long wrong = 0; words >> wrong;) count.wrong.push_back(wrong);
    if (count.wrong.size() == options.families.size()) done[batch] = count;
  }
  return done;
}

/// Detectors of one thread: the device's part once a size, the host's once a family.
class Examiner {
 public:
  Examiner(const Options& options, const std::vector<const MarkerFamily*>& families)
      : options_(options), families_(families), backend_(open_backend(options.backend)) {
    for (const int width : {320, 640}) sizes_.push_back(std::make_unique<Size>(*backend_, width, options));
  }

  /// Pictures without a name are not kept as evidence.
  Count examine(const EmptyPicture& picture, const std::string& name) {
    Size& size = *sizes_[picture.image.width() == 640 ? 1 : 0];
    pad_frame(picture.image.view(), size.device.geometry(), size.device.pixels());
    size.device.submit();
    if (!size.device.finish()) throw Error("the device was lost");
    Count count;
    count.frames = 1;
    for (std::size_t i = 0; i < families_.size(); ++i) {
      size.hosts[i].finish(size.device, size.result);
      if (i == 0) count.quads = size.result.quads;
      // Two families' codes may be each other's, and its own are true.
      const bool is_own = picture.shown == families_[i];
      count.wrong.push_back(is_own ? 0 : static_cast<long>(size.result.detections.size()));
      if (count.wrong.back() > 0) keep(picture, name, size.result.detections);
    }
    return count;
  }

 private:
  struct Size {
    // The device's part looks for the borders, dark or light, of all of them.
    Size(Backend& backend, int width, const Options& options)
        : device(backend, width, width / 4 * 3, config_of(options.families), false) {
      for (const std::string& name : options.families) {
        hosts.emplace_back(width, width / 4 * 3, config_of({name}));
      }
      for (HostFinish& host : hosts) host.reserve(device, result);
    }
    static DetectorConfig config_of(const std::vector<std::string>& families) {
      DetectorConfig config;
      config.families = families;
      return config;
    }

    DeviceFrame device;
    std::vector<HostFinish> hosts;
    FrameResult result;
  };

  void keep(const EmptyPicture& picture, const std::string& name, const std::vector<Detection>& detections) {
    if (options_.evidence.empty() || name.empty()) return;
    for (const Detection& found : detections) {
      const std::string path =
          fmt::format("{}/{}-{}-{}-{}bits.png", options_.evidence, name, found.family->name, found.id, found.hamming);
      cv::imwrite(path, as_mat(picture.image.view()));
    }
  }

  const Options& options_;
  const std::vector<const MarkerFamily*>& families_;
  std::unique_ptr<Backend> backend_;
  std::vector<std::unique_ptr<Size>> sizes_;
};

/// What could see nothing would find nothing wrong: each family's own markers must be found.
void check_sight(Examiner& examiner, EmptyPictures& pictures, const std::vector<const MarkerFamily*>& families) {
  constexpr int kPictures = 40;
  for (std::size_t i = 0; i < families.size(); ++i) {
    long found = 0;
    for (int n = 0; n < kPictures; ++n) {
      EmptyPicture picture =
          pictures.make("families", static_cast<int>(i + families.size() * static_cast<std::size_t>(n)));
      picture.shown = nullptr;
      found += examiner.examine(picture, "").wrong[i];
    }
    fmt::print(stderr, "{}: {} of its markers seen in {} pictures that show some\n", families[i]->name, found,
               kPictures);
    if (found < kPictures / 2) throw Error(families[i]->name + " is not seen where it is; nothing can be said of it");
  }
}

void print_table(const Options& options, const Counts& done) {
  std::map<std::string, Count> kinds;
  Count all;
  for (const auto& [batch, count] : done) {
    kinds[batch.kind].add(count);
    all.add(count);
  }
  fmt::print("| pictures | frames | quadrilaterals | {} |\n|---|---|---|", fmt::join(options.families, " | "));
  for (std::size_t i = 0; i < options.families.size(); ++i) fmt::print("---|");
  fmt::print("\n");
  const auto row = [](const std::string& name, const Count& count) {
    fmt::print("| {} | {} | {} | {} |\n", name, count.frames, count.quads, fmt::join(count.wrong, " | "));
  };
  for (const auto& [kind, count] : kinds) row(kind, count);
  row("**all**", all);
}

void examine_all(const Options& options, Counts& done) {
  std::vector<const MarkerFamily*> families;
  for (const std::string& name : options.families) families.push_back(&family(name));
  const std::vector<std::string> kinds = EmptyPictures(families, options.photos).kinds();
  std::vector<Batch> left;
  const long batches = (options.frames + kBatch - 1) / kBatch;
  for (long i = 0; i < batches; ++i) {
    const long n = static_cast<long>(kinds.size());
    const Batch batch{kinds[static_cast<std::size_t>(i % n)], static_cast<int>(i / n)};
    if (done.count(batch) == 0) left.push_back(batch);
  }
  {
    Examiner examiner(options, families);
    EmptyPictures pictures(families, {});
    check_sight(examiner, pictures, families);
  }

  const bool is_new = done.empty();
  std::ofstream file(options.file, is_new ? std::ios::trunc : std::ios::app);
  if (is_new) file << heading(options) << '\n';
  if (!file.flush()) throw Error(options.file + " cannot be written; is there such a folder, and room?");
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::string failure;
  const double start = ms_on(CLOCK_MONOTONIC);
  std::size_t finished = 0;
  const auto work = [&] {
    try {
      Examiner examiner(options, families);
      EmptyPictures pictures(families, options.photos);
      for (std::size_t i = next++; i < left.size(); i = next++) {
        const Batch& batch = left[i];
        Count sum;
        for (int n = batch.number * kBatch; n < (batch.number + 1) * kBatch; ++n) {
          sum.add(examiner.examine(pictures.make(batch.kind, n), fmt::format("{}-{}", batch.kind, n)));
        }
        const std::lock_guard<std::mutex> lock(mutex);
        file << fmt::format("{}\t{}\t{}\t{}\t{}\n", batch.kind, batch.number, sum.frames, sum.quads,
                            fmt::join(sum.wrong, "\t"));
        if (!file.flush()) throw Error(options.file + " cannot be written any more; is the disk full?");
        done[batch] = sum;
        ++finished;
        const double minutes = (ms_on(CLOCK_MONOTONIC) - start) / 60000;
        fmt::print(stderr, "\r{} of {} batches of {}, {:.1f} min, {:.0f} to go ", finished, left.size(), kBatch,
                   minutes, minutes / static_cast<double>(finished) * static_cast<double>(left.size() - finished));
      }
    } catch (const std::exception& error) {
      const std::lock_guard<std::mutex> lock(mutex);
      failure = error.what();
      next = left.size();
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < options.threads; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  if (!left.empty()) fmt::print(stderr, "\n");
  if (!failure.empty()) throw Error(failure);
}

int run(int argc, char** argv) {
  Options options;
  std::string photo_folder;
  CLI::App app("How often a marker is seen where none is, each family by itself, at the default settings.");
  app.add_option("--backend", options.backend, "where frames are searched");
  app.add_option("--families", options.families, "families to look for")->delimiter(',');
  app.add_option("--photos", photo_folder, "folder of photographs without markers; parts of them are pictures, too")
      ->check(CLI::ExistingDirectory);
  app.add_option("--file", options.file, "what is done, a line for each thousand pictures; goes on there");
  app.add_option("--evidence", options.evidence, "folder for the pictures in which something was seen")
      ->check(CLI::ExistingDirectory);
  app.add_option("--frames", options.frames, "pictures in all")->check(CLI::Range(1L, 1000000000L));
  app.add_option("--threads", options.threads, "working at a time")->check(CLI::Range(1, 256));
  CLI11_PARSE(app, argc, argv);
  if (!photo_folder.empty()) options.photos = list_images(photo_folder, false);
  Counts done = read_done(options);
  examine_all(options, done);
  print_table(options, done);
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("false_positives", berth::bench::run, argc, argv); }
