#pragma once

#include <functional>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "work/frames.hpp"
#include "work/machine.hpp"

namespace berth::work {

/// The clock that a backend is measured by, µs: processor time of all threads where it runs on the processor, so that
/// what else the machine does weighs little; the one on the wall for other devices.
double device_us(const Backend& backend);

/// The least time of several runs after one that does not count, by device_us: as many as fit into `budget_ms`, three
/// at least.
double least_us(const Backend& backend, double budget_ms, const std::function<void()>& run);

/// What each step takes with its launch, µs: as the device tells it, or, where it does not and on processors, by
/// repeating each in a plan of its own. The least of several runs.
std::vector<double> step_times_us(Backend& backend, ModeFrame& frame, int runs);

/// Upload, plan and download of a frame until the host knows of the end, µs.
double frame_time_us(Backend& backend, ModeFrame& frame, double budget_ms);

/// Describes this machine as the backend sees it, by what its own operations take: copies, launches of next to nothing,
/// a docking frame (`calibration`, an image) and its counts, a convolution, a walk along links. On processors all is
/// one thread's. Several seconds. Throws Error when the device is lost.
Machine measure_machine(Backend& backend, View2D<const u8> calibration);

}  // namespace berth::work
