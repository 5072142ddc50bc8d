// The fuzzers' targets on their seeds, whole, cut off and damaged: what every build can do without a fuzzer.
#include <glob.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "fuzz/targets.hpp"
#include "support/pictures.hpp"

namespace berth::fuzz {
namespace {

using Bytes = std::vector<u8>;

std::vector<std::string> files_of(const Target& target) {
  std::vector<std::string> patterns = target.seeds;
  patterns.push_back("tests/fuzz/corpus/" + std::string(target.name) + "/*");
  std::vector<std::string> files;
  for (const std::string& pattern : patterns) {
    glob_t found = {};
    if (glob((BERTH_SOURCE_DIR "/" + pattern).c_str(), 0, nullptr, &found) == 0) {
      files.insert(files.end(), found.gl_pathv, found.gl_pathv + found.gl_pathc);
    }
    globfree(&found);
  }
  return files;
}

Bytes read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

class Fuzz : public ::testing::TestWithParam<Target> {};

TEST_P(Fuzz, AnswersWhateverItIsGiven) {
  const Target& target = GetParam();
  const std::vector<std::string> files = files_of(target);
  ASSERT_FALSE(files.empty()) << "no seed";
  pictures::Random random(7);
  target.run(nullptr, 0);
  for (std::size_t file = 0; file < files.size(); ++file) {
    const std::string& path = files[file];
    SCOPED_TRACE(path);
    const Bytes whole = read(path);
    ASSERT_FALSE(whole.empty());
    target.run(whole.data(), whole.size());
    // Pairs of a cut one and a damaged one, shared out evenly: of many files not every one has some.
    const std::size_t pairs = static_cast<std::size_t>(target.inputs) / 2;
    const int share = static_cast<int>(pairs * (file + 1) / files.size() - pairs * file / files.size());
    for (int i = 0; i < share; ++i) {
      target.run(whole.data(), static_cast<std::size_t>(random.below(static_cast<int>(whole.size()))));
      Bytes damaged = whole;
      for (int k = 0; k <= i % 4; ++k) {
        const auto at = static_cast<std::size_t>(random.below(static_cast<int>(whole.size())));
        damaged[at] = static_cast<u8>(random.below(2) == 0 ? random.below(256) : damaged[at] ^ (1 << random.below(8)));
      }
      target.run(damaged.data(), damaged.size());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, Fuzz, ::testing::ValuesIn(targets()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace berth::fuzz
