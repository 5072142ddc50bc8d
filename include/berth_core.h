/** @file
 * Berth's flight core: berth.h's detectors in memory of the caller's, as a static library, libberth-core.a. See
 * docs/flight-core.md.
 *
 * The library has berth_version, berth_camera_paper, berth_family_name, the berth_detector_ calls except
 * berth_detector_open, and what follows. It calls neither malloc nor operator new, starts no thread, reads no file and
 * writes none. Where it has no memory a call says BERTH_OUT_OF_MEMORY.
 */
#ifndef BERTH_CORE_H
#define BERTH_CORE_H

#include "berth.h"

#ifdef __cplusplus
extern "C" {
#endif

/** Memory for a detector begins at a multiple of this, bytes. */
#define BERTH_CORE_ALIGNMENT 64

/** A marker of a bundle; place is from the marker frame to the bundle frame. */
typedef struct berth_core_bundle_marker {
  const char* family;
  int32_t id;
  double size_m;
  berth_pose place;
} berth_core_bundle_marker;

/** Markers that stand together and get one pose (docs/bundles.md). */
typedef struct berth_core_bundle {
  const char* name;
  const berth_core_bundle_marker* markers;
  size_t marker_count;
  double deviation_m; /**< one standard deviation of where corners are printed, in each coordinate; 0 for exact */
} berth_core_bundle;

/** What a detector looks for. Members that are 0 are as for berth_settings_new. Everything is copied. */
typedef struct berth_core_settings {
  size_t struct_size;
  int32_t width, height;       /**< of the frames, 1 to 16384 px */
  const berth_camera* camera;  /**< NULL: corners without poses */
  double marker_size_m;        /**< side that the corners span */
  const char* const* families; /**< NULL: tag36h11 */
  size_t family_count;
  const berth_core_bundle* bundles;
  size_t bundle_count;
  int32_t max_hamming; /**< most wrong bits of a code; 0: two; negative: none */
  int32_t corner_method;
  int32_t pose_method;
  double corner_deviation_px;
  int32_t full_every; /**< as berth_settings_set_tracking */
} berth_core_settings;

/** Bytes that berth_core_open takes for these settings on this machine, to the last one; 0 where it would fail, which
 * `error` explains. The only call that asks the system for memory: it opens a detector there and gives it back. */
size_t berth_core_memory_needed(const berth_core_settings* settings, berth_error* error);

/** Opens a detector in `memory`, which stays the detector's until it is closed. NULL where it fails. It runs on the
 * calling thread with the widest vectors that the processor has, and gives the bits of all backends. */
berth_detector* berth_core_open(const berth_core_settings* settings, void* memory, size_t bytes, berth_error* error);

/** Bytes that errors' texts have taken on this thread so far. A call that says BERTH_OK adds nothing: what this counts
 * is all that the library ever takes beside the caller's memory and its own variables. */
size_t berth_core_message_bytes(void);

#ifdef __cplusplus
}
#endif

#endif
