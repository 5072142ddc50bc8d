#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "bench_explain.hpp"

namespace berth::cli {
namespace {

/// Indices of a mode's launches by operation, operations in order of their first launch.
std::vector<std::pair<Op, std::vector<std::size_t>>> by_operation(const ExplainedMode& mode) {
  std::vector<std::pair<Op, std::vector<std::size_t>>> all;
  for (std::size_t i = 0; i < mode.load.steps.size(); ++i) {
    const Op op = mode.load.steps[i].work.op;
    auto at = std::find_if(all.begin(), all.end(), [op](const auto& one) { return one.first == op; });
    if (at == all.end()) at = all.insert(all.end(), {op, {}});
    at->second.push_back(i);
  }
  return all;
}

double sum_of(const work::Counts& counts) {
  return static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}));
}

/// What the launches of `indices` give, added up.
template <class F>
double sum_over(const std::vector<std::size_t>& indices, F f) {
  double sum = 0;
  for (const std::size_t i : indices) sum += static_cast<double>(f(i));
  return sum;
}

std::vector<std::size_t> all_launches(const ExplainedMode& mode) {
  std::vector<std::size_t> all(mode.load.steps.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

std::vector<std::string> count_row(const std::string& name, const ExplainedMode& mode,
                                   const std::vector<std::size_t>& indices) {
  const auto& steps = mode.load.steps;
  const double done = sum_over(indices, [&](std::size_t i) { return sum_of(steps[i].work.slots[0]); });
  const double warps =
      sum_over(indices, [&](std::size_t i) { return sum_of(steps[i].work.slots[work::lockstep_index(32)]); });
  const auto most = [&](auto member) {
    std::uint64_t value = 0;
    for (const std::size_t i : indices) value = std::max(value, steps[i].work.*member);
    return fmt::format("{}", value);
  };
  return {name,
          fmt::format("{}", indices.size()),
          fmt::format("{:.0f}", sum_over(indices, [&](std::size_t i) { return steps[i].work.groups; })),
          fmt::format("{:.1f}", sum_over(indices, [&](std::size_t i) { return steps[i].traffic.read; }) / 1e3),
          fmt::format("{:.1f}", sum_over(indices, [&](std::size_t i) { return steps[i].traffic.written; }) / 1e3),
          fmt::format("{:.3f}", done / 1e6),
          fmt::format("{:.1f}", done > 0 ? warps / done : 0),
          most(&work::StepWork::steps),
          most(&work::StepWork::chain)};
}

const char* why(const work::StepTime& step, double launch_us) {
  const double most = std::max({step.bytes_us, step.work_us, step.way_us});
  if (launch_us > most) return "launch";
  return most == step.way_us ? "way" : most == step.work_us ? "work" : "bytes";
}

const char* const kPreparing[] = {"flat_field", "halve",     "tile_extrema",   "tile_histogram",    "normalize",
                                  "threshold",  "despeckle", "extract_window", "window_statistics", "normalize_window"};
bool prepares(Op op) {
  const std::string name = name_of(op);
  return std::find(std::begin(kPreparing), std::end(kPreparing), name) != std::end(kPreparing);
}

const ExplainedMode* find_mode(const ExplainedModes& modes, const std::string& name) {
  for (const ExplainedMode& mode : modes.modes()) {
    if (mode.name == name) return &mode;
  }
  return nullptr;
}

/// A mode's ms in preparing the image and in the rest, from its steps' µs.
template <class F>
std::pair<double, double> parts_ms(const ExplainedMode& mode, F step_us) {
  double before = 0, after = 0;
  for (std::size_t i = 0; i < mode.load.steps.size(); ++i) {
    (prepares(mode.load.steps[i].work.op) ? before : after) += step_us(i) / 1e3;
  }
  return {before, after};
}

std::string ms_text(double ms) { return fmt::format(ms < 0.1 ? "{:.4f}" : ms < 10 ? "{:.3f}" : "{:.1f}", ms); }

}  // namespace

std::vector<BenchTable> count_tables(const ExplainedModes& modes) {
  std::vector<BenchTable> tables;
  for (const ExplainedMode& mode : modes.modes()) {
    BenchTable table;
    table.title = fmt::format("{}: {}, counted", mode.name, mode.describes);
    table.head = {"operation", "launches", "groups", "read KB", "written KB", "Mops", "x at 32", "steps", "chain"};
    for (const auto& [op, indices] : by_operation(mode)) table.rows.push_back(count_row(name_of(op), mode, indices));
    table.rows.push_back(count_row("all", mode, all_launches(mode)));
    double up = 0, down = 0;
    for (const ArgumentTraffic& copy : mode.load.uploads) up += static_cast<double>(copy.bytes);
    for (const ArgumentTraffic& copy : mode.load.downloads) down += static_cast<double>(copy.bytes);
    table.note = fmt::format(
        "Mops: 32-bit operations of the kernel text; x at 32: slots where 32 items go in lockstep, over those used; "
        "steps "
        "and chain: the longest way of arithmetic and of loads; {:.1f} KB up, {:.1f} KB down.",
        up / 1e3, down / 1e3);
    tables.push_back(std::move(table));
  }
  return tables;
}

std::vector<BenchTable> measured_tables(const ExplainedModes& modes, const std::vector<MeasuredBackend>& measured,
                                        std::size_t pixels) {
  std::vector<BenchTable> tables;
  std::size_t at = 0;
  for (const ExplainedMode& mode : modes.modes()) {
    if (mode.counted_only) continue;
    BenchTable table;
    table.title = mode.name + ": measured on this machine, and as predicted from its description, us";
    table.head = {"operation"};
    for (const MeasuredBackend& one : measured) {
      table.head.insert(table.head.end(), {one.backend, "predicted", "ns/px", "% memory", "% integer"});
    }
    const auto row = [&](const std::string& name, const std::vector<std::size_t>& indices) {
      std::vector<std::string> cells = {name};
      for (const MeasuredBackend& one : measured) {
        const MeasuredMode& m = one.modes[at];
        const double us = std::max(sum_over(indices, [&](std::size_t i) { return m.steps[i]; }), 1e-3);
        const auto predicted = [&](auto member) {
          return sum_over(indices, [&](std::size_t i) { return m.predicted.steps[i].*member; });
        };
        cells.push_back(fmt::format("{:.1f}", us));
        cells.push_back(fmt::format("{:.1f}", predicted(&work::StepTime::us)));
        cells.push_back(fmt::format("{:.3f}", us * 1e3 / static_cast<double>(pixels)));
        cells.push_back(fmt::format("{:.0f}", 100 * predicted(&work::StepTime::bytes_us) / us));
        cells.push_back(fmt::format("{:.0f}", 100 * predicted(&work::StepTime::work_us) * one.machine.busy_share / us));
      }
      return cells;
    };
    for (const auto& [op, indices] : by_operation(mode)) table.rows.push_back(row(name_of(op), indices));
    table.rows.push_back(row("all", all_launches(mode)));
    std::vector<std::string> frame = {"frame"};
    for (const MeasuredBackend& one : measured) {
      const MeasuredMode& m = one.modes[at];
      frame.insert(frame.end(), {fmt::format("{:.1f}", m.frame), fmt::format("{:.1f}", m.predicted.us),
                                 fmt::format("{:.3f}", m.frame * 1e3 / static_cast<double>(pixels)), "", ""});
    }
    table.rows.push_back(frame);
    table.note =
        "Processor time where a backend runs on the processor. frame: upload, plan and download together; % of the "
        "bandwidth of memory or cache, and of the best integer rate "
        "that any operation reached here.";
    tables.push_back(std::move(table));
    ++at;
  }
  return tables;
}

std::vector<BenchTable> projection_tables(const ExplainedModes& modes, const std::vector<work::Machine>& machines,
                                          const PredictionError& error) {
  std::vector<BenchTable> tables;
  BenchTable frames;
  frames.title = "Projected frames, ms: by calculation, not measured";
  frames.head = {"machine"};
  for (const ExplainedMode& mode : modes.modes()) frames.head.push_back(mode.name);
  for (const work::Machine& machine : machines) {
    std::vector<std::string> row = {machine.name + " (" + machine.backend + ")"};
    for (const ExplainedMode& mode : modes.modes()) row.push_back(ms_text(work::project(mode.load, machine).us / 1e3));
    frames.rows.push_back(std::move(row));
  }
  frames.note =
      error.frames == 0
          ? "No backend was measured in this run: how far off the calculation is here is not known."
          : fmt::format(
                "The same calculation was off by a factor of {:.2f} for a frame on this machine's backends ({:.2f} at "
                "worst, of {}) and of {:.2f} for an operation. Where all of these are processors, what a GPU waits for "
                "(way) "
                "was not checked. Decoding and pose on the host are not in it.",
                error.typical_frame, error.worst_frame, error.frames, error.typical_step);
  tables.push_back(frames);
  for (const ExplainedMode& mode : modes.modes()) {
    BenchTable table;
    table.title = mode.name + ": projected, us, and what bounds it";
    table.head = {"operation"};
    std::vector<work::FrameTime> times;
    for (const work::Machine& machine : machines) {
      table.head.insert(table.head.end(), {machine.name, ""});
      times.push_back(work::project(mode.load, machine));
    }
    for (const auto& [op, indices] : by_operation(mode)) {
      std::vector<std::string> row = {name_of(op)};
      for (std::size_t m = 0; m < machines.size(); ++m) {
        const auto longest = std::max_element(indices.begin(), indices.end(), [&](std::size_t a, std::size_t b) {
          return times[m].steps[a].us < times[m].steps[b].us;
        });
        row.push_back(fmt::format("{:.1f}", sum_over(indices, [&](std::size_t i) { return times[m].steps[i].us; })));
        row.emplace_back(why(times[m].steps[*longest], machines[m].launch_us));
      }
      table.rows.push_back(std::move(row));
    }
    std::vector<std::string> copies = {"copies"}, all = {"frame"};
    for (const work::FrameTime& time : times) {
      copies.insert(copies.end(), {fmt::format("{:.1f}", time.copies_us), ""});
      all.insert(all.end(), {fmt::format("{:.1f}", time.us), ""});
    }
    table.rows.push_back(copies);
    table.rows.push_back(all);
    tables.push_back(std::move(table));
  }
  return tables;
}

BenchTable paper_table(const ExplainedModes& modes, const std::vector<MeasuredBackend>& measured,
                       const std::vector<BackendTimes>& frames, const std::vector<work::Machine>& machines) {
  BenchTable table;
  table.title = "The paper's Table 3, ms: its TX1, Berth here, and Berth by calculation";
  table.head = {"", "paper, GPU", "paper, CPU"};
  table.rows = {{"image sampling and buffering", "3", "3"},
                {"image preprocessing, docking", "0.5", "2"},
                {"object tracking (docking)", "~10", "~14"},
                {"coordinates", "<0.5", "<0.5"},
                {"docking in all", "14", "19.5"},
                {"image preprocessing, navigation, paper's sizes", "0.5", "2"},
                {"object detection (navigation), paper's sizes", "~30", "~100"},
                {"navigation in all, paper's sizes", "34", "105"},
                {"navigation in all, lite", "34", "105"}};
  const auto add_column = [&](const std::string& name, double sampling, double decode, double pose, bool has_host,
                              const auto& parts_of) {
    table.head.push_back(name);
    std::vector<std::string> cells(table.rows.size(), "-");
    cells[0] = ms_text(sampling);
    if (const auto docking = parts_of("docking")) {
      cells[1] = ms_text(docking->first);
      cells[2] = ms_text(docking->second + decode);
      if (has_host) cells[3] = ms_text(pose);
      cells[4] = ms_text(sampling + docking->first + docking->second + decode + pose);
    }
    if (const auto paper = parts_of("paper")) {
      cells[5] = ms_text(paper->first);
      cells[6] = ms_text(paper->second);
      cells[7] = ms_text(sampling + paper->first + paper->second);
    }
    if (const auto lite = parts_of("lite")) cells[8] = ms_text(sampling + lite->first + lite->second);
    for (std::size_t i = 0; i < cells.size(); ++i) table.rows[i].push_back(cells[i]);
  };
  using Parts = std::optional<std::pair<double, double>>;
  for (const MeasuredBackend& one : measured) {
    const auto timed = std::find_if(frames.begin(), frames.end(),
                                    [&one](const BackendTimes& times) { return times.backend == one.backend; });
    const FrameTimes host = timed != frames.end() ? timed->times : FrameTimes{};
    add_column(one.backend, one.upload_us / 1e3, host.best.decode, host.best.pose, true,
               [&](const std::string& name) -> Parts {
                 std::size_t at = 0;
                 for (const ExplainedMode& mode : modes.modes()) {
                   if (mode.name == name) return parts_ms(mode, [&](std::size_t i) { return one.modes[at].steps[i]; });
                   if (!mode.counted_only) ++at;
                 }
                 return std::nullopt;
               });
  }
  for (const work::Machine& machine : machines) {
    const double sampling = machine.frame_us + work::project(modes.modes().front().load, machine).copies_us;
    add_column(machine.name, sampling / 1e3, 0, 0, false, [&](const std::string& name) -> Parts {
      const ExplainedMode* mode = find_mode(modes, name);
      if (mode == nullptr) return std::nullopt;
      const work::FrameTime time = work::project(mode->load, machine);
      return parts_ms(*mode, [&](std::size_t i) { return time.steps[i].us; });
    });
  }
  table.note =
      "Sampling here is the copy of a frame to the device (by calculation: all copies and the replay), the paper's is "
      "a "
      "camera's; tracking includes decoding where it was measured; navigation is one window, as when following.";
  return table;
}

}  // namespace berth::cli
