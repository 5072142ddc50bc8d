#include "camera/aravis_finder.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "berth/error.hpp"
#include "camera/aravis_camera.hpp"
#include "camera/gige_probe.hpp"

namespace berth {

AravisFinder::AravisFinder(std::string name) : name_(std::move(name)) {
  if (g_hostname_is_ip_address(name_.c_str()) != 0) id_ = address_ = name_;
}

Object<ArvCamera> AravisFinder::open() {
  // One that was seen may have got another address; looking at the whole network takes a second.
  constexpr int kLookEvery = 16;
  if (id_.empty() || ++attempts_ % kLookEvery == 0) look();
  // Aravis asks a camera that is not there for seconds; one that returns then is noticed late.
  if (!address_.empty() && !answers_gige(address_, kAnswerMs)) fail(" (it does not answer at " + address_ + ")");
  Failure failure;
  Object<ArvCamera> camera(arv_camera_new((id_.empty() ? name_ : id_).c_str(), failure.put()));
  if (!camera) fail(failure.because());
  attempts_ = 0;
  return camera;
}

void AravisFinder::fail(const std::string& why) const {
  throw Error("aravis:" + name_ + ": the camera cannot be opened" + why +
              "; berth doctor lists those there are, and one that another program has cannot be had");
}

void AravisFinder::look() {
  if (id_ == name_ && address_ == name_) return;  // no other will do
  arv_update_device_list();
  const auto is_name = [&](const char* text) { return text != nullptr && name_ == text; };
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    if (!is_name(arv_get_device_serial_nbr(i)) && !is_name(arv_get_device_id(i)) &&
        !is_name(arv_get_device_address(i)) && !is_name(arv_get_device_physical_id(i))) {
      continue;
    }
    id_ = arv_get_device_id(i);
    const bool is_network = std::string_view(arv_get_device_protocol(i)) == "GigEVision";
    address_ = is_network ? arv_get_device_address(i) : "";
    return;
  }
}

std::vector<std::string> list_aravis_cameras() {
  arv_update_device_list();
  std::vector<std::string> names;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    const char* serial = arv_get_device_serial_nbr(i);
    const char* id = arv_get_device_id(i);
    names.push_back(std::string("aravis:") + (serial != nullptr && *serial != '\0' ? serial : id));
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace berth
