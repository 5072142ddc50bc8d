// include/berth.h: what there is without a handle.

#include "c_api/edge.hpp"
#include "c_api/handles.hpp"
#include "target/family_name.hpp"

using namespace berth;
using namespace berth::c_api;

extern "C" {

const char* berth_version(void) { return BERTH_LIBRARY_VERSION; }

berth_code berth_camera_paper(berth_camera* camera, int32_t width, int32_t height, berth_error* error) {
  return guarded(error, [&] { write_camera(paper_camera(width, height), camera); });
}

const char* berth_family_name(size_t index) { return family_name_at(index); }

}  // extern "C"
