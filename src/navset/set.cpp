#include "navset/set.hpp"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <thread>

#include "berth/error.hpp"
#include "navset/hash.hpp"
#include "navset/target.hpp"

namespace berth::navset {
namespace {

// Images made before they are written: enough that threads rarely wait for the last one.
constexpr int kBatch = 512;
constexpr std::size_t kBytes = static_cast<std::size_t>(kSide_px) * kSide_px;

// Which negatives, in hundredths.
struct Share {
  Subject subject;
  int percent;
};
constexpr Share kMixed[] = {{Subject::background, 56}, {Subject::clutter, 16}, {Subject::robot, 8},
                            {Subject::satellite, 8},   {Subject::piece, 6},    {Subject::decoy, 6}};

void add_part(std::vector<Subject>& all, const SetPlan& plan, int count, sim::Random& random) {
  std::vector<Subject> part;
  // Rounded: 2,800 of 9,590 and 1,200 of 4,110.
  const int positives = (count * 40 + 68) / 137;
  part.resize(static_cast<std::size_t>(positives), Subject::target);
  const int negatives = count - positives;
  if (plan.name == "look-alike") {
    part.resize(static_cast<std::size_t>(count), Subject::satellite);
  } else {
    int sum = 0;
    for (const Share& share : kMixed) {
      sum += share.percent;
      part.resize(static_cast<std::size_t>(positives + negatives * sum / 100), share.subject);
    }
  }
  for (int i = count - 1; i > 0; --i) {
    std::swap(part[static_cast<std::size_t>(i)], part[static_cast<std::size_t>(random.integer(0, i))]);
  }
  all.insert(all.end(), part.begin(), part.end());
}

Pool make_pool(const SetPlan& plan, bool test, const Gallery& gallery, std::size_t meshes) {
  const bool all = plan.name != "disjoint" && plan.name != "hard";
  Pool pool;
  if (plan.name == "hard") pool.conditions = Conditions::hard();
  for (int i = 0; i < gallery.count(); ++i) {
    if (all || gallery.held_out(i) == test) pool.backdrops[gallery.kind(i) == BackdropKind::photo ? 1 : 0].push_back(i);
  }
  for (int i = 0; i < static_cast<int>(liveries().size()); ++i) {
    if (all || (i % 3 == 2) == test) pool.liveries.push_back(i);
  }
  for (int i = 0; i < static_cast<int>(meshes); ++i) {
    if (all || (i % 3 == 2) == test) pool.meshes.push_back(i);
  }
  return pool;
}

const char* kHeader =
    "index,part,class,subject,visible,x0,y0,x1,y1,full_x0,full_y0,full_x1,full_y1,d_px,x,y,depth_m,range_m,focal_px,"
    "axis_x,axis_y,light,background,livery\n";

std::string line(int index, bool test, const Label& l, const Gallery& gallery) {
  char numbers[400];
  const auto box = [](const Sighting::Box& b) { return b.empty() ? Sighting::Box{0, 0, 0, 0} : b; };
  const Sighting::Box seen = box(l.visible_box), full = box(l.full_box);
  std::snprintf(numbers, sizeof numbers,
                "%d,%s,%d,%s,%.4f,%d,%d,%d,%d,%d,%d,%d,%d,%.3f,%.3f,%.3f,%.4f,%.4f,%.3f,%.3f,%.3f,", index,
                test ? "test" : "train", l.subject == Subject::target ? 1 : 0, name_of(l.subject), l.visible, seen.x0,
                seen.y0, seen.x1, seen.y1, full.x0, full.y0, full.x1, full.y1, l.d_px, l.x, l.y, l.depth_m, l.range_m,
                l.focal_px, l.axis_x, l.axis_y);
  return std::string(numbers) + l.light + "," + gallery.name(l.backdrop) + "," +
         (l.livery < 0 ? "" : liveries()[static_cast<std::size_t>(l.livery)].name) + "\n";
}

std::ofstream open_for_writing(const std::string& path) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) throw Error("cannot write " + path);
  return file;
}

}  // namespace

void SetPlan::check() const {
  if (name != "paper-split" && name != "disjoint" && name != "look-alike" && name != "hard") {
    throw Error("no set " + name + ": use paper-split, disjoint, look-alike or hard");
  }
  if (train < 0 || test < 0 || count() < 1 || train > 1000000 || test > 1000000) {
    throw Error("a set has 1 to 1,000,000 images in each part");
  }
}

std::vector<Subject> subjects(const SetPlan& plan) {
  sim::Random random(sim::scatter(plan.seed) ^ hash_bytes(plan.name.data(), plan.name.size()));
  std::vector<Subject> all;
  add_part(all, plan, plan.train, random);
  add_part(all, plan, plan.test, random);
  return all;
}

SetResult write_set(const SetPlan& plan, const Gallery& gallery, const Studio& studio, int threads,
                    const std::string& folder, const std::function<void(int)>& progress) {
  plan.check();
  const std::vector<Subject> all = subjects(plan);
  const Pool pools[2] = {make_pool(plan, false, gallery, studio.meshes().size()),
                         make_pool(plan, true, gallery, studio.meshes().size())};
  const u64 key = sim::scatter(plan.seed * 0x9e3779b97f4a7c15u ^ hash_bytes(plan.name.data(), plan.name.size()));
  std::ofstream images = open_for_writing(folder + "/images.u8"), labels = open_for_writing(folder + "/labels.csv");
  SetResult result;
  result.image_hash = kHashStart;
  result.label_hash = hash_bytes(kHeader, std::char_traits<char>::length(kHeader));
  result.backdrops_used.assign(static_cast<std::size_t>(gallery.count()), 0);
  labels << kHeader;

  const int batch_size = std::min(kBatch, plan.count());
  std::vector<u8> pixels(kBytes * static_cast<std::size_t>(batch_size));
  std::vector<Label> truths(static_cast<std::size_t>(batch_size));
  for (int first = 0; first < plan.count(); first += kBatch) {
    const int last = std::min(plan.count(), first + kBatch);
    std::atomic<int> next{first};
    const auto work = [&](bool reports) {
      for (int i = next++; i < last; i = next++) {
        const auto slot = static_cast<std::size_t>(i - first);
        const View2D<u8> image{pixels.data() + kBytes * slot, kSide_px, kSide_px, kSide_px};
        truths[slot] = studio.make(sim::scatter(key ^ static_cast<u64>(i)), all[static_cast<std::size_t>(i)],
                                   pools[i >= plan.train ? 1 : 0], image);
        if (reports) progress(i);
      }
    };
    std::vector<std::thread> helpers;
    for (int k = 1; k < threads; ++k) helpers.emplace_back(work, false);
    work(true);
    for (std::thread& helper : helpers) helper.join();

    for (int i = first; i < last; ++i) {
      const Label& truth = truths[static_cast<std::size_t>(i - first)];
      const std::string text = line(i, i >= plan.train, truth, gallery);
      result.label_hash = hash_bytes(text.data(), text.size(), result.label_hash);
      result.positives += truth.subject == Subject::target ? 1 : 0;
      ++result.backdrops_used[static_cast<std::size_t>(truth.backdrop)];
      labels << text;
    }
    const std::size_t bytes = kBytes * static_cast<std::size_t>(last - first);
    result.image_hash = hash_bytes(pixels.data(), bytes, result.image_hash);
    images.write(reinterpret_cast<const char*>(pixels.data()), static_cast<std::streamsize>(bytes));
    progress(last);
  }
  images.close();
  labels.close();
  if (!images || !labels) throw Error("cannot write all of the set into " + folder + ": is the disk full?");
  return result;
}

}  // namespace berth::navset
