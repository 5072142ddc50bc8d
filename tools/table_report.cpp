#include "table_report.hpp"

#include <fmt/format.h>

#include <cmath>

#include "exact_math.hpp"
#include "pose_algebra.hpp"

namespace berth::cli {
namespace {

/// From m and rad to mm and degrees.
double scale_of(std::size_t axis) { return axis < 3 ? 1000 : kDegrees; }
const char* unit_of(std::size_t axis) { return axis < 3 ? "mm" : "°"; }

std::string title(const std::string& name) { return fmt::format("\n**{}**\n\n", name); }

std::string found_text(const table::SweepErrors& errors) { return fmt::format("{}/{}", errors.found, errors.shown); }

/// "x −0.3 … 0.3 m"
std::string extent(const TableSweep& run) {
  const std::size_t axis = *run.sweep.axis;
  return fmt::format("{} {:g} … {:g} {}", run.sweep.name, run.frames.front().travel, run.frames.back().travel,
                     axis < 3 ? "m" : "°");
}

constexpr const char* kBound = "bound of one image";

/// "0.062 ± 0.004": what an estimator at the bound would have, and how far so few frames may lead from that.
std::string bound_text(const table::SweepBound& bound, std::size_t axis) {
  return fmt::format("{:.3f} ± {:.3f}", scale_of(axis) * bound.rms(axis), scale_of(axis) * bound.rms_deviation(axis));
}

/// Standard deviation of the noise at a white surface in the image's middle, grey levels.
double noise_at_white(const sim::Sensor& sensor) {
  const double shot = sensor.full_well_e > 0 ? (sensor.white_level - sensor.black_level) * 255 / sensor.full_well_e : 0;
  return std::sqrt(shot + sensor.read_noise * sensor.read_noise);
}

}  // namespace

std::string setup_text(const table::Stage& stage, const table::Nominal& nominal, int frames, u64 seed,
                       const std::string& engine) {
  const CameraModel& camera = stage.camera();
  const sim::Sensor& sensor = stage.sensor();
  return fmt::format(
      "camera      {}×{}, f {:.2f} {:.2f} px, centre {:.2f} {:.2f}, k1 {:g}, k2 {:g}\n"
      "marker      {} {}, side {:g} mm: {:.1f} px at {:g} m\n"
      "sensor      blur σ {:g} px, defocus {:g} px, white {:g}, black {:g}, read noise {:g}, full well {:g} e: noise "
      "at white {:.2f} grey levels; 8 bits; blur computed at 1/{} px\n"
      "frames      {} an experiment, at rest during the exposure; seed {}\n"
      "backend     {}\n",
      camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, camera.distortion[0],
      camera.distortion[1], table::kFamily, table::kMarker, nominal.size_m * 1000,
      std::sqrt(camera.fx * camera.fy) * nominal.size_m / nominal.range_m, nominal.range_m, sensor.blur_sigma_px,
      sensor.defocus_px, sensor.white_level, sensor.black_level, sensor.read_noise, sensor.full_well_e,
      noise_at_white(sensor), stage.fineness(), frames, seed, engine);
}

std::string axes_table(const std::vector<TableSweep>& sweeps, const MethodNames& methods) {
  std::string text = title("Single axes: the moved axis against the truth") +
                     "| axis | method | found | max | RMS | max, % of range | RMS, % of range | corners RMS px | RMS / "
                     "bound |\n|---|---|---|---|---|---|---|---|---|\n";
  for (const TableSweep& run : sweeps) {
    if (!run.sweep.axis) continue;
    const std::size_t axis = *run.sweep.axis;
    const table::SweepBound bound = run.bound();
    text +=
        fmt::format("| {} | {} | | – | {} {} | – | {} | {:.3f} | |\n", extent(run), kBound, bound_text(bound, axis),
                    unit_of(axis), axis < 3 ? fmt::format("{:.3f}", 100 * bound.share(axis)) : "–", bound.corners_px());
    for (std::size_t m = 0; m < methods.size(); ++m) {
      const table::SweepErrors errors = run.errors(m);
      const table::ErrorSum& own = errors.axes[axis];
      const auto shares = [&]() -> std::string {
        if (axis >= 3) return "– | –";
        const table::ErrorSum& share = errors.shares[axis];
        return fmt::format("{:.3f} | {:.3f}", 100 * share.largest(), 100 * share.rms());
      };
      // What another camera sees as well is not in the bound.
      const bool one_image = errors.corners_px.count() > 0;
      const std::string corners = one_image ? fmt::format("{:.3f}", errors.corners_px.rms()) : "–";
      const std::string times =
          one_image && bound.count() > 0 ? fmt::format("{:.2f}", own.rms() / bound.rms(axis)) : "–";
      text += fmt::format("| {} | {} | {} | {:.3f} {} | {:.3f} {} | {} | {} | {} |\n", extent(run), methods[m],
                          found_text(errors), scale_of(axis) * own.largest(), unit_of(axis), scale_of(axis) * own.rms(),
                          unit_of(axis), shares(), corners, times);
    }
  }
  return text;
}

std::string crosstalk_table(const std::vector<TableSweep>& sweeps, const MethodNames& methods) {
  std::string text = title(fmt::format("What one axis leaves in the others: RMS, {}", methods.front())) +
                     "| moved | x mm | y mm | z mm | rx ° | ry ° | rz ° |\n|---|---|---|---|---|---|---|\n";
  for (const TableSweep& run : sweeps) {
    if (!run.sweep.axis) continue;
    const table::SweepErrors errors = run.errors(0);
    text += fmt::format("| {} |", run.sweep.name);
    for (std::size_t i = 0; i < 6; ++i) text += fmt::format(" {:.3f} |", scale_of(i) * errors.axes[i].rms());
    text += '\n';
  }
  return text;
}

std::string rectangle_table(const TableSweep& sweep, const MethodNames& methods) {
  std::string text =
      title("Rectangle of 60 × 40 cm: what moving in the plane does to z and rz") +
      "| method | found | Z-XY max mm | Z-XY RMS mm | Rz-XY max ° | Rz-XY RMS ° | x RMS mm | y RMS mm |\n"
      "|---|---|---|---|---|---|---|---|\n";
  const table::SweepBound bound = sweep.bound();
  text += fmt::format("| {} | | – | {} | – | {} | {} | {} |\n", kBound, bound_text(bound, 2), bound_text(bound, 5),
                      bound_text(bound, 0), bound_text(bound, 1));
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const table::SweepErrors errors = sweep.errors(m);
    const auto& axes = errors.axes;
    text +=
        fmt::format("| {} | {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} |\n", methods[m],
                    found_text(errors), 1000 * axes[2].largest(), 1000 * axes[2].rms(), kDegrees * axes[5].largest(),
                    kDegrees * axes[5].rms(), 1000 * axes[0].rms(), 1000 * axes[1].rms());
  }
  return text;
}

std::string still_table(const TableSweep& sweep, const MethodNames& methods) {
  std::string text =
      title("At rest: mean error ± standard deviation of a frame") +
      "| method | found | x mm | y mm | z mm | rx ° | ry ° | rz ° |\n|---|---|---|---|---|---|---|---|\n";
  text += fmt::format("| {} | |", kBound);
  for (std::size_t i = 0; i < 6; ++i) text += fmt::format(" {:.3f} |", scale_of(i) * sweep.bound().rms(i));
  text += '\n';
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const table::SweepErrors errors = sweep.errors(m);
    text += fmt::format("| {} | {} |", methods[m], found_text(errors));
    for (std::size_t i = 0; i < 6; ++i) {
      text += fmt::format(" {:.3f} ± {:.3f} |", scale_of(i) * errors.axes[i].mean(),
                          scale_of(i) * errors.axes[i].deviation());
    }
    text += '\n';
  }
  return text;
}

std::string ranges_table(const std::vector<TableSweep>& cells, const MethodNames& methods) {
  std::string text =
      title("Sizes and ranges, random views: RMS displacement, % of range (found of shown)") + "| marker | method |";
  std::string line = "|---|---|";
  for (const double range_m : table::grid_ranges_m()) {
    text += fmt::format(" {:g} m |", range_m);
    line += "---|";
  }
  text += "\n" + line + "\n";
  const std::size_t across = table::grid_ranges_m().size();
  for (std::size_t first = 0; first + across <= cells.size(); first += across) {
    text += fmt::format("| {:g} cm | {} |", 100 * cells[first].sweep.stops.front().size_m, kBound);
    for (std::size_t k = 0; k < across; ++k) {
      const table::SweepBound bound = cells[first + k].bound();
      text += bound.count() > 0 ? fmt::format(" {:.3f} |", 100 * bound.position_share()) : " does not fit |";
    }
    text += '\n';
    for (std::size_t m = 0; m < methods.size(); ++m) {
      text += fmt::format("| {:g} cm | {} |", 100 * cells[first].sweep.stops.front().size_m, methods[m]);
      for (std::size_t k = 0; k < across; ++k) {
        const table::SweepErrors errors = cells[first + k].errors(m);
        const std::string count = errors.found < errors.shown ? fmt::format(" ({})", found_text(errors)) : "";
        text += errors.shown == 0   ? " does not fit |"
                : errors.found == 0 ? fmt::format(" –{} |", count)
                                    : fmt::format(" {:.3f}{} |", 100 * errors.position_share.rms(), count);
      }
      text += '\n';
    }
  }
  return text;
}

std::string table_csv(const std::vector<TableSweep>& sweeps, const MethodNames& methods) {
  std::string csv =
      "experiment,size_m,frame,travel,shown,method,found,true_x_m,true_y_m,true_z_m,error_x_mm,error_y_mm,error_z_mm,"
      "error_rx_deg,error_ry_deg,error_rz_deg,corner_rms_px,bound_x_mm,bound_y_mm,bound_z_mm,bound_rx_deg,"
      "bound_ry_deg,bound_rz_deg,bound_corner_px\n";
  for (const TableSweep& run : sweeps) {
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
      const TableFrame& frame = run.frames[i];
      const auto& t = frame.truth.pose.t;
      std::string bound;
      for (std::size_t k = 0; k < 6; ++k) {
        bound += frame.bound ? fmt::format(",{:.6f}", scale_of(k) * (*frame.bound)[k]) : ",";
      }
      bound += frame.bound ? fmt::format(",{:.4f}\n", frame.corner_bound_px) : ",\n";
      for (std::size_t m = 0; m < methods.size(); ++m) {
        const std::optional<Reading>& reading = frame.readings[m];
        csv += fmt::format("{},{:g},{},{:.6g},{},\"{}\",{},{:.6f},{:.6f},{:.6f}", run.sweep.name, frame.truth.size_m, i,
                           frame.travel, frame.shown ? 1 : 0, methods[m], reading ? 1 : 0, t[0], t[1], t[2]);
        if (reading) {
          const table::SixAxes error = table::pose_error(reading->pose, frame.truth.pose);
          for (std::size_t k = 0; k < 6; ++k) csv += fmt::format(",{:.6f}", scale_of(k) * error[k]);
          table::SweepErrors corners;
          if (reading->corners) corners.add_corners(*reading->corners, frame.truth.corners);
          csv += reading->corners ? fmt::format(",{:.4f}", corners.corners_px.rms()) : ",";
        } else {
          csv += ",,,,,,,";
        }
        csv += bound;
      }
    }
  }
  return csv;
}

}  // namespace berth::cli
