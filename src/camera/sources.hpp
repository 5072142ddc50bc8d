#pragma once

#include <memory>
#include <string>
#include <vector>

#include "berth/source.hpp"
#include "camera/aravis_camera.hpp"
#include "camera/gst_camera.hpp"
#include "camera/v4l2_camera.hpp"

namespace berth {

/// Image files, one a frame, in the order given.
std::unique_ptr<Source> open_images(std::vector<std::string> paths);

/// The frames of a video file, by whatever OpenCV can decode; a frame's exposure time is its time in the file.
/// Throws Error when it cannot be opened.
std::unique_ptr<Source> open_video(const std::string& path);

/// A camera whose frames are written where they are wanted: nothing is allocated from frame to frame.
class CameraSource : public Source {
 public:
  /// Of its frames; another size once it was opened again is an error of fetch().
  virtual int width() const = 0;
  virtual int height() const = 0;
  /// Waits for the newest frame that is whole as far as the camera says, and gives its stamp. Throws Error as next()
  /// does.
  virtual FrameStamp await() = 0;
  /// Writes the frame awaited, once. False where it turns out to be incomplete, which is counted.
  virtual bool fetch(View2D<u8> image) = 0;
  /// What its frames are called.
  virtual std::string label_of(const FrameStamp& stamp) const = 0;
};

/// A camera of Video4Linux, newest frame first: what it took while a frame was being looked at is skipped and counted.
/// A camera that gives no frame for V4l2Options::watchdog_ms, or is gone, is complained of (Error) and opened again by
/// its name, at most every 0.5 s; frames go on when it is back. Times are the driver's, clock "monotonic". The middle
/// of the exposure is known where exposure_us is set, else it is taken for the driver's time. Throws Error when it
/// cannot be opened the first time.
std::unique_ptr<CameraSource> open_v4l2(const V4l2Options& options, V4l2Opener opener = open_v4l2_device);

/// A GigE Vision or USB3 Vision camera, in all like open_v4l2. Times are on AravisOptions::time; the middle of the
/// exposure is known unless the camera controls its exposure itself.
std::unique_ptr<CameraSource> open_aravis(const AravisOptions& options);

/// A GStreamer pipeline, in all like open_v4l2; one that has ended or failed is built again. Times are the pipeline's,
/// which runs on the monotonic clock, taken for the end of the exposure; its middle is known where
/// GstOptions::exposure_us is set.
std::unique_ptr<CameraSource> open_gst(const GstOptions& options);

/// Whether it is a camera that open_source(spec) would open: a CameraSource, with a pace of its own.
bool names_camera(const std::string& spec);

/// The frames of an MCAP recording (docs/recording.md). Of Berth's own they come as they came when it was made: stamp,
/// label and truth; of others, the images of the first topic that has any, clock "ros". What was not recorded counts as
/// lost. Behind the last frame, damage or a missing end is an Error. Throws Error when it cannot be opened.
std::unique_ptr<Source> open_mcap(const std::string& path);

/// A source by its name: `sim:FILE` (scenario), `dir:DIR`, `file:IMAGE`, `video:FILE`, `mcap:FILE`, `v4l2:CAMERA`,
/// `aravis:CAMERA`, `gst:PIPELINE`. A bare path is told by what it is: a folder, a name ending in .toml or .mcap, an
/// image name, otherwise a video. Throws Error that lists what there is.
std::unique_ptr<Source> open_source(const std::string& spec);

}  // namespace berth
