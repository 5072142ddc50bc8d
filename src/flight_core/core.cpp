// include/berth_core.h.

#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "berth/ops.hpp"
#include "berth_core.h"
#include "c_api/edge.hpp"
#include "c_api/handles.hpp"
#include "flight_core/memory.hpp"
#include "simd/simd_backend.hpp"

using namespace berth;
using namespace berth::c_api;
using flight_core::Region;
using flight_core::Use;

namespace {

/// What is made once and stays: the operations' table, families' names, and families when they are first asked for. All
/// that there are fit in.
constexpr std::size_t kTableBytes = std::size_t{2} << 20;
alignas(BERTH_CORE_ALIGNMENT) unsigned char table_memory[kTableBytes];
Region tables(table_memory, kTableBytes);

/// Where a detector is measured: more than any takes. Pages that it does not touch are not there.
constexpr std::size_t kMeasuredBytes = std::size_t{1} << 34;

std::mutex tables_mutex;

void make_tables() {
  const std::lock_guard<std::mutex> lock(tables_mutex);
  const Use use(tables);
  name_of(Op{});
  family_names();
}

/// Nothing but the family itself takes the tables' memory: neither its name nor what is said of one that is unknown.
const MarkerFamily& family_in_tables(std::string_view name) {
  const std::vector<std::string>& names = family_names();
  if (std::find(names.begin(), names.end(), name) == names.end()) return family(name);  // throws
  const std::lock_guard<std::mutex> lock(tables_mutex);
  const Use use(tables);
  return family(name);
}

Bundle bundle_of(const berth_core_bundle& given) {
  Bundle bundle{&needed(given.name, "a bundle's name"), {}, given.deviation_m};
  if (given.marker_count > 0) needed(given.markers, "a bundle's markers");
  for (std::size_t i = 0; i < given.marker_count; ++i) {
    const berth_core_bundle_marker& marker = given.markers[i];
    const MarkerFamily& family = family_in_tables(&needed(marker.family, "a bundle marker's family"));
    bundle.markers.push_back({&family, marker.id, marker.size_m, pose_of(marker.place)});
  }
  return bundle;
}

berth_settings settings_of(const berth_core_settings& given) {
  berth_settings settings;
  DetectorConfig& config = settings.config;
  if (given.families != nullptr) config.families.clear();
  for (std::size_t i = 0; given.families != nullptr && i < given.family_count; ++i) {
    config.families.push_back(&needed(given.families[i], "a family's name"));
  }
  for (const std::string& name : config.families) family_in_tables(name);
  if (given.camera != nullptr) config.camera = camera_of(given.camera);
  config.marker_size_m = given.marker_size_m;
  if (given.bundle_count > 0) needed(given.bundles, "bundles");
  for (std::size_t i = 0; i < given.bundle_count; ++i) config.bundles.push_back(bundle_of(given.bundles[i]));
  if (given.max_hamming != 0) config.max_hamming = std::max(0, given.max_hamming);
  config.corner_method = corner_method_of(given.corner_method);
  config.pose_method = pose_method_of(given.pose_method);
  config.corner_deviation_px = given.corner_deviation_px;
  settings.full_every = full_every_of(given.full_every);
  return settings;
}

berth_detector* open_in(Region& region, const berth_core_settings& given) {
  make_tables();
  const Use use(region);
  const berth_settings settings = settings_of(given);
  const berth_backend backend{host::make_host_backend("simd", {"processor", simd_backend::target_name()},
                                                      simd_backend::ops(), 1, host::Chunks::single),
                              "simd"};
  return new berth_detector(backend, settings, given.width, given.height);
}

/// The system's memory while a detector is measured.
class Measured {
 public:
  Measured()
      : memory_(mmap(nullptr, kMeasuredBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1,
                     0)) {}
  ~Measured() {
    if (memory_ != MAP_FAILED) munmap(memory_, kMeasuredBytes);
  }
  Measured(const Measured&) = delete;
  Measured& operator=(const Measured&) = delete;

  Region region() const {
    if (memory_ == MAP_FAILED)
      throw Error("the system has no room to measure a detector in; measure on another machine");
    return Region(memory_, kMeasuredBytes);
  }

 private:
  void* memory_;
};

}  // namespace

extern "C" {

size_t berth_core_memory_needed(const berth_core_settings* settings, berth_error* error) {
  std::size_t bytes = 0;
  const Measured measured;  // errors' texts lie in it until guarded has copied them
  guarded(error, [&] {
    const berth_core_settings given = read_struct(settings, "settings");
    Region region = measured.region();
    berth_detector_close(open_in(region, given));
    bytes = region.taken();
  });
  return bytes;
}

berth_detector* berth_core_open(const berth_core_settings* settings, void* memory, size_t bytes, berth_error* error) {
  return opened(error, [&]() -> berth_detector* {
    const berth_core_settings given = read_struct(settings, "settings");
    if (reinterpret_cast<std::uintptr_t>(&needed(static_cast<unsigned char*>(memory), "memory")) %
            BERTH_CORE_ALIGNMENT !=
        0) {
      throw BadArgument("memory does not begin at a multiple of " + std::to_string(BERTH_CORE_ALIGNMENT) + " bytes");
    }
    Region region(memory, bytes);
    try {
      return open_in(region, given);
    } catch (const std::bad_alloc&) {
      note(error, BERTH_OUT_OF_MEMORY, "memory is too small; give as much as berth_core_memory_needed says");
      throw;
    }
  });
}

size_t berth_core_message_bytes(void) { return flight_core::message_bytes(); }

}  // extern "C"
