#include "table_run.hpp"

#include "pose_algebra.hpp"
#include "sim/random.hpp"
#include "table/second_station.hpp"

namespace berth::cli {
namespace {

constexpr double kWholly = 0.999;

}  // namespace

table::SweepErrors TableSweep::errors(std::size_t method) const {
  table::SweepErrors errors;
  for (const TableFrame& frame : frames) {
    if (!frame.shown) continue;
    ++errors.shown;
    const std::optional<Reading>& reading = frame.readings[method];
    if (!reading) continue;
    ++errors.found;
    errors.add(reading->pose, frame.truth.pose);
    if (reading->corners) errors.add_corners(*reading->corners, frame.truth.corners);
  }
  return errors;
}

table::SweepBound TableSweep::bound() const {
  table::SweepBound sum;
  for (const TableFrame& frame : frames) {
    if (frame.bound) sum.add(*frame.bound, frame.corner_bound_px, length(frame.truth.pose.t));
  }
  return sum;
}

TableSweep run_sweep(const table::Sweep& sweep, const table::Stage& stage, u64 seed, TableReaders& readers,
                     const std::function<void()>& progress) {
  TableSweep run{sweep, {}};
  for (std::size_t i = 0; i < sweep.stops.size(); ++i) {
    const table::Stop& stop = sweep.stops[i];
    const table::StageFrame seen = stage.look(stop, sim::scatter(seed ^ sim::scatter(i)));
    TableFrame frame{stop.travel, seen.truth, seen.truth.visible >= kWholly, {}, 0, {}};
    if (frame.shown) {
      frame.bound = table::pose_bound(stage.camera(), seen.truth, seen.information);
      frame.corner_bound_px = table::corner_bound_px(seen.information).value_or(0);
    }
    GrayImage back;
    if (readers.stations() > 1) back = stage.look(table::seen_back(stop), sim::scatter(seed - sim::scatter(i))).image;
    frame.readings = readers.read(seen.image.view(), stop.size_m, back.view());
    run.frames.push_back(std::move(frame));
    progress();
  }
  return run;
}

}  // namespace berth::cli
