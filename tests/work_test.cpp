// Work counted in the kernel text, machine descriptions, and projections of one on the other.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "berth/error.hpp"
#include "navigation/network_check.hpp"
#include "support/command_run.hpp"
#include "support/op_case.hpp"
#include "support/scratch_folder.hpp"
#include "work/count_step.hpp"
#include "work/frames.hpp"
#include "work/machine.hpp"
#include "work/projection.hpp"

namespace berth::work {
namespace {

using testing::HasSubstr;

std::uint64_t of(const StepWork& work, int lockstep, Kind kind) {
  return work.slots[lockstep_index(lockstep)][static_cast<std::size_t>(kind)];
}

/// Buffers in host memory that hold these words.
class HostBuffers {
 public:
  explicit HostBuffers(const std::vector<std::vector<u32>>& words) : backend_(open_backend("cpu")) {
    for (const std::vector<u32>& one : words) {
      buffers_.push_back(backend_->make_buffer(one.size() * 4));
      std::copy(one.begin(), one.end(), static_cast<u32*>(buffers_.back()->host()));
    }
  }
  std::vector<Buffer*> all() const {
    std::vector<Buffer*> pointers;
    for (const auto& one : buffers_) pointers.push_back(one.get());
    return pointers;
  }
  std::vector<u32> words(std::size_t index) const {
    const u32* from = static_cast<const u32*>(buffers_[index]->host());
    return {from, from + buffers_[index]->bytes() / 4};
  }

 private:
  std::unique_ptr<Backend> backend_;
  std::vector<std::unique_ptr<Buffer>> buffers_;
};

Step step_of(const cases::OpCase& op_case, const HostBuffers& buffers) {
  return {op_case.op, op_case.params, buffers.all(), op_case.items};
}

/// Contours that go round `lengths` nodes each, every node's successor the next.
cases::OpCase walks(const std::vector<int>& lengths) {
  int total = 0;
  std::vector<u32> contours(CONTOUR_HEADER, 0);
  std::vector<u32> nodes;
  for (const int length : lengths) {
    contours.insert(contours.end(), {static_cast<u32>(total), static_cast<u32>(length), 0u, static_cast<u32>(total)});
    for (int i = 0; i < length; ++i) nodes.push_back(static_cast<u32>(i + 1 < length ? 1 : 1 - length) << 16);
    total += length;
  }
  const int slots = static_cast<int>(lengths.size());
  return cases::make_case("walks", contour_trace_params{slots},
                          {nodes, contours, std::vector<u32>(static_cast<std::size_t>(total))}, slots);
}

TEST(CountStep, AWalkByHand) {
  for (const int nodes : {3, 100}) {
    const cases::OpCase walk = walks({nodes});
    const HostBuffers buffers(walk.buffers);
    const StepWork work = count_step(step_of(walk, buffers));
    const std::uint64_t n = static_cast<std::uint64_t>(nodes);
    EXPECT_EQ(work.groups, 1);
    EXPECT_EQ(of(work, 1, Kind::load), 4 + n);  // the record's four words, then the nodes
    EXPECT_EQ(of(work, 1, Kind::store), n);
    EXPECT_EQ(of(work, 1, Kind::multiply), 1 + 2 * n);  // the record's place; x and y in half pixels
    // The record tells the first node, and each node the next.
    EXPECT_EQ(work.chain, 1 + n);
    // All 128 items compare their id with the capacity. The walk's loop is asked n + 1 times; each node's step is
    // shifted out of its word and its y into a point's, and asked for its parity; an even step once more for the id's.
    EXPECT_EQ(of(work, 1, Kind::shift), 128 + (n + 1) + 3 * n + n % 2);
    EXPECT_EQ(work.most_in_group, [&] {
      std::uint64_t all = 0;
      for (const std::uint64_t count : work.slots[0]) all += count;
      return all;
    }());
  }
}

TEST(CountStep, NeighboursWaitForTheLongest) {
  const cases::OpCase uneven = walks({1, 3});
  const HostBuffers buffers(uneven.buffers);
  const StepWork work = count_step(step_of(uneven, buffers));
  EXPECT_EQ(of(work, 1, Kind::store), 4u);
  EXPECT_EQ(of(work, 4, Kind::store), 3u * 4);
  EXPECT_EQ(of(work, 32, Kind::store), 3u * 32);
  EXPECT_EQ(work.chain, 1u + 3);
  EXPECT_THROW(lockstep_index(3), Error);
}

TEST(CountStep, WritesTheReferencesWords) {
  const std::unique_ptr<Backend> reference = open_backend("reference");
  for (const Op op : all_ops()) {
    std::vector<cases::OpCase> some = cases::cases_for(op);
    if (some.size() > 5) some.resize(5);
    for (const cases::OpCase& op_case : some) {
      const HostBuffers buffers(op_case.buffers);
      count_step(step_of(op_case, buffers));
      const std::vector<std::vector<u32>> expected = cases::run_case(op_case, *reference);
      for (std::size_t i = 0; i < expected.size(); ++i) {
        // run_case adds guard words.
        const std::vector<u32> found = buffers.words(i);
        EXPECT_TRUE(std::equal(found.begin(), found.end(), expected[i].begin())) << op_case.name << ", buffer " << i;
      }
    }
  }
}

TEST(CountStep, AlikeGroupsMayBeLeftOut) {
  const max_pool_params p{1, 64, 64, 2, 32, 32, 2, 2};
  const HostBuffers buffers({std::vector<u32>(64 * 64 * 2, 5), std::vector<u32>(32 * 32 * 2)});
  const std::vector<Buffer*> all = buffers.all();
  const Step pool = make_step(p, {all[0], all[1]}, 32 * 32 * 2);
  const StepWork whole = count_step(pool);
  const StepWork sampled = count_step(pool, 4);
  EXPECT_EQ(whole.slots, sampled.slots);
  EXPECT_EQ(of(whole, 1, Kind::load), 32u * 32 * 2 * 4);
  EXPECT_EQ(of(whole, 1, Kind::bytes), 32u * 32 * 2 * 4);
}

Machine round_machine() {
  Machine machine;
  machine.name = "a \"round\" machine";
  machine.backend = "cuda";
  machine.memory_gb_s = 2;
  machine.memory_share = 0.5;
  machine.cache_kb = 1;
  machine.cache_gb_s = 4;
  machine.latency_ns = 100;
  machine.units = 2;
  machine.lanes = 32;
  machine.lockstep = 32;
  machine.clock_ghz = 0.5;
  machine.busy_share = 0.25;
  machine.cycles.fill(2);
  machine.step_ns = 10;
  machine.frame_us = 3;
  machine.launch_us = 1;
  machine.copy_us = 0.5;
  return machine;
}

/// A launch that reads 1000 bytes and writes 500, does 8000 operations in 32 lanes, and has a way of 20 loads.
FrameLoad one_launch(const Buffer& from, const Buffer& to) {
  StepLoad step;
  step.traffic.op = Op::halve;
  step.traffic.read = 1000;
  step.traffic.written = 500;
  step.traffic.arguments = {{&from, 1000}, {&to, 500}};
  step.work.op = Op::halve;
  step.work.slots[lockstep_index(32)][static_cast<std::size_t>(Kind::simple)] = 8000;
  step.work.span = 400;
  step.work.steps = 100;
  step.work.chain = 20;
  FrameLoad load;
  load.steps = {step};
  load.uploads = {{&from, 2000}};
  return load;
}

TEST(Projection, ByHand) {
  const HostBuffers buffers({{0}, {0}});
  const FrameLoad load = one_launch(*buffers.all()[0], *buffers.all()[1]);
  const FrameTime time = project(load, round_machine());
  ASSERT_EQ(time.steps.size(), 1u);
  const StepTime& step = time.steps[0];
  // The cache holds 1024 bytes: the 1000 that were just uploaded, but not the 500 whose buffer was touched before them.
  EXPECT_DOUBLE_EQ(step.bytes_us, 500 / 1e3 + 1000 / 4e3);
  // 8000 operations of 2 cycles on 2 x 32 lanes of 0.5 GHz, a quarter of them busy.
  EXPECT_DOUBLE_EQ(step.work_us, 8000 * 2 / (64 * 0.5 * 0.25 * 1e3));
  // 100 steps of 10 ns are longer than 400 cycles of 2 ns; 20 loads of 100 ns.
  EXPECT_DOUBLE_EQ(step.way_us, 1.0 + 2.0);
  EXPECT_DOUBLE_EQ(step.us, 1 + 3.0);
  EXPECT_DOUBLE_EQ(time.copies_us, 0.5 + 2000 / 1e3);
  EXPECT_DOUBLE_EQ(time.us, 3 + 4.0 + 2.5);
}

TEST(Projection, AGroupInTurnIsOneThreads) {
  const HostBuffers buffers({{0}, {0}});
  FrameLoad load = one_launch(*buffers.all()[0], *buffers.all()[1]);
  load.steps[0].work.slots[0][static_cast<std::size_t>(Kind::simple)] = 4000;
  load.steps[0].work.most_in_group = 3000;  // of both groups' 4000
  Machine machine = round_machine();
  machine.items_in_parallel = false;
  const StepTime step = project(load, machine).steps[0];
  EXPECT_DOUBLE_EQ(step.work_us, 2.0);
  EXPECT_DOUBLE_EQ(step.way_us, 3.0);  // three quarters of it in one of two threads
}

TEST(Projection, CachesKeepWhatFits) {
  const HostBuffers buffers({{0}, {0}});
  const FrameLoad load = one_launch(*buffers.all()[0], *buffers.all()[1]);
  EXPECT_THAT(bytes_from_memory(load, 1024), testing::ElementsAre(500));
  EXPECT_THAT(bytes_from_memory(load, 900), testing::ElementsAre(1500));
  // All of a frame fits: what the frame before has left.
  EXPECT_THAT(bytes_from_memory(load, 1500), testing::ElementsAre(0));
}

std::string error_of(const std::string& text) {
  const test::ScratchFolder folder;
  const std::string path = folder / "machine.toml";
  std::ofstream(path) << text;
  try {
    read_machine(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(MachineFile, ReadsWhatItWrites) {
  const test::ScratchFolder folder;
  const std::string path = folder / "machine.toml";
  const Machine written = round_machine();
  std::ofstream(path) << machine_text(written, "made by hand\nfor a test");
  const Machine read = read_machine(path);
  EXPECT_EQ(machine_text(read, ""), machine_text(written, ""));
  EXPECT_EQ(read.name, written.name);
  EXPECT_EQ(read.lockstep, 32);
  EXPECT_DOUBLE_EQ(read.busy_share, 0.25);
  EXPECT_DOUBLE_EQ(read.cycles[static_cast<std::size_t>(Kind::store)], 2);
}

TEST(MachineFile, SaysWhatIsWrong) {
  const std::string good = machine_text(round_machine(), "");
  EXPECT_EQ(error_of(good), "");
  EXPECT_THAT(error_of(replaced(good, "share = 0.5", "share = 1.5")),
              HasSubstr("machine.toml:7: field 'memory.share' is 1.5; use a value from 0.001 to 1"));
  EXPECT_THAT(error_of(replaced(good, "lockstep = 32", "lockstep = 7")),
              HasSubstr("field 'compute.lockstep' is 7; use 1, 4, 8, 16, 32 or 64"));
  EXPECT_THAT(error_of(replaced(good, "dot = 2", "dots = 2")), HasSubstr("field 'cycles.dot' is missing; give"));
  EXPECT_THAT(error_of(good + "watts = 10\n"), HasSubstr("field 'launch.watts' is unknown here; remove it"));
  EXPECT_THAT(error_of(replaced(good, "\"cuda\"", "\"abacus\"")),
              HasSubstr("field 'backend' is \"abacus\"; use one of"));
  EXPECT_THAT(error_of("name = "), HasSubstr("not TOML"));
  EXPECT_THAT(error_of(""), HasSubstr("the machine description is empty"));
}

TEST(MachineFile, ThoseThatComeWithBerthAreGood) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(BERTH_SOURCE_DIR "/bench/machines")) {
    EXPECT_NO_THROW(read_machine(entry.path().string())) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 5u);
}

TEST(PaperSizedNetwork, HasThePapersLayers) {
  const Network network = paper_sized_network();
  EXPECT_NO_THROW(check_network(network, network.name));
  const std::vector<Shape> shapes = network.shapes(256, 256);
  std::vector<int> sides;
  for (const Shape& shape : shapes) sides.push_back(shape.height);
  EXPECT_THAT(sides, testing::ElementsAre(256, 62, 62, 30, 30, 30, 14, 14, 14, 14, 14, 14, 14, 6, 1, 1));
  EXPECT_EQ(shapes.back().channels, 4096);
  // AlexNet's weights but the first layer's, which has 12 columns for 11, and five heads for a thousand.
  const std::size_t weights = 96 * 11 * 12 + 256 * 48 * 25 + 384 * 256 * 9 + 384 * 192 * 9 + 256 * 192 * 9 +
                              4096 * 9216 + 4096 * 4096 + 5 * 4096;
  EXPECT_EQ(network.parameters(), weights + 96 + 256 + 384 + 384 + 256 + 4096 + 4096 + 5);
}

}  // namespace
}  // namespace berth::work
