// berth run --config FILE: the same as its options, what is refused, and what berth config --explain says.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "support/command_run.hpp"

namespace berth {
namespace {

using test::CommandRun;
using test::run_berth;
using test::ScratchFolder;
using testing::HasSubstr;

const std::string kScene = "sim:" BERTH_SOURCE_DIR "/scenarios/track.toml";
const std::string kStream = "source = \"" + kScene + "\"\n";

/// What a run with the file says, with more options after it.
CommandRun run_with(const std::string& config, const std::vector<std::string>& more = {}) {
  const ScratchFolder folder;
  std::vector<std::string> arguments = {"run", "--config", folder.write("berth.toml", config)};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_berth(arguments);
}

/// Without the times that things took, which differ from run to run.
std::string steady(const CommandRun& run) {
  std::string text;
  for (nlohmann::json line : run.lines()) {
    line.erase("ms");
    line.erase("stages_us");
    text += line.dump() + "\n";
  }
  return text;
}

TEST(RunConfig, AFileIsItsOptions) {
  const CommandRun typed =
      run_berth({"run", "--source", kScene, "--max-frames", "2", "--family", "tag36h11,tag25h9", "--corners",
                 "photometric", "--track", "--full-every", "7", "--size", "0.12", "--json", "-"});
  const CommandRun filed = run_with(kStream +
                                    "max-frames = 2\nfamily = [\"tag36h11\", \"tag25h9\"]\ncorners = \"photometric\"\n"
                                    "track = true\nfull-every = 7\nsize = 0.12\nfilter = false\n"
                                    "json = \"-\"\n");
  ASSERT_EQ(typed.exit_code, 0) << typed.err;
  ASSERT_EQ(filed.exit_code, 0) << filed.err;
  ASSERT_EQ(filed.lines().size(), 2u);
  EXPECT_EQ(steady(filed), steady(typed));
}

TEST(RunConfig, WhatIsTypedComesFirst) {
  const std::string config = kStream + "max-frames = 5\njson = \"-\"\n";
  EXPECT_EQ(run_with(config, {"--max-frames=1"}).lines().size(), 1u);
  EXPECT_EQ(run_with(config, {"--max-frames", "2"}).lines().size(), 2u);
}

TEST(RunConfig, WhatIsWrongIsNamedWithItsLineAndARemedy) {
  const auto said = [](const std::string& line) {
    const CommandRun run = run_with(kStream + line + "\n");
    EXPECT_EQ(run.exit_code, 2) << line;
    return run.err;
  };
  EXPECT_THAT(said("camra = \"camera.yaml\""),
              HasSubstr("berth.toml:2: field 'camra' is unknown; did you mean 'camera'? berth config --explain"));
  EXPECT_THAT(said("siez = 0.1"), HasSubstr("did you mean 'size'?"));
  EXPECT_THAT(said("config = \"other.toml\""), HasSubstr("berth.toml:2: field 'config' is unknown"));
  EXPECT_THAT(said("filter = 1"), HasSubstr("field 'filter' switches something on; give true or false"));
  EXPECT_THAT(said("size = true"), HasSubstr("field 'size' is neither a text nor a number"));
  EXPECT_THAT(said("size = [0.1, 0.2]"), HasSubstr("field 'size' is an array; give one value"));
  EXPECT_THAT(said("[size]\nm = 0.1"), HasSubstr("field 'size' is a table; keys stand at the top"));
  EXPECT_THAT(said("size = "), HasSubstr("berth.toml:2: not TOML: "));
  EXPECT_THAT(said("corners = \"best\""), HasSubstr("--corners"));
  EXPECT_THAT(run_berth({"run", "--config", "/nowhere.toml"}).err, HasSubstr("/nowhere.toml: the configuration"));
  EXPECT_THAT(run_berth({"run", "--config=/tmp"}).err, HasSubstr("/tmp: the configuration cannot be read"));
}

TEST(RunConfig, ExplainHasEveryOptionOfRunAndItsDefaultsAreTaken) {
  // Help names an option at a line's beginning: "  --name TYPE" or "  -n,--name".
  std::set<std::string> options;
  std::istringstream help(run_berth({"run", "--help"}).out);
  for (std::string line; std::getline(help, line);) {
    const std::size_t name = line.find("--"), end = line.find(' ', 2);
    if (line.compare(0, 3, "  -") == 0 && name < end) options.insert(line.substr(name + 2, end - name - 2));
  }
  options.erase("help");
  options.erase("config");
  ASSERT_GT(options.size(), 20u);

  std::set<std::string> keys;
  std::string defaults, before;
  std::istringstream explained(run_berth({"config", "--explain"}).out);
  for (std::string line; std::getline(explained, line); before = line) {
    if (line.empty()) continue;
    EXPECT_EQ(line.compare(0, 2, "# "), 0) << line;
    const std::size_t equals = line.find(" =");
    if (equals == std::string::npos || line.find(' ', 2) != equals) continue;
    keys.insert(line.substr(2, equals - 2));
    // What goes with another option, or has a group of its own, is not taken alone.
    const bool stands_alone =
        before.find("; needs ") == std::string::npos && before.find("; under ") == std::string::npos;
    if (equals + 2 < line.size() && stands_alone) defaults += line.substr(2) + "\n";
  }
  EXPECT_EQ(keys, options);
  EXPECT_THAT(defaults, HasSubstr("corners = \"edges\"\n"));
  const CommandRun run = run_with(defaults, {"--source", kScene, "--max-frames", "1"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

}  // namespace
}  // namespace berth
