// berth_navset: writes a set of navigation images with their truth (training/README.md).

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <thread>

#include "berth/error.hpp"
#include "navset/hash.hpp"
#include "navset/set.hpp"
#include "navset/target.hpp"

namespace {

using namespace berth;
using namespace berth::navset;

/// Rises with every change that moves a bit of a set.
constexpr int kVersion = 3;

std::vector<std::string> mesh_files(const std::string& folder) {
  std::vector<std::string> files;
  DIR* directory = opendir(folder.c_str());
  if (directory == nullptr) throw Error("cannot read " + folder);
  while (const dirent* entry = readdir(directory)) {
    const std::string name = entry->d_name;
    if (name.size() > 4 && name.substr(name.size() - 4) == ".3ds")
      files.push_back(std::string(folder).append("/").append(name));
  }
  closedir(directory);
  std::sort(files.begin(), files.end());
  return files;
}

u64 file_hash(const std::string& path, u64 hash) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  return hash_bytes(bytes.data(), bytes.size(), hash);
}

std::string hex(u64 value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, value);
  return text;
}

class ProgressBar {
 public:
  explicit ProgressBar(int count) : count_(count), shown_(isatty(STDERR_FILENO) != 0) {}
  void operator()(int done) {
    const auto now = std::chrono::steady_clock::now();
    if (!shown_ || (done < count_ && now - last_ < std::chrono::milliseconds(200))) return;
    last_ = now;
    const double seconds = std::chrono::duration<double>(now - start_).count();
    const int width = 40, filled = static_cast<int>(static_cast<long>(width) * done / count_);
    std::fprintf(stderr, "\r[%s%s] %d/%d  %.0f/s ", std::string(static_cast<std::size_t>(filled), '#').c_str(),
                 std::string(static_cast<std::size_t>(width - filled), '.').c_str(), done, count_,
                 seconds > 0 ? done / seconds : 0);
    if (done == count_) std::fputc('\n', stderr);
  }

 private:
  int count_;
  bool shown_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), last_{};
};

struct Sources {
  std::string photos, models;
  u64 model_hash = 0;
};

void write_manifest(const std::string& path, const SetPlan& plan, const SetResult& result, const Gallery& gallery,
                    const Studio& studio, const Sources& sources) {
  int per_kind[6] = {}, used = 0;
  for (int i = 0; i < gallery.count(); ++i) {
    per_kind[static_cast<std::size_t>(gallery.kind(i))] += result.backdrops_used[static_cast<std::size_t>(i)];
    if (result.backdrops_used[static_cast<std::size_t>(i)] > 0) ++used;
  }
  std::ofstream file(path, std::ios::trunc);
  file << "{\n  \"generator\": \"berth_navset\",\n  \"version\": " << kVersion << ",\n  \"set\": \"" << plan.name
       << "\",\n  \"seed\": " << plan.seed << ",\n  \"train\": " << plan.train << ",\n  \"test\": " << plan.test
       << ",\n  \"positives\": " << result.positives << ",\n  \"side_px\": " << kSide_px
       << ",\n  \"target_diameter_m\": " << kTargetDiameter_m << ",\n  \"rendered_backgrounds\": " << Gallery::kRendered
       << ",\n  \"photographs\": " << gallery.photo_count() << ",\n  \"photograph_hash\": \""
       << hex(gallery.photo_hash()) << "\",\n  \"meshes\": " << studio.meshes().size() << ",\n  \"mesh_hash\": \""
       << hex(sources.model_hash) << "\",\n  \"backgrounds_used\": " << used << ",\n  \"images_by_background\": {";
  for (int kind = 0; kind < 6; ++kind) {
    file << (kind == 0 ? "" : ", ") << "\"" << name_of(static_cast<BackdropKind>(kind)) << "\": " << per_kind[kind];
  }
  file << "},\n  \"image_hash\": \"" << hex(result.image_hash) << "\",\n  \"label_hash\": \"" << hex(result.label_hash)
       << "\"\n}\n";
  file.close();
  if (!file) throw Error("cannot write " + path);
}

void run(const SetPlan& plan, int threads, const std::string& folder, Sources& sources) {
  plan.check();
  if (mkdir(folder.c_str(), 0777) != 0 && errno != EEXIST) throw Error("cannot make the folder " + folder);
  const Gallery gallery(sources.photos);
  std::vector<Mesh> meshes;
  sources.model_hash = kHashStart;
  if (!sources.models.empty()) {
    for (const std::string& file : mesh_files(sources.models)) {
      meshes.emplace_back(read_3ds(file));
      sources.model_hash = file_hash(file, sources.model_hash);
    }
  }
  const Studio studio(gallery, std::move(meshes));
  std::fprintf(stderr, "%s, seed %" PRIu64 ": %d + %d images; backgrounds: %d rendered, %d photographs; %zu meshes\n",
               plan.name.c_str(), plan.seed, plan.train, plan.test, Gallery::kRendered, gallery.photo_count(),
               studio.meshes().size());
  ProgressBar bar(plan.count());
  const auto start = std::chrono::steady_clock::now();
  const SetResult result = write_set(plan, gallery, studio, threads, folder, [&bar](int done) { bar(done); });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  write_manifest(folder + "/manifest.json", plan, result, gallery, studio, sources);
  std::fprintf(stderr, "%.1f s, %.0f images/s, %d threads\n", seconds, plan.count() / seconds, threads);
  std::printf("%s seed %" PRIu64 " %d+%d photographs %d meshes %zu images %s labels %s\n", plan.name.c_str(), plan.seed,
              plan.train, plan.test, gallery.photo_count(), studio.meshes().size(), hex(result.image_hash).c_str(),
              hex(result.label_hash).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Writes a set of navigation images: images.u8, labels.csv, manifest.json");
  SetPlan plan;
  Sources sources;
  std::string folder;
  int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  app.add_option("set", plan.name, "paper-split, disjoint, look-alike or hard")->required();
  app.add_option("folder", folder, "Where to write")->required();
  app.add_option("--seed", plan.seed, "Another seed, other images")->capture_default_str();
  app.add_option("--train", plan.train, "Training images")->capture_default_str();
  app.add_option("--test", plan.test, "Test images")->capture_default_str();
  app.add_option("--threads", threads, "Threads; the bytes do not depend on it")->check(CLI::Range(1, 256));
  app.add_option("--photos", sources.photos, "Folder of photographs that training/backgrounds.py made");
  app.add_option("--models", sources.models, "Folder of .3ds spacecraft for look-alike negatives");
  CLI11_PARSE(app, argc, argv);
  try {
    run(plan, threads, folder, sources);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "berth_navset: %s\n", error.what());
    return 2;
  }
  return 0;
}
