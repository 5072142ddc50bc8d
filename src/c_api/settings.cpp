// include/berth.h: cameras, backends and settings.

#include "c_api/edge.hpp"
#include "c_api/handles.hpp"

using namespace berth;
using namespace berth::c_api;

namespace {

std::shared_ptr<Backend> open_first(const BackendOptions& options) {
  std::string reasons;
  for (const std::string& name : backend_names()) {
    try {
      return open_backend(name, options);
    } catch (const Error& error) {
      reasons += "\n" + std::string(error.what());
    }
  }
  throw Error("no backend opens:" + reasons);
}

/// Changes the settings of a handle.
template <class Change>
berth_code change(berth_settings* settings, berth_error* error, Change make) {
  return guarded(error, [&] { make(needed(settings, "settings")); });
}

}  // namespace

extern "C" {

berth_code berth_camera_read(berth_camera* camera, const char* path, berth_error* error) {
  return guarded(error, [&] { write_camera(read_camera(&needed(path, "path")), camera); });
}

const char* berth_backend_name(size_t index) {
  return index < backend_names().size() ? backend_names()[index].c_str() : nullptr;
}

berth_backend* berth_backend_open(const char* name, const berth_backend_options* options, berth_error* error) {
  return opened(error, [&] {
    BackendOptions wanted;
    if (options != nullptr) {
      const berth_backend_options given = read_struct(options, "options");
      if (given.device != nullptr) wanted.device = given.device;
      if (given.cache_dir != nullptr) wanted.cache_dir = given.cache_dir;
      wanted.threads = given.threads;
    }
    std::shared_ptr<Backend> backend = name == nullptr ? open_first(wanted) : open_backend(name, wanted);
    std::string description = backend->name() + (" on " + backend->device().name);
    return new berth_backend{std::move(backend), std::move(description)};
  });
}

const char* berth_backend_description(const berth_backend* backend) {
  return backend == nullptr ? nullptr : backend->description.c_str();
}

void berth_backend_close(berth_backend* backend) { delete backend; }

berth_settings* berth_settings_new(berth_error* error) {
  return opened(error, [] { return new berth_settings; });
}

void berth_settings_free(berth_settings* settings) { delete settings; }

berth_code berth_settings_add_family(berth_settings* settings, const char* name, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) {
    const std::string& known = family(&needed(name, "name")).name;
    if (!s.names_families) s.config.families.clear();
    s.names_families = true;
    s.config.families.push_back(known);
  });
}

berth_code berth_settings_set_camera(berth_settings* settings, const berth_camera* camera, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) { s.config.camera = camera_of(camera); });
}

berth_code berth_settings_set_marker_size(berth_settings* settings, double size_m, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) { s.config.marker_size_m = size_m; });
}

berth_code berth_settings_read_bundles(berth_settings* settings, const char* path, double size_m,
                                       const char* family_name, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) {
    std::vector<Bundle> bundles =
        read_bundles(&needed(path, "path"), size_m, family_name == nullptr ? "tag36h11" : family_name);
    for (Bundle& bundle : bundles) s.config.bundles.push_back(std::move(bundle));
  });
}

berth_code berth_settings_add_bundle(berth_settings* settings, const char* name, double deviation_m,
                                     berth_error* error) {
  return change(settings, error, [&](berth_settings& s) {
    s.config.bundles.push_back({&needed(name, "name"), {}, deviation_m});
  });
}

berth_code berth_settings_add_bundle_marker(berth_settings* settings, const char* family_name, int32_t id,
                                            double size_m, const berth_pose* place, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) {
    if (s.config.bundles.empty()) throw BadArgument("there is no bundle; begin one with berth_settings_add_bundle");
    s.config.bundles.back().markers.push_back(
        {&family(&needed(family_name, "family")), id, size_m, pose_of(needed(place, "place"))});
  });
}

berth_code berth_settings_read_target(berth_settings* settings, const char* path, berth_error* error) {
  return change(settings, error,
                [&](berth_settings& s) { s.config.disc_targets.push_back(read_disc_target(&needed(path, "path"))); });
}

berth_code berth_settings_set_max_hamming(berth_settings* settings, int32_t bits, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) {
    if (bits < 0) throw BadArgument("max_hamming is " + std::to_string(bits) + "; give 0 or more");
    s.config.max_hamming = bits;
  });
}

berth_code berth_settings_set_corner_method(berth_settings* settings, berth_corner_method method, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) { s.config.corner_method = corner_method_of(method); });
}

berth_code berth_settings_set_pose_method(berth_settings* settings, berth_pose_method method, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) { s.config.pose_method = pose_method_of(method); });
}

berth_code berth_settings_set_corner_deviation(berth_settings* settings, double deviation_px, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) { s.config.corner_deviation_px = deviation_px; });
}

berth_code berth_settings_set_flat_field(berth_settings* settings, const float* gains, size_t count,
                                         berth_error* error) {
  return change(settings, error, [&](berth_settings& s) {
    const float* first = &needed(gains, "gains");
    s.config.flat_field.assign(first, first + count);
  });
}

berth_code berth_settings_set_tracking(berth_settings* settings, int32_t full_every, berth_error* error) {
  return change(settings, error, [&](berth_settings& s) { s.full_every = full_every_of(full_every); });
}

}  // extern "C"
