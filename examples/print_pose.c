#include <stdio.h>

#include "berth.h"

static unsigned char gray[1920 * 1080];

int main(int argc, char** argv) {
  int width = 0, height = 0;
  FILE* file = fopen(argc > 1 ? argv[1] : "dock.pgm", "rb");
  if (!file || fscanf(file, "P5 %d %d 255", &width, &height) != 2 || (size_t)width * height > sizeof gray) return 2;
  fgetc(file);  // the end of the header's line
  if (fread(gray, width, height, file) != (size_t)height) return 2;

  berth_error error = {0};  // the first failure stays in it
  berth_backend* backend = berth_backend_open("simd", NULL, &error);
  berth_settings* settings = berth_settings_new(&error);  // looks for tag36h11 unless told otherwise
  berth_camera camera = {.struct_size = sizeof camera};
  berth_camera_paper(&camera, width, height, &error);  // yours: berth_camera_read(&camera, "camera.yaml", &error)
  berth_settings_set_camera(settings, &camera, &error);
  berth_settings_set_marker_size(settings, 0.1, &error);
  berth_detector* detector = berth_detector_open(backend, settings, width, height, &error);
  berth_detector_detect(detector, gray, width, NULL, &error);
  for (size_t i = 0; i < berth_detector_markers(detector); ++i) {
    berth_marker marker = {.struct_size = sizeof marker};
    berth_detector_marker(detector, i, &marker, &error);
    const double* t = marker.pose.pose.t;  // metres: x right, y down, z away from the camera
    printf("%s %d at %.4f %.4f %.4f m\n", marker.family, (int)marker.id, t[0], t[1], t[2]);
  }
  berth_detector_close(detector);
  berth_settings_free(settings);
  berth_backend_close(backend);
  return error.code ? fprintf(stderr, "%s\n", error.message), 2 : 0;
}
