#include <dirent.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "berth/error.hpp"
#include "navset/hash.hpp"
#include "navset/set.hpp"
#include "navset/target.hpp"

namespace berth::navset {
namespace {

// A folder that goes away, with the flat files in it, at the end of the test.
class NewFolder {
 public:
  NewFolder() : path_(::testing::TempDir() + "navset-XXXXXX") {
    if (mkdtemp(path_.data()) == nullptr) throw Error("no temporary folder");
  }
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;
  ~NewFolder() {
    if (DIR* directory = opendir(path_.c_str())) {
      while (const dirent* entry = readdir(directory)) std::remove((path_ + "/" + entry->d_name).c_str());
      closedir(directory);
    }
    rmdir(path_.c_str());
  }
  operator const std::string&() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Rows of labels.csv by column name.
std::vector<std::map<std::string, std::string>> rows(const std::string& folder) {
  std::ifstream file(folder + "/labels.csv");
  std::string text, word;
  std::getline(file, text);
  std::vector<std::string> names;
  for (std::istringstream line(text); std::getline(line, word, ',');) names.push_back(word);
  std::vector<std::map<std::string, std::string>> all;
  while (std::getline(file, text)) {
    std::map<std::string, std::string> row;
    std::istringstream line(text);
    for (const std::string& name : names) {
      word.clear();
      std::getline(line, word, ',');
      row[name] = word;
    }
    all.push_back(row);
  }
  return all;
}

SetPlan small(const std::string& name, int train, int test) {
  SetPlan plan;
  plan.name = name;
  plan.train = train;
  plan.test = test;
  return plan;
}

class Generator : public ::testing::Test {
 protected:
  SetResult write(const SetPlan& plan, int threads, const std::string& folder) {
    return write_set(plan, gallery_, studio_, threads, folder, [](int) {});
  }
  void check_labels(const std::string& set, double least_px, int least_hidden);

  Gallery gallery_{""};
  Studio studio_{gallery_, {}};
};

TEST_F(Generator, WritesTheSameBytesForAnyNumberOfThreads) {
  const SetPlan plan = small("paper-split", 28, 12);
  const NewFolder one;
  const SetResult expected = write(plan, 1, one);
  for (const int threads : {2, 5}) {
    const NewFolder folder;
    const SetResult result = write(plan, threads, folder);
    EXPECT_EQ(result.image_hash, expected.image_hash) << threads << " threads";
    EXPECT_EQ(result.label_hash, expected.label_hash) << threads << " threads";
    EXPECT_TRUE(content(folder / "images.u8") == content(one / "images.u8")) << threads << " threads";
  }
  const std::string pixels = content(one / "images.u8"), labels = content(one / "labels.csv");
  EXPECT_EQ(pixels.size(), 40u * 256 * 256);
  EXPECT_EQ(hash_bytes(pixels.data(), pixels.size()), expected.image_hash);
  EXPECT_EQ(hash_bytes(labels.data(), labels.size()), expected.label_hash);
  SetPlan other = plan;
  other.seed = 2;
  EXPECT_NE(write(other, 2, NewFolder()).image_hash, expected.image_hash);
}

// hashes.txt, a line "NAME seed N TRAIN+TEST photographs N meshes N images HASH labels HASH" a set.
TEST_F(Generator, WritesTheCommittedHashOfEachSmallSet) {
  std::ifstream file(BERTH_NAVSET_HASHES);
  ASSERT_TRUE(file) << BERTH_NAVSET_HASHES;
  int checked = 0;
  std::string text, skip, images, labels, size;
  while (std::getline(file, text)) {
    SetPlan plan;
    int photographs = -1, meshes = -1;
    std::istringstream line(text);
    if (!(line >> plan.name >> skip >> plan.seed >> size >> skip >> photographs >> skip >> meshes >> skip >> images >>
          skip >> labels) ||
        plan.name[0] == '#') {
      continue;
    }
    ASSERT_EQ(std::sscanf(size.c_str(), "%d+%d", &plan.train, &plan.test), 2) << text;
    if (plan.count() > 100 || photographs != 0 || meshes != 0) continue;
    const SetResult result = write(plan, 2, NewFolder());
    EXPECT_EQ(result.image_hash, std::stoull(images, nullptr, 16)) << text;
    EXPECT_EQ(result.label_hash, std::stoull(labels, nullptr, 16)) << text;
    ++checked;
  }
  EXPECT_EQ(checked, 4);
}

// Of 100 images of `set`, whose targets are `least_px` or more across and `least_hidden` or more of them partly hidden.
void Generator::check_labels(const std::string& set, double least_px, int least_hidden) {
  SCOPED_TRACE(set);
  const NewFolder folder;
  write(small(set, 100, 0), 2, folder);
  const auto all = rows(folder);
  ASSERT_EQ(all.size(), 100u);
  int positives = 0, hidden = 0;
  for (const auto& row : all) {
    const auto number = [&row](const char* name) { return std::stod(row.at(name)); };
    EXPECT_EQ(row.at("class") == "1", row.at("subject") == "target");
    if (row.at("class") != "1") {
      EXPECT_EQ(number("d_px"), 0);
      EXPECT_EQ(number("visible"), 0);
      continue;
    }
    ++positives;
    const double visible = number("visible"), d = number("d_px"), z = number("depth_m");
    EXPECT_GE(visible, kLeastVisible);
    EXPECT_LE(visible, 1);
    hidden += visible < 0.95 ? 1 : 0;
    EXPECT_GE(d, least_px);
    EXPECT_LE(d, 230);
    EXPECT_NEAR(d, number("focal_px") * kTargetDiameter_m / z, 0.02);
    const double u = (number("x") - number("axis_x")) / number("focal_px");
    const double v = (number("y") - number("axis_y")) / number("focal_px");
    EXPECT_NEAR(number("range_m"), z * std::sqrt(1 + u * u + v * v), 0.001 * z);
    // What is seen lies in the image, in the silhouette, and in the sphere's image; that may be 5 % larger than d.
    EXPECT_LE(number("full_x0"), number("x0"));
    EXPECT_GE(number("full_x1"), number("x1"));
    EXPECT_LE(number("full_y0"), number("y0"));
    EXPECT_GE(number("full_y1"), number("y1"));
    EXPECT_GE(number("x0"), 0);
    EXPECT_LE(number("y1"), 255);
    EXPECT_GE(number("full_x0"), number("x") - 0.56 * d - 2);
    EXPECT_LE(number("full_x1"), number("x") + 0.56 * d + 2);
  }
  EXPECT_EQ(positives, 29);
  EXPECT_GE(hidden, least_hidden);
}

TEST_F(Generator, LabelsAgreeWithTheCamera) {
  check_labels("paper-split", 40, 3);
  check_labels("hard", 8, 5);
}

TEST_F(Generator, KeepsTheTestsBackgroundsAndLiveriesOutOfDisjointTraining) {
  const NewFolder folder;
  write(small("disjoint", 60, 40), 2, folder);
  std::set<std::string> seen[2];
  for (const auto& row : rows(folder)) {
    std::set<std::string>& part = seen[row.at("part") == "test" ? 1 : 0];
    part.insert(row.at("background"));
    if (!row.at("livery").empty()) part.insert(row.at("livery"));
  }
  ASSERT_GT(seen[1].size(), 20u);
  for (const std::string& name : seen[1]) EXPECT_EQ(seen[0].count(name), 0u) << name;
}

TEST(Sets, HaveThePapersProportions) {
  for (const char* name : {"paper-split", "disjoint", "look-alike", "hard"}) {
    SetPlan plan;
    plan.name = name;
    const std::vector<Subject> all = subjects(plan);
    ASSERT_EQ(all.size(), 13700u);
    EXPECT_EQ(std::count(all.begin(), all.begin() + 9590, Subject::target), 2800) << name;
    EXPECT_EQ(std::count(all.begin() + 9590, all.end(), Subject::target), 1200) << name;
    const auto satellites = std::count(all.begin(), all.end(), Subject::satellite);
    if (plan.name == "look-alike") {
      EXPECT_EQ(satellites, 9700);
    } else {
      EXPECT_NEAR(static_cast<double>(satellites), 0.08 * 9700, 2);
    }
  }
}

TEST(Sets, RefuseWhatMakesNoSense) {
  EXPECT_THROW(small("no-such", 1, 1).check(), Error);
  EXPECT_THROW(small("disjoint", 0, 0).check(), Error);
  EXPECT_THROW(small("disjoint", -1, 5).check(), Error);
  EXPECT_THROW(Gallery("/no/such/folder"), Error);
}

TEST(Gallery, HasAThousandBackgroundsAndHoldsSomeOfEachKindOut) {
  const Gallery gallery("");
  EXPECT_EQ(gallery.count(), 1000);
  std::map<BackdropKind, int> kept, held;
  for (int i = 0; i < gallery.count(); ++i) ++(gallery.held_out(i) ? held : kept)[gallery.kind(i)];
  EXPECT_EQ(kept.size(), 5u);
  EXPECT_EQ(held.size(), 5u);
  for (const auto& [kind, count] : held) EXPECT_EQ(count * 7, kept[kind] * 3) << name_of(kind);
}

TEST(Gallery, ReadsPhotographsAndKeepsOnesCropsTogether) {
  const NewFolder folder;
  std::ofstream index(folder / "index.txt");
  for (int i = 0; i < 40; ++i) {
    const std::string name = "photo-" + std::to_string(i) + ".pgm";
    std::ofstream(folder / name, std::ios::binary) << "P5\n64 64\n255\n" << std::string(64 * 64, static_cast<char>(i));
    index << name << " source-" << i / 4 << "\n";
  }
  index.close();
  const Gallery gallery(folder);
  ASSERT_EQ(gallery.photo_count(), 40);
  EXPECT_EQ(gallery.pixels(1007).at(5, 5), 7);
  EXPECT_EQ(gallery.name(1007), "photo-7");
  int held = 0;
  for (int i = 0; i < 40; ++i) {
    held += gallery.held_out(1000 + i) ? 1 : 0;
    EXPECT_EQ(gallery.held_out(1000 + i), gallery.held_out(1000 + i / 4 * 4));
  }
  EXPECT_GT(held, 0);
  EXPECT_LT(held, 40);
  std::ofstream(folder / "photo-3.pgm", std::ios::binary) << "P5\n64 64\n255\nshort";
  EXPECT_THROW(Gallery{folder}, Error);
}

}  // namespace
}  // namespace berth::navset
