#include "work/machine.hpp"

#include <fmt/format.h>

#include <sstream>

#include "berth/error.hpp"
#include "sim/toml_reader.hpp"

namespace berth::work {
namespace {

double needed(sim::TomlReader& reader, const std::string& key, const char* unit, double low, double high) {
  if (!reader.has(key)) reader.fail(key, std::string("give ") + unit);
  return reader.number(key, low, low, high);
}

std::string in_quotes(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (static_cast<unsigned char>(c) >= 0x20) quoted += c;
  }
  return quoted + '"';
}

}  // namespace

Machine read_machine(const std::string& path) {
  sim::TomlReader root = sim::TomlReader::open(path, "machine description");
  Machine machine;
  machine.name = root.text("name", "");
  if (machine.name.empty()) root.fail("name", "give the machine's name in quotes");
  machine.backend = root.choice("backend", "", {"reference", "cpu", "simd", "opencl", "vulkan", "cuda"});
  machine.items_in_parallel = root.choice("items", "parallel", {"parallel", "in turn"}) == "parallel";

  sim::TomlReader memory = root.table("memory");
  machine.memory_gb_s = needed(memory, "gb_s", "its bandwidth by specification, GB/s", 0.01, 1e5);
  machine.memory_share = needed(memory, "share", "what of it a copy reaches, above 0 to 1", 0.001, 1);
  machine.cache_kb = needed(memory, "cache_kb", "the size of the last cache before it, KB", 0, 1e7);
  machine.cache_gb_s = needed(memory, "cache_gb_s", "that cache's bandwidth, GB/s", 0.01, 1e6);
  machine.latency_ns = needed(memory, "latency_ns", "how long a load takes whose address the one before gave", 0, 1e5);
  memory.finish();

  sim::TomlReader compute = root.table("compute");
  for (const char* key : {"units", "lanes", "lockstep"}) {
    if (!compute.has(key)) compute.fail(key, "give a whole number");
  }
  machine.units = compute.integer("units", 1, 1, 100000);
  machine.lanes = compute.integer("lanes", 1, 1, 4096);
  machine.lockstep = compute.integer("lockstep", 1, 1, 64);
  try {
    lockstep_index(machine.lockstep);
  } catch (const Error&) {
    compute.fail("lockstep", "use 1, 4, 8, 16, 32 or 64");
  }
  machine.clock_ghz = needed(compute, "clock_ghz", "the lanes' clock, GHz", 0.001, 100);
  machine.busy_share =
      needed(compute, "busy_share", "what of the lanes' cycles is made use of, above 0 to 1", 0.001, 1);
  machine.step_ns = needed(compute, "step_ns", "how long an operation takes that needs the one before", 0, 1e5);
  compute.finish();

  sim::TomlReader cycles = root.table("cycles");
  for (std::size_t k = 0; k < kKinds; ++k) {
    machine.cycles[k] = needed(cycles, kKindNames[k], "a lane's cycles for one", 0, 1e4);
  }
  cycles.finish();

  sim::TomlReader launch = root.table("launch");
  machine.frame_us = needed(launch, "frame_us", "what a replay costs once", 0, 1e6);
  machine.launch_us = needed(launch, "launch_us", "what each launch costs", 0, 1e6);
  machine.copy_us = needed(launch, "copy_us", "what it costs to begin a copy", 0, 1e6);
  launch.finish();
  root.finish();
  return machine;
}

std::string machine_text(const Machine& machine, const std::string& remark) {
  std::string text;
  std::istringstream lines(remark);
  for (std::string line; std::getline(lines, line);) text += "# " + line + "\n";
  text += fmt::format("name = {}\nbackend = {}\nitems = \"{}\"\n", in_quotes(machine.name), in_quotes(machine.backend),
                      machine.items_in_parallel ? "parallel" : "in turn");
  text += fmt::format("\n[memory]\ngb_s = {:.4g}\nshare = {:.4g}\ncache_kb = {:.6g}\ncache_gb_s = {:.4g}\n",
                      machine.memory_gb_s, machine.memory_share, machine.cache_kb, machine.cache_gb_s);
  text += fmt::format("latency_ns = {:.4g}\n", machine.latency_ns);
  text += fmt::format("\n[compute]\nunits = {}\nlanes = {}\nlockstep = {}\nclock_ghz = {:.4g}\n", machine.units,
                      machine.lanes, machine.lockstep, machine.clock_ghz);
  text += fmt::format("busy_share = {:.4g}\nstep_ns = {:.4g}\n\n[cycles]\n", machine.busy_share, machine.step_ns);
  for (std::size_t k = 0; k < kKinds; ++k) text += fmt::format("{} = {:.4g}\n", kKindNames[k], machine.cycles[k]);
  return text + fmt::format("\n[launch]\nframe_us = {:.4g}\nlaunch_us = {:.4g}\ncopy_us = {:.4g}\n", machine.frame_us,
                            machine.launch_us, machine.copy_us);
}

}  // namespace berth::work
