/** @file
 * Berth's C interface: markers and their poses in gray images. See docs/c-api.md.
 *
 * Handles are opaque. Whatever a call says goes into memory of the caller: a berth_error, structs, images. Structs
 * begin with struct_size, which the caller sets: `berth_marker marker = {.struct_size = sizeof marker};`. Later
 * versions add members at the end, and a library copies as much as both sides know. No C++ exception comes out of a
 * call.
 *
 * Errors. Calls return a berth_code, or a handle that is NULL when they failed. `error` may be NULL. The first failure
 * stays in it: a call writes to it only while its code is 0. A sequence of calls can be checked once, at its end.
 *
 * Threads. There is no global state. One handle is used by one thread at a time; different handles by different
 * threads, also detectors of one backend. A settings handle is only read by berth_detector_open.
 *
 * Memory. Opening takes it; berth_detector_detect and the filter take none that they keep, and on the CPU backends none
 * at all. Handles may be closed in any order: a detector keeps what it needs of its backend.
 *
 * Units are metres, radians, pixels and nanoseconds. Pixel centres lie at integer coordinates. Camera frame: x right, y
 * down, z forward; marker frame: x right, y down as one looks at it, z into it; docs/coordinate-frames.md has pictures.
 */
#ifndef BERTH_H
#define BERTH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BERTH_VERSION_MAJOR 0
#define BERTH_VERSION_MINOR 1
#define BERTH_VERSION_PATCH 0

/** "0.1.0": of the library that is loaded, which may be newer than this header. */
const char* berth_version(void);

/* ---- Errors ---- */

typedef enum berth_code {
  BERTH_OK = 0,
  BERTH_BAD_ARGUMENT = 1, /**< NULL where there has to be something, a struct_size, an index */
  BERTH_SETUP_FAILED = 2, /**< a driver, a file or a value: the message says which and names the remedy */
  BERTH_OUT_OF_MEMORY = 3,
  BERTH_DEVICE_LOST = 4,   /**< the device of the frame is lost: open another backend and detector */
  BERTH_INTERNAL_ERROR = 5 /**< not foreseen; the message is what was thrown */
} berth_code;

/** Its layout never changes. Begins as {0}. */
typedef struct berth_error {
  int32_t code; /**< a berth_code */
  char message[1020];
} berth_error;

/* ---- Poses ---- */

/** A point X of the marker is at R X + t in the camera frame; R is row-major. The layout never changes. */
typedef struct berth_pose {
  double R[9];
  double t[3];
} berth_pose;

/** A pose by least squares and how well it is known (docs/pose.md). The layout never changes. */
typedef struct berth_pose_estimate {
  berth_pose pose;
  /** Row-major 6 x 6: translation, then rotation. The true pose is t + dt, rotation(w) R: w turns about the marker's
   * origin, about axes parallel to the camera's. All 0 where has_covariance is 0 (the paper's closed form). */
  double covariance[36];
  double error_px;     /**< root mean square distance of the corners from where the pose says they are */
  double ambiguity;    /**< 0: no doubt which of a plane's two poses it is; 1: the corners do not tell */
  double other_excess; /**< how much worse the other fits: it is e^(-excess/2) times as likely */
  double other_error_px;
  berth_pose other;
  double other_covariance[36];
  int32_t has_covariance;
  int32_t has_other; /**< else the members named other_... are all 0 */
} berth_pose_estimate;

/* ---- Cameras ---- */

typedef enum berth_lens {
  BERTH_LENS_RADIAL_TANGENTIAL = 0, /**< k1, k2, p1, p2, k3, k4, k5, k6: ROS plumb_bob and rational_polynomial */
  BERTH_LENS_EQUIDISTANT = 1        /**< k1, k2, k3, k4: fisheyes */
} berth_lens;

typedef struct berth_camera {
  size_t struct_size;
  int32_t width, height; /**< of the images that it is for */
  double fx, fy, cx, cy; /**< px */
  double distortion[8];
  int32_t lens; /**< a berth_lens */
} berth_camera;

/** Reads ROS camera_info YAML, a Kalibr camchain or a PhotonVision calibration. */
berth_code berth_camera_read(berth_camera* camera, const char* path, berth_error* error);
/** Table 2 of the paper for 4:3 images of that size, to try things out. */
berth_code berth_camera_paper(berth_camera* camera, int32_t width, int32_t height, berth_error* error);

/* ---- Backends: devices that search frames ---- */

typedef struct berth_backend berth_backend;

typedef struct berth_backend_options {
  size_t struct_size;
  const char* device;    /**< by index or by a part of its name; NULL for the first */
  const char* cache_dir; /**< where compiled kernels are kept; NULL for ~/.cache/berth */
  int32_t threads;       /**< of the CPU backends; 0 for every core */
} berth_backend_options;

/** The names that this build knows, in order of preference: "simd", ...; NULL past the last. */
const char* berth_backend_name(size_t index);
/** Opens a backend by name, or the first that opens where name is NULL. options may be NULL: the first device, one
 * thread. All backends give the same bits. */
berth_backend* berth_backend_open(const char* name, const berth_backend_options* options, berth_error* error);
/** "simd on AVX3 ...": valid until the handle is closed. */
const char* berth_backend_description(const berth_backend* backend);
void berth_backend_close(berth_backend* backend); /**< NULL is fine, as for all of these */

/* ---- Settings: what a detector looks for, and how ---- */

typedef struct berth_settings berth_settings;

typedef enum berth_corner_method {
  BERTH_CORNERS_EDGES = 0,      /**< from lines through the border's edges: next to nothing in time */
  BERTH_CORNERS_PHOTOMETRIC = 1 /**< from a fit of the whole pattern, at about the noise's limit (docs/corners.md) */
} berth_corner_method;

typedef enum berth_pose_method {
  BERTH_POSE_LEAST_SQUARES = 0,
  BERTH_POSE_PAPER = 1 /**< the paper's closed form, without covariance */
} berth_pose_method;

/** The names of the families that there are: "tag36h11", ...; NULL past the last. */
const char* berth_family_name(size_t index);

/** Looks for tag36h11 and knows no camera: corners without poses. */
berth_settings* berth_settings_new(berth_error* error);
void berth_settings_free(berth_settings* settings);

/** Looks for this family, too; the first call takes the place of tag36h11. */
berth_code berth_settings_add_family(berth_settings* settings, const char* name, berth_error* error);
/** With a camera and a marker size, markers get poses. The camera's image is as large as the detector's. */
berth_code berth_settings_set_camera(berth_settings* settings, const berth_camera* camera, berth_error* error);
/** Side that the corners span, m. */
berth_code berth_settings_set_marker_size(berth_settings* settings, double size_m, berth_error* error);

/** Markers that stand together and get one pose, from a file (docs/bundles.md): apriltag_ros' YAML or WPILib's JSON.
 * The latter does not say size and family: size_m is 0 and family NULL (tag36h11) where the file says them. */
berth_code berth_settings_read_bundles(berth_settings* settings, const char* path, double size_m, const char* family,
                                       berth_error* error);
/** The same by numbers: begins a bundle, to which berth_settings_add_bundle_marker adds. deviation_m: one standard
 * deviation of where corners are printed, in each coordinate; 0 for exact. */
berth_code berth_settings_add_bundle(berth_settings* settings, const char* name, double deviation_m,
                                     berth_error* error);
/** A marker of the bundle that was begun last; place is from the marker frame to the bundle frame. */
berth_code berth_settings_add_bundle_marker(berth_settings* settings, const char* family, int32_t id, double size_m,
                                            const berth_pose* place, berth_error* error);
/** A target of discs and rings from its YAML file (docs/disc-targets.md); it needs the camera. */
berth_code berth_settings_read_target(berth_settings* settings, const char* path, berth_error* error);

/** Most wrong bits of a code; 2 unless set, never more than the family can correct. */
berth_code berth_settings_set_max_hamming(berth_settings* settings, int32_t bits, berth_error* error);
berth_code berth_settings_set_corner_method(berth_settings* settings, berth_corner_method method, berth_error* error);
berth_code berth_settings_set_pose_method(berth_settings* settings, berth_pose_method method, berth_error* error);
/** One standard deviation of a corner's coordinate, px, in place of what each marker's edges say; 0 for theirs. */
berth_code berth_settings_set_corner_deviation(berth_settings* settings, double deviation_px, berth_error* error);
/** Gains of all pixels, row-major, 1 = unchanged; copied. */
berth_code berth_settings_set_flat_field(berth_settings* settings, const float* gains, size_t count,
                                         berth_error* error);
/** Markers that were found are searched only where they must be, with the bits that the whole frame gives them; the
 * whole frame is searched when one is missing, and every so many frames (docs/tracking.md). 0, the default: always the
 * whole. Frames then need their times. Not together with targets of discs. */
berth_code berth_settings_set_tracking(berth_settings* settings, int32_t full_every, berth_error* error);

/* ---- Detectors ---- */

typedef struct berth_detector berth_detector;

/** When and what a frame is. */
typedef struct berth_stamp {
  size_t struct_size;
  uint64_t sequence;
  int64_t exposure_start_ns, mid_exposure_ns, arrival_ns; /**< on any one clock */
} berth_stamp;

typedef enum berth_frame_status {
  BERTH_FRAME_OK = 0,
  BERTH_FRAME_NO_TARGET = 1,
  BERTH_FRAME_OVERFLOW = 2, /**< a list ran full: what is given holds, but something may be missing */
  BERTH_FRAME_DEVICE_LOST = 3
} berth_frame_status;

/** What became of a frame. */
typedef struct berth_frame {
  size_t struct_size;
  uint64_t sequence;
  int64_t mid_exposure_ns;
  int32_t status; /**< a berth_frame_status */
  int32_t whole;  /**< 1: the whole frame was searched, not only windows around markers */
  size_t markers, bundles, targets;
  int64_t device_ns, decode_ns, corners_ns, pose_ns, discs_ns; /**< what each step took */
  const char* overflow;                                        /**< the list that ran full, else NULL; static */
  uint32_t needed, capacity;
} berth_frame;

/** A marker that was read. */
typedef struct berth_marker {
  size_t struct_size;
  const char* family; /**< static */
  int32_t id;
  int32_t hamming; /**< wrong bits */
  double margin;   /**< mean distance of the bits from their threshold, grey levels */
  /** x, y of the upright marker's upper left corner, then lower left, lower right, upper right, px. */
  double corners[4][2];
  double center[2];
  double corner_covariance[64]; /**< row-major 8 x 8, in the order of corners, px^2 */
  int32_t corners_fitted;       /**< 1: by the photometric fit, 0: by edges */
  int32_t has_pose;
  berth_pose_estimate pose;
} berth_marker;

/** The pose of a bundle, one for each of the settings' in their order. */
typedef struct berth_bundle_pose {
  size_t struct_size;
  const char* name; /**< valid until the detector is closed */
  int32_t has_pose;
  int32_t used, kept_out; /**< markers that went into it, and those that do not fit their place */
  int32_t corners_kept_out;
  berth_pose_estimate pose; /**< bundle frame to camera frame */
} berth_bundle_pose;

/** The pose of a target of discs, one for each of the settings' in their order. */
typedef struct berth_target_pose {
  size_t struct_size;
  const char* name; /**< valid until the detector is closed */
  int32_t has_pose;
  int32_t used; /**< discs that went into it */
  berth_pose_estimate pose;
} berth_target_pose;

/** For frames of one size, 1 to 16384 px a side. */
berth_detector* berth_detector_open(berth_backend* backend, const berth_settings* settings, int32_t width,
                                    int32_t height, berth_error* error);
/** Searches an image: gray, 8 bits, `height` rows of `width` pixels, each row `stride` bytes after the one before. The
 * image is not kept. stamp may be NULL. A frame without a marker is no error. */
berth_code berth_detector_detect(berth_detector* detector, const uint8_t* pixels, size_t stride,
                                 const berth_stamp* stamp, berth_error* error);
/** The last frame's results, copied. */
berth_code berth_detector_frame(const berth_detector* detector, berth_frame* frame, berth_error* error);
berth_code berth_detector_marker(const berth_detector* detector, size_t index, berth_marker* marker,
                                 berth_error* error);
berth_code berth_detector_bundle(const berth_detector* detector, size_t index, berth_bundle_pose* bundle,
                                 berth_error* error);
berth_code berth_detector_target(const berth_detector* detector, size_t index, berth_target_pose* target,
                                 berth_error* error);
/** How many markers the last frame has; 0 for NULL. */
size_t berth_detector_markers(const berth_detector* detector);
/** Device memory, all taken at start; 0 for NULL. */
size_t berth_detector_device_bytes(const berth_detector* detector);
void berth_detector_close(berth_detector* detector);

/* ---- A marker's pose over time (docs/pose-filter.md) ---- */

typedef struct berth_filter berth_filter;

/** Members that are 0 are as PoseFilterConfig has them (include/berth/pose_filter.hpp), except the first two. */
typedef struct berth_filter_settings {
  size_t struct_size;
  const berth_camera* camera;
  double marker_size_m;
  double acceleration, angular_acceleration;     /**< standard deviation of velocities after 1 s, m/s, rad/s */
  double first_velocity, first_angular_velocity; /**< standard deviation when it is first seen, m/s, rad/s */
  double gate;                                   /**< chi-square of 8 degrees of freedom beyond which it is kept out */
  double lost_s;                                 /**< the track ends after so long without the marker */
} berth_filter_settings;

typedef struct berth_filtered_pose {
  size_t struct_size;
  int64_t time_ns;
  int32_t has_pose; /**< there is a track */
  int32_t measured; /**< the frame's marker went into it; else it is foretold */
  int32_t outlier;  /**< a marker was given, and kept out */
  int32_t sure;     /**< the other pose of a plane is ruled out */
  int32_t jumped;   /**< it does not go on from the last one */
  berth_pose pose;
  double covariance[36]; /**< as berth_pose_estimate's */
  double velocity[6];    /**< m/s, then rad/s about axes parallel to the camera's */
  double velocity_covariance[36];
  double age_s; /**< since a marker went in */
} berth_filtered_pose;

berth_filter* berth_filter_open(const berth_filter_settings* settings, berth_error* error);
/** A frame of that time; marker is one with a pose from berth_detector_marker, or NULL where it was not read. */
berth_code berth_filter_update(berth_filter* filter, int64_t mid_exposure_ns, const berth_marker* marker,
                               berth_filtered_pose* pose, berth_error* error);
/** What the last frame says of another time. */
berth_code berth_filter_foretell(const berth_filter* filter, int64_t time_ns, berth_filtered_pose* pose,
                                 berth_error* error);
/** Ends the track. */
berth_code berth_filter_reset(berth_filter* filter, berth_error* error);
void berth_filter_close(berth_filter* filter);

#ifdef __cplusplus
}
#endif

#endif
