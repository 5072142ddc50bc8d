#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "berth/bundle.hpp"
#include "berth/camera.hpp"
#include "berth/disc_target.hpp"
#include "berth/frame.hpp"
#include "berth/image.hpp"

namespace berth {

class Lockstep;
struct StageDifference;

/// Room for the lists a frame produces; 0 picks the default for the image size (docs/capacities.md).
struct Capacities {
  int run_ends = 0;
  int contours = 0;
  int points = 0;
};

/// How a marker's pose is had from its corners (docs/pose.md).
enum class PoseMethod {
  /// Least squares of the corners' reprojection errors, from both poses that a plane may have.
  least_squares,
  /// The paper's closed form alone (section 4.1), without uncertainty: badly conditioned for small markers.
  paper,
};

/// How exact a marker's corners are had (docs/corners.md).
enum class CornerMethod {
  /// From lines through the gray-level edges of the border: on the device, next to nothing. With a camera, what its
  /// lens makes of lines along bent sides is taken off.
  edges,
  /// From a fit of the whole decoded pattern on the host, at about the noise's limit. Corners come with covariances.
  /// Where the fit does not hold they are the edges'.
  photometric,
};

struct DetectorConfig {
  /// Family names; see family_names().
  std::vector<std::string> families = {"tag36h11"};
  /// Most wrong bits a code may have and still be accepted by its bits; never more than the family can correct. Where
  /// the grey levels speak clearly for one code, bits up to what the family corrects may lie on the wrong side by a
  /// little (Detection::hamming tells); 0 rules that out.
  int max_hamming = 2;
  /// Camera and marker side (metres, the side the corners span); with both, detections get a pose.
  std::optional<CameraModel> camera;
  double marker_size_m = 0;
  /// Markers that stand together; with a camera each bundle gets a pose, and its markers theirs by the sizes they have
  /// in it, whatever marker_size_m is (0 then means that others get none). No marker may be in two of them, and their
  /// families must be among `families`.
  std::vector<Bundle> bundles;
  /// Targets of discs, each looked for once a frame; they need the camera. With them the marker size may be 0: markers
  /// then get no pose.
  std::vector<DiscTarget> disc_targets;
  PoseMethod pose_method = PoseMethod::least_squares;
  CornerMethod corner_method = CornerMethod::edges;
  /// One standard deviation of a corner's coordinate, px, where corners are the edges': what poses' covariances go by
  /// (docs/pose.md). 0: each marker's own, from how well its sides fit (docs/corners.md).
  double corner_deviation_px = 0;
  /// Per-pixel gain of the flat-field correction, row-major, 1 = unchanged; empty for none.
  std::vector<float> flat_field;
  Capacities capacities;
  /// Sides of the windows that can be searched in place of the whole frame (SearchWindow), px: multiples of 16 from 64
  /// to the image's lesser side, each for as many windows of a frame as it is named here. Every one takes memory. Not
  /// together with disc_targets.
  std::vector<int> window_sides;
  /// Compute StageDigests for every frame (downloads every stage's output; slow).
  bool digests = false;
};

/// A square part of a frame that is searched alone (docs/tracking.md): one of DetectorConfig::window_sides, inside the
/// frame; its upper left pixel at multiples of 8.
struct SearchWindow {
  int side = 0;
  int x = 0;
  int y = 0;
  /// Only the whole image's search, without the halved one's two: little more than half of the work. Markers that it
  /// finds without a wrong bit are reported, with the bits that the whole frame gives them, and no others.
  bool full_resolution_only = false;
};

/// The side that a marker's pose goes by, m: its bundle's, else the configuration's.
double marker_size_m(const DetectorConfig& config, const MarkerFamily& family, int id);

/// Finds markers in frames of one size on one backend. All memory is taken in the constructor.
class Detector {
 public:
  /// Throws Error on a size outside 1…16384, an unknown family, a bundle or a target that does not hold or a bad
  /// configuration.
  Detector(Backend& backend, int width, int height, const DetectorConfig& config);
  ~Detector();
  Detector(Detector&&) noexcept;
  Detector& operator=(Detector&&) noexcept;

  /// Enqueues a frame. Copies the image; returns at once where the device is asynchronous. One frame in flight.
  /// With `windows`, these alone are searched: a marker well inside one of them is found with the bits that the whole
  /// frame gives it, and no other is reported. The image is then not copied but read until collect returns. Throws
  /// Error on an image of another size, and on windows that the detector was not made for or that do not lie in the
  /// frame as they must.
  void submit(View2D<const u8> image, const FrameStamp& stamp, const std::vector<SearchWindow>& windows = {});
  /// Waits for the submitted frame and finishes it on the host. Valid until the next collect.
  const FrameResult& collect();
  /// submit and collect.
  const FrameResult& detect(View2D<const u8> image, const FrameStamp& stamp = {},
                            const std::vector<SearchWindow>& windows = {});

  /// Bytes of device memory, all taken at start.
  std::size_t device_bytes() const;
  /// Adds what no frame writes: configuration, codes, launches, a flat field where the host reaches it.
  void list_constants(std::vector<ConstantMemory>& to) const;

 private:
  friend class Lockstep;
  friend std::optional<StageDifference> first_difference(Detector& first, Detector& second);
  /// `keeps_stages`: what is computed for a window stays until the next frame, to be compared; takes more memory.
  Detector(Backend& backend, int width, int height, const DetectorConfig& config, bool keeps_stages);
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
