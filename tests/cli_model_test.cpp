// berth model show: a network's file in people's and in machines' terms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "navigation/network.hpp"
#include "support/command_run.hpp"

namespace berth {
namespace {

using nlohmann::json;
using test::run_berth;
using test::ScratchFolder;
using testing::HasSubstr;

const std::string kTiny = std::string(BERTH_SOURCE_DIR) + "/training/tests/data/tiny.berthnet";

TEST(CliModel, ShowsEveryLayer) {
  const test::CommandRun run = run_berth({"model", "show", kTiny});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("name       tiny\n"));
  EXPECT_THAT(run.out, HasSubstr("notes      weights from a hash"));
  EXPECT_THAT(run.out, HasSubstr("256 x 256 px, the contrast of each window normalised"));
  // 63 * 63 positions, 8 channels of 8 * 2 words of four weights each.
  EXPECT_THAT(run.out, HasSubstr("| 1 | convolve | 8x2 | 4x1 | 0x0 | 1 | 63x63x8 | 520 | 2032128 | 2 |\n"));
  EXPECT_THAT(run.out, HasSubstr("| 2 | local_response_norm | | | | | 63x63x8 | | | |\n"));
  EXPECT_THAT(run.out, HasSubstr("| 3 | max_pool | 3x3 | 2x2 | | | 31x31x8 | | | |\n"));
  // 11 * 11 positions, 16 channels that see 4 of 8 channels.
  EXPECT_THAT(run.out, HasSubstr("| 4 | convolve | 5x5 | 3x3 | 2x2 | 2 | 11x11x16 | 1616 | 193600 | 2 |\n"));
  EXPECT_THAT(run.out, HasSubstr("| 7 | fully_connected | 5x5 | | | | 1x1x16 | 6416 | 6400 | 2 |\n"));
  EXPECT_THAT(run.out, HasSubstr("| 9 | heads | | | | | 1x1x5 | 45 | 40 | |\n"));
  EXPECT_THAT(run.out, HasSubstr("| | all | | | | | | 8733 | 2232296 | |\n"));
}

TEST(CliModel, ShowsTheSameAsJson) {
  const test::CommandRun run = run_berth({"model", "show", kTiny, "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const json shown = json::parse(run.out, nullptr, false);
  ASSERT_TRUE(shown.is_object()) << run.out;
  const Network network = read_network(kTiny);
  EXPECT_EQ(shown["name"], "tiny");
  EXPECT_EQ(shown["notes"], network.notes);
  EXPECT_EQ(shown["normalise"], true);
  ASSERT_EQ(shown["layers"].size(), network.layers.size() + 1);
  EXPECT_EQ(shown["layers"][3], json({{"kind", "convolve"},
                                      {"output", {11, 11, 16}},
                                      {"kernel", {5, 5}},
                                      {"stride", {3, 3}},
                                      {"pad", {2, 2}},
                                      {"groups", 2},
                                      {"parameters", 1616},
                                      {"macs", 193600},
                                      {"shift", 2}}));
  std::size_t parameters = 0;
  std::size_t macs = 0;
  for (const json& layer : shown["layers"]) {
    parameters += layer.value("parameters", std::size_t{0});
    macs += layer.value("macs", std::size_t{0});
  }
  EXPECT_EQ(shown["parameters"], parameters);
  EXPECT_EQ(parameters, network.parameters());
  EXPECT_EQ(shown["macs"], macs);
  EXPECT_EQ(shown["scales"]["d"], json({{"multiplier", network.d.multiplier}, {"shift", network.d.shift}}));
}

TEST(CliModel, LeavesOutTheGeometryThatANetworkLacksAndControlCharacters) {
  Network network = read_network(kTiny);
  network.name = "a\x1b[2Jb";
  network.normalise = false;
  network.mean = 101;
  network.heads.geometry = 0;
  network.heads.weights.resize(network.heads.weights.size() * 2 / 5);
  network.heads.bias.resize(2);
  const ScratchFolder folder;
  const std::string path = folder.write("two.berthnet", network_bytes(network));
  const test::CommandRun run = run_berth({"model", "show", path});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("name       a?[2Jb\n"));
  EXPECT_THAT(run.out, HasSubstr("minus a mean of 101 grey levels"));
  EXPECT_THAT(run.out, HasSubstr("| 9 | heads | | | | | 1x1x2 | 18 | 16 | |\n"));
  EXPECT_EQ(run.out.find("| x |"), std::string::npos);
}

TEST(CliModel, SaysWhatIsWrong) {
  const auto complains = [](std::vector<std::string> arguments, const std::string& about) {
    const test::CommandRun run = run_berth(std::move(arguments));
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_EQ(run.out, "");
    EXPECT_THAT(run.err, HasSubstr(about));
  };
  const ScratchFolder folder;
  complains({"model", "show", "no.berthnet"}, "no.berthnet: No such file");
  complains({"model", "show", folder.write("cut.berthnet", test::text_of(kTiny).substr(0, 500))}, "cut.berthnet: ");
  complains({"model", "show"}, "network is required");
  complains({"model", "shwo"}, "field 'model' is 'shwo'; use show");
  complains({"model"}, "subcommand is required");
}

}  // namespace
}  // namespace berth
