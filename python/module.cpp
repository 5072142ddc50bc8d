// The Python module berth._berth over the C++ interface: docs/python.md. One unit, since nanobind's headers are heavy.
//
// Images come in as views of NumPy's memory and arrays go out as views of the object they are read from. Whatever may
// take long runs without the GIL.

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <climits>

#include "engine.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace berth::python {
namespace {

template <std::size_t... N>
using Array = nb::ndarray<nb::numpy, const double, nb::shape<static_cast<nb::ssize_t>(N)...>, nb::c_contig>;
using GrayArray = nb::ndarray<nb::numpy, const u8, nb::ndim<2>, nb::c_contig>;
using AnyArray = nb::ndarray<nb::ro, nb::device::cpu>;

/// A pose with what is known of how good it is.
struct PoseEstimate {
  Pose pose;
  std::optional<PoseUncertainty> uncertainty;
};

template <class Choice>
Choice choice_of(const std::string& name, const char* what, std::initializer_list<std::pair<const char*, Choice>> all) {
  std::string known;
  for (const auto& [text, choice] : all) {
    if (name == text) return choice;
    known += (known.empty() ? "" : " or ") + std::string("'") + text + "'";
  }
  throw Error(std::string(what) + " is '" + name + "'; use " + known);
}

View2D<const u8> view_of(const AnyArray& array) {
  if (array.ndim() != 2 || array.dtype() != nb::dtype<u8>()) {
    throw Error("image has " + std::to_string(array.ndim()) +
                " dimensions or is not of uint8; give 8-bit gray of shape (height, width)");
  }
  if (array.shape(0) > INT_MAX || array.shape(1) > INT_MAX || array.stride(1) != 1 || array.stride(0) < 0 ||
      array.stride(0) > INT_MAX) {
    throw Error("image's rows are not contiguous, or are upside down; give numpy.ascontiguousarray(image)");
  }
  return {static_cast<const u8*>(array.data()), static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)),
          static_cast<int>(array.stride(0))};
}

std::optional<PoseEstimate> estimate_of(bool has_pose, const Pose& pose, std::optional<PoseUncertainty> uncertainty) {
  if (!has_pose) return std::nullopt;
  return PoseEstimate{pose, std::move(uncertainty)};
}

Array<6, 6> covariance_array(const std::array<double, 36>& covariance) { return {covariance.data()}; }

void bind_cameras(nb::module_& m) {
  nb::class_<CameraModel>(
      m, "CameraModel",
      "A pinhole camera with a lens, in pixels whose centres lie at integers (docs/coordinate-frames.md).")
      .def(
          "__init__",
          [](CameraModel* self, int width, int height, double fx, double fy, double cx, double cy,
             const std::vector<double>& distortion, const std::string& lens) {
            CameraModel camera;
            camera.width = width;
            camera.height = height;
            camera.fx = fx;
            camera.fy = fy;
            camera.cx = cx;
            camera.cy = cy;
            camera.lens = choice_of<LensModel>(
                lens, "lens",
                {{"radial_tangential", LensModel::radial_tangential}, {"equidistant", LensModel::equidistant}});
            if (distortion.size() > camera.distortion.size()) {
              throw Error("distortion has " + std::to_string(distortion.size()) + " coefficients; give 8 at most");
            }
            std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
            new (self) CameraModel(camera);
          },
          "width"_a, "height"_a, "fx"_a, "fy"_a, "cx"_a, "cy"_a, "distortion"_a = std::vector<double>(),
          "lens"_a = "radial_tangential")
      .def_static("read", &read_camera, "path"_a, "ROS camera_info YAML, a Kalibr camchain or PhotonVision's JSON.")
      .def_static("paper", &paper_camera, "width"_a = 640, "height"_a = 480, "Table 2 of the paper, for 4:3 images.")
      .def("resized", &resized_camera, "width"_a, "height"_a, "The camera when its whole image is resized.")
      .def("cropped", &cropped_camera, "width"_a, "height"_a, "The camera when the image's middle is cut out.")
      .def(
          "write", [](const CameraModel& camera, const std::string& path) { write_camera_info(path, camera); },
          "path"_a, "Writes ROS camera_info YAML.")
      .def_ro("width", &CameraModel::width)
      .def_ro("height", &CameraModel::height)
      .def_ro("fx", &CameraModel::fx)
      .def_ro("fy", &CameraModel::fy)
      .def_ro("cx", &CameraModel::cx)
      .def_ro("cy", &CameraModel::cy)
      .def_prop_ro(
          "distortion", [](const CameraModel& c) { return Array<8>(c.distortion.data()); },
          "radial_tangential: k1, k2, p1, p2, k3, k4, k5, k6; equidistant: k1, k2, k3, k4.")
      .def_prop_ro("lens", [](const CameraModel& camera) {
        return camera.lens == LensModel::equidistant ? "equidistant" : "radial_tangential";
      });
}

void bind_poses(nb::module_& m) {
  nb::class_<Pose>(m, "Pose", "A point X of the marker is at R @ X + t in the camera frame, m.")
      .def_prop_ro("R", [](const Pose& p) { return Array<3, 3>(p.R.data()); })
      .def_prop_ro("t", [](const Pose& p) { return Array<3>(p.t.data()); });
  using Matrix = std::optional<Array<6, 6>>;
  const auto with_other = [](const PoseEstimate& p) { return p.uncertainty && p.uncertainty->has_other; };
  nb::class_<PoseEstimate>(m, "PoseEstimate", "A pose and how well it is known (docs/pose.md).")
      .def_prop_ro("R", [](const PoseEstimate& p) { return Array<3, 3>(p.pose.R.data()); })
      .def_prop_ro(
          "t", [](const PoseEstimate& p) { return Array<3>(p.pose.t.data()); }, "m")
      .def_prop_ro(
          "covariance",
          [](const PoseEstimate& p) {
            return p.uncertainty ? Matrix(covariance_array(p.uncertainty->covariance)) : std::nullopt;
          },
          "Of translation (m), then rotation (rad) about axes parallel to the camera's; None by the paper's form.")
      .def_prop_ro(
          "error_px", [](const PoseEstimate& p) { return p.uncertainty ? p.uncertainty->error_px : 0; },
          "Root mean square distance of the corners from where the pose says they are.")
      .def_prop_ro(
          "ambiguity", [](const PoseEstimate& p) { return p.uncertainty ? p.uncertainty->ambiguity() : 0; },
          "0: no doubt which of a plane's two poses it is; 1: the corners do not tell.")
      .def_prop_ro(
          "other",
          [with_other](const PoseEstimate& p) {
            return with_other(p) ? std::optional<Pose>(p.uncertainty->other) : std::nullopt;
          },
          "The plane's other pose.")
      .def_prop_ro("other_covariance",
                   [with_other](const PoseEstimate& p) {
                     return with_other(p) ? Matrix(covariance_array(p.uncertainty->other_covariance)) : std::nullopt;
                   })
      .def_prop_ro(
          "other_excess",
          [with_other](const PoseEstimate& p) { return with_other(p) ? p.uncertainty->other_excess : 0; },
          "How much worse the other fits: it is exp(-excess / 2) times as likely.");
}

void bind_results(nb::module_& m) {
  nb::class_<Detection>(m, "Detection", "A marker that was read.")
      .def_prop_ro("family", [](const Detection& d) { return d.family->name; })
      .def_ro("id", &Detection::id)
      .def_ro("hamming", &Detection::hamming, "Wrong bits.")
      .def_ro("margin", &Detection::margin, "Mean distance of the bits from their threshold, grey levels.")
      .def_prop_ro(
          "corners", [](const Detection& d) { return Array<4, 2>(d.corners[0].data()); },
          "x, y of the upright marker's upper left corner, then lower left, lower right, upper right, px.")
      .def_prop_ro("center", [](const Detection& d) { return Array<2>(d.center.data()); })
      .def_prop_ro(
          "corner_covariance", [](const Detection& d) { return Array<8, 8>(d.corner_covariance_px2->data()); },
          "Of the corners' coordinates in their order, px^2.")
      .def_prop_ro(
          "corners_fitted", [](const Detection& d) { return d.corner_fit.has_value(); },
          "By the photometric fit; else by edges.")
      .def_prop_ro("pose", [](const Detection& d) { return estimate_of(d.has_pose, d.pose, d.pose_uncertainty); });
  nb::class_<BundleResult>(m, "BundlePose", "A bundle's pose in one frame, bundle frame to camera frame.")
      .def_ro("name", &BundleResult::name)
      .def_prop_ro(
          "pose",
          [](const BundleResult& b) { return estimate_of(b.found.has_pose, b.found.pose, b.found.uncertainty); })
      .def_prop_ro(
          "used", [](const BundleResult& b) { return b.found.used; }, "Markers that went into it.")
      .def_prop_ro(
          "kept_out", [](const BundleResult& b) { return b.found.kept_out; }, "Markers that do not fit their place.");
  nb::class_<TargetResult>(m, "DiscPose", "A disc target's pose in one frame.")
      .def_ro("name", &TargetResult::name)
      .def_prop_ro(
          "pose",
          [](const TargetResult& t) { return estimate_of(t.found.has_pose, t.found.pose, t.found.uncertainty); })
      .def_prop_ro(
          "used", [](const TargetResult& t) { return t.found.used; }, "Discs that went into it.");
  nb::class_<Frame>(m, "FrameResult", "What one frame showed.")
      .def_prop_ro(
          "status", [](const Frame& f) { return name_of(f.result.status); },
          "'ok', 'no_target', 'overflow' or 'device_lost'.")
      .def_prop_ro("detections", [](const Frame& f) -> const std::vector<Detection>& { return f.result.detections; })
      .def_ro("bundles", &Frame::bundles)
      .def_ro("targets", &Frame::targets)
      .def_ro("whole", &Frame::whole, "The whole frame was searched, not only windows around markers.")
      .def_prop_ro("sequence", [](const Frame& f) { return f.result.stamp.sequence; })
      .def_prop_ro("mid_exposure_ns", [](const Frame& f) { return f.result.stamp.mid_exposure_ns; })
      .def_prop_ro(
          "times_ns",
          [](const Frame& f) {
            nb::typed<nb::dict, std::string, int> times;
            for (const StageTime& time : f.result.times) {
              if (*time.stage != 0) times[time.stage] = time.ns;
            }
            return times;
          },
          "What each step took.")
      .def_ro("source", &Frame::given, "What was searched: a SourceFrame, or the array.");
}

}  // namespace

NB_MODULE(_berth, m) {
  m.doc() = "Docking vision: markers and their poses, with the same bits on every machine.";
  // NOLINTNEXTLINE(bugprone-throw-keyword-missing,bugprone-unused-raii): it is made to be known to Python
  nb::exception<Error>(m, "Error", PyExc_RuntimeError);
  m.def("backend_names", &backend_names, "In order of preference.");
  m.def("family_names", &family_names);
  bind_cameras(m);
  bind_poses(m);
  bind_results(m);
  nb::class_<Bundle>(m, "Bundle", "Markers that stand together (docs/bundles.md).").def_ro("name", &Bundle::name);
  m.def("read_bundles", &read_bundles, "path"_a, "size_m"_a = 0.0, "family"_a = "tag36h11",
        "apriltag_ros' YAML, or WPILib's JSON with size and family.");
  nb::class_<DiscTarget>(m, "DiscTarget", "A plate with discs and rings (docs/disc-targets.md).")
      .def_static("read", &read_disc_target, "path"_a)
      .def_ro("name", &DiscTarget::name);

  nb::class_<TruthMarker>(m, "TruthMarker", "A marker that a simulated frame shows, as it truly is.")
      .def_ro("family", &TruthMarker::family)
      .def_ro("id", &TruthMarker::id)
      .def_ro("size_m", &TruthMarker::size_m)
      .def_ro("pose", &TruthMarker::pose)
      .def_prop_ro("corners", [](const TruthMarker& t) { return Array<4, 2>(t.corners[0].data()); });
  nb::class_<SourceFrame>(m, "SourceFrame", "A picture of a source.")
      .def_prop_ro(
          "image",
          [](const SourceFrame& f) {
            const View2D<const u8> view = f.image.view();
            return GrayArray(view.data, {static_cast<std::size_t>(view.height), static_cast<std::size_t>(view.width)});
          },
          "uint8 of shape (height, width), a view.")
      .def_ro("label", &SourceFrame::label)
      .def_prop_ro("sequence", [](const SourceFrame& f) { return f.stamp.sequence; })
      .def_prop_ro("mid_exposure_ns", [](const SourceFrame& f) { return f.stamp.mid_exposure_ns; })
      .def_ro("truth", &SourceFrame::truth, "Empty unless it is simulated.");
  nb::class_<PythonSource>(m, "Source",
                           "Frames: 'sim:FILE', 'dir:DIR', 'file:IMAGE', 'video:FILE', 'mcap:FILE', 'v4l2:CAMERA', "
                           "'aravis:CAMERA', 'gst:PIPELINE' or a path.")
      .def(nb::init<const std::string&>(), "name"_a, nb::call_guard<nb::gil_scoped_release>())
      .def(
          "__iter__", [](nb::handle self) { return self; }, nb::sig("def __iter__(self) -> Source"))
      .def("__next__",
           [](PythonSource& source) {
             std::optional<SourceFrame> frame;
             {
               const nb::gil_scoped_release release;
               frame = source.next();
             }
             if (!frame) throw nb::stop_iteration();
             return std::move(*frame);
           })
      .def_prop_ro("camera", &PythonSource::camera, "The source's own, where it knows one (simulation).")
      .def_prop_ro("size", &PythonSource::size, "Frames in all, where known.");

  nb::class_<PythonDetector>(m, "Detector", "Finds markers, bundles and targets of discs in images of one size.")
      .def(
          "__init__",
          [](PythonDetector* self, int width, int height, std::vector<std::string> families,
             std::optional<CameraModel> camera, double marker_size_m, std::vector<Bundle> bundles,
             std::vector<DiscTarget> targets, const std::string& corners, const std::string& pose, int max_hamming,
             double corner_deviation_px, int full_every, const std::string& backend, const std::string& device,
             int threads) {
            DetectorConfig config;
            config.families = std::move(families);
            config.camera = std::move(camera);
            config.marker_size_m = marker_size_m;
            config.bundles = std::move(bundles);
            config.disc_targets = std::move(targets);
            config.corner_method = choice_of<CornerMethod>(
                corners, "corners", {{"edges", CornerMethod::edges}, {"photometric", CornerMethod::photometric}});
            config.pose_method = choice_of<PoseMethod>(
                pose, "pose", {{"least_squares", PoseMethod::least_squares}, {"paper", PoseMethod::paper}});
            config.max_hamming = max_hamming;
            config.corner_deviation_px = corner_deviation_px;
            BackendOptions options;
            options.device = device;
            options.threads = threads;
            const nb::gil_scoped_release release;
            new (self) PythonDetector(width, height, backend, options, std::move(config), full_every);
          },
          "width"_a, "height"_a, nb::kw_only(), "families"_a = std::vector<std::string>{"tag36h11"},
          "camera"_a = nb::none(), "marker_size_m"_a = 0.0, "bundles"_a = std::vector<Bundle>(),
          "targets"_a = std::vector<DiscTarget>(), "corners"_a = "edges", "pose"_a = "least_squares",
          "max_hamming"_a = 2, "corner_deviation_px"_a = 0.0, "full_every"_a = 0, "backend"_a = "simd", "device"_a = "",
          "threads"_a = 1,
          "Poses need camera and marker_size_m. full_every: markers are followed in windows and the whole frame is "
          "searched every so many; 0 for always. The rest is as DetectorConfig has it.")
      .def(
          "detect",
          [](PythonDetector& detector, nb::object image, u64 sequence, std::int64_t mid_exposure_ns) {
            View2D<const u8> view;
            FrameStamp stamp;
            AnyArray array;
            if (nb::isinstance<SourceFrame>(image)) {
              const SourceFrame& frame = nb::cast<const SourceFrame&>(image);
              view = frame.image.view();
              stamp = frame.stamp;
            } else {
              if (!nb::try_cast(image, array, false)) throw Error("image is neither an array nor a SourceFrame");
              view = view_of(array);
              stamp.sequence = sequence;
              stamp.mid_exposure_ns = mid_exposure_ns;
              stamp.clock = "caller's";
            }
            Frame frame;
            {
              const nb::gil_scoped_release release;
              frame = detector.detect(view, stamp);
            }
            frame.given = std::move(image);
            return frame;
          },
          "image"_a, nb::kw_only(), "sequence"_a = 0, "mid_exposure_ns"_a = 0,
          nb::sig(
              "def detect(self, image: SourceFrame | numpy.ndarray, *, sequence: int = 0, mid_exposure_ns: int = 0) "
              "-> FrameResult"),
          "Searches 8-bit gray of shape (height, width), which is not copied, or a source's frame.")
      .def_prop_ro("backend", &PythonDetector::backend);

  nb::class_<FilteredPose>(m, "FilteredPose",
                           "A marker's pose from this frame and those before it (docs/pose-filter.md).")
      .def_ro("time_ns", &FilteredPose::time_ns)
      .def_ro("has_pose", &FilteredPose::has_pose, "There is a track.")
      .def_ro("measured", &FilteredPose::measured, "The frame's marker went into it; else it is foretold.")
      .def_ro("outlier", &FilteredPose::outlier, "A marker was given, and kept out.")
      .def_ro("sure", &FilteredPose::sure, "The plane's other pose is ruled out.")
      .def_ro("jumped", &FilteredPose::jumped, "It does not go on from the last one.")
      .def_ro("age_s", &FilteredPose::age_s, "Since a marker went in.")
      .def_ro("pose", &FilteredPose::pose)
      .def_prop_ro("covariance", [](const FilteredPose& p) { return covariance_array(p.covariance); })
      .def_prop_ro(
          "velocity", [](const FilteredPose& p) { return Array<6>(p.velocity.data()); },
          "m/s, then rad/s about axes parallel to the camera's.")
      .def_prop_ro("velocity_covariance",
                   [](const FilteredPose& p) { return covariance_array(p.velocity_covariance); });
  nb::class_<PythonFilter>(m, "PoseFilter", "A marker's pose over time.")
      .def(
          "__init__",
          [](PythonFilter* self, const CameraModel& camera, double marker_size_m, double acceleration,
             double angular_acceleration, double lost_s) {
            PoseFilterConfig config;
            config.camera = camera;
            config.marker_size_m = marker_size_m;
            config.acceleration = acceleration;
            config.angular_acceleration = angular_acceleration;
            config.lost_s = lost_s;
            new (self) PythonFilter(config);
          },
          "camera"_a, "marker_size_m"_a, nb::kw_only(), "acceleration"_a = PoseFilterConfig().acceleration,
          "angular_acceleration"_a = PoseFilterConfig().angular_acceleration, "lost_s"_a = PoseFilterConfig().lost_s)
      .def("update", &PythonFilter::update, "mid_exposure_ns"_a, "marker"_a.none(),
           nb::call_guard<nb::gil_scoped_release>(), "A frame's marker, or None where it was not read.")
      .def("foretell", &PythonFilter::foretell, "time_ns"_a, "What the last frame says of another time.")
      .def("reset", &PythonFilter::reset, "Ends the track.");
}

}  // namespace berth::python
