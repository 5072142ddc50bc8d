#include <stdio.h>

#include "berth_core.h"

static unsigned char gray[480][640];
static _Alignas(BERTH_CORE_ALIGNMENT) unsigned char memory[16 << 20];

int main(int argc, char** argv) {
  FILE* file = fopen(argc > 1 ? argv[1] : "dock.pgm", "rb");
  int width = 0, height = 0;
  if (!file || fscanf(file, "P5 %d %d 255", &width, &height) != 2 || width != 640 || height != 480) return 2;
  fgetc(file);  // the end of the header's line
  if (fread(gray, sizeof gray, 1, file) != 1) return 2;

  berth_error error = {0};  // the first failure stays in it
  berth_camera camera = {.struct_size = sizeof camera};
  berth_camera_paper(&camera, 640, 480, &error);  // yours: write its numbers here
  const berth_core_settings settings = {
      .struct_size = sizeof settings, .width = 640, .height = 480, .camera = &camera, .marker_size_m = 0.1};
  printf("%zu of %zu bytes\n", berth_core_memory_needed(&settings, &error), sizeof memory);
  berth_detector* detector = berth_core_open(&settings, memory, sizeof memory, &error);
  berth_detector_detect(detector, gray[0], 640, NULL, &error);
  for (size_t i = 0; i < berth_detector_markers(detector); ++i) {
    berth_marker marker = {.struct_size = sizeof marker};
    berth_detector_marker(detector, i, &marker, &error);
    const double* t = marker.pose.pose.t;  // metres: x right, y down, z away from the camera
    printf("%s %d at %.4f %.4f %.4f m\n", marker.family, (int)marker.id, t[0], t[1], t[2]);
  }
  berth_detector_close(detector);
  return error.code ? fprintf(stderr, "%s\n", error.message), 2 : 0;
}
