#include "camera/v4l2_device.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "berth/error.hpp"

namespace berth {
namespace {

class KernelDevice final : public V4l2Device {
 public:
  explicit KernelDevice(int file) : file_(file) {}
  ~KernelDevice() override {
    for (const auto& [memory, bytes] : maps_) munmap(memory, bytes);
    close(file_);
  }
  KernelDevice(const KernelDevice&) = delete;
  KernelDevice& operator=(const KernelDevice&) = delete;

  int control(unsigned long request, void* argument) override {
    while (ioctl(file_, request, argument) != 0) {
      if (errno != EINTR) return errno;
    }
    return 0;
  }

  void* map(std::size_t bytes, std::uint32_t offset) override {
    void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_, static_cast<off_t>(offset));
    if (memory == MAP_FAILED) return nullptr;
    maps_.emplace_back(memory, bytes);
    return memory;
  }

  int wait(int timeout_ms) override {
    pollfd ready = {file_, POLLIN, 0};
    const int count = poll(&ready, 1, timeout_ms);
    // A signal ends the wait as its time does: the caller looks whether it is to stop.
    if (count == 0 || (count < 0 && errno == EINTR)) return ETIMEDOUT;
    if (count < 0) return errno;
    return (ready.revents & POLLIN) != 0 ? 0 : ENODEV;
  }

 private:
  int file_;
  std::vector<std::pair<void*, std::size_t>> maps_;
};

const char* remedy(int error) {
  switch (error) {
    case ENOENT:
      return "ls /dev/v4l/by-path shows the cameras there are; v4l2:by-path/NAME names one for good";
    case EACCES:
      return "join the group that owns it (sudo usermod -aG video $USER, then log in again)";
    case EBUSY:
      return "another program has it; fuser PATH tells which";
    default:
      return "try v4l2-ctl --list-devices (package v4l-utils)";
  }
}

}  // namespace

std::unique_ptr<V4l2Device> open_v4l2_device(const std::string& path) {
  const int file = open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) {
    const int error = errno;
    throw Error(path + ": the camera cannot be opened (" + std::strerror(error) + "); " + remedy(error));
  }
  return std::make_unique<KernelDevice>(file);
}

}  // namespace berth
