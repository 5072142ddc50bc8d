#include "vulkan/pipeline_cache.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "spirv_kernels.hpp"

namespace berth::vulkan {
namespace {

const std::string kMagic = "berth vulkan 1\n";
constexpr std::size_t kHeaderBytes = 15 + 4;
/// Above any real cache; a wrong file must not fill the machine's memory.
constexpr long kMaxFileBytes = 1L << 28;

u32 crc32(const unsigned char* bytes, std::size_t count) {
  u32 crc = 0xffffffffu;
  for (std::size_t i = 0; i < count; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? 0xedb88320u ^ (crc >> 1) : crc >> 1;
  }
  return ~crc;
}

std::string hex(u64 value, int digits) {
  char text[20];
  std::snprintf(text, sizeof text, "%0*llx", digits, static_cast<unsigned long long>(value));
  return text;
}

/// FNV-1a over the words of every kernel.
u64 kernels_hash() {
  u64 hash = 0xcbf29ce484222325u;
  for (const Op op : all_ops()) {
    for (const SpirvForm form : kSpirvForms) {
      const SpirvKernel& kernel = spirv_kernel(op, form);
      for (std::size_t i = 0; i < kernel.bytes / 4; ++i) hash = (hash ^ kernel.words[i]) * 0x100000001b3u;
    }
  }
  return hash;
}

/// What every driver's data begins with; the compiler lays it out like the specification.
bool is_for(const VkPhysicalDeviceProperties& device, const unsigned char* data, std::size_t bytes) {
  VkPipelineCacheHeaderVersionOne header = {};
  if (bytes < sizeof header) return false;
  std::memcpy(&header, data, sizeof header);
  return header.headerVersion == VK_PIPELINE_CACHE_HEADER_VERSION_ONE && header.vendorID == device.vendorID &&
         header.deviceID == device.deviceID &&
         std::memcmp(header.pipelineCacheUUID, device.pipelineCacheUUID, VK_UUID_SIZE) == 0;
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

std::vector<unsigned char> read_file(const std::string& path) {
  struct stat info = {};
  if (stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode) || info.st_size > kMaxFileBytes) return {};
  const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rbe"));
  if (file == nullptr) return {};
  std::vector<unsigned char> bytes(static_cast<std::size_t>(info.st_size));
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file.get()));
  return bytes;
}

bool make_folders(const std::string& folder) {
  for (std::size_t end = folder.find('/', 1);; end = folder.find('/', end + 1)) {
    const std::string part = folder.substr(0, end);
    if (mkdir(part.c_str(), 0700) != 0 && errno != EEXIST && access(part.c_str(), F_OK) != 0) return false;
    if (end == std::string::npos) return true;
  }
}

/// A name of its own for each writer, made by the system, then renamed.
bool write_file(const std::string& path, const std::vector<unsigned char>& bytes) {
  std::string temporary = path + ".XXXXXX";
  const int descriptor = mkstemp(&temporary[0]);
  if (descriptor < 0) return false;
  std::FILE* file = fdopen(descriptor, "wb");
  if (file == nullptr) {
    close(descriptor);
    unlink(temporary.c_str());
    return false;
  }
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  const bool closed = std::fclose(file) == 0;
  if (written && closed && std::rename(temporary.c_str(), path.c_str()) == 0) return true;
  unlink(temporary.c_str());
  return false;
}

}  // namespace

PipelineCache::PipelineCache(const std::string& folder, const VkPhysicalDeviceProperties& device)
    : folder_(folder), device_(device) {
  if (folder_.empty()) return;
  path_ = folder_ + "/" + hex(device.vendorID, 8) + hex(device.deviceID, 8) + "-";
  for (const uint8_t byte : device.pipelineCacheUUID) path_ += hex(byte, 2);
  path_ += "-" + hex(kernels_hash(), 16) + ".vkcache";
}

std::vector<unsigned char> PipelineCache::load() const {
  if (path_.empty()) return {};
  const std::vector<unsigned char> bytes = read_file(path_);
  if (bytes.size() < kHeaderBytes || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0) return {};
  const unsigned char* data = bytes.data() + kHeaderBytes;
  const std::size_t size = bytes.size() - kHeaderBytes;
  const u32 sum = crc32(data, size);
  for (std::size_t i = 0; i < 4; ++i) {
    if (bytes[kMagic.size() + i] != static_cast<unsigned char>(sum >> (8 * i))) return {};
  }
  if (!is_for(device_, data, size)) return {};
  return {data, data + size};
}

bool PipelineCache::store(const std::vector<unsigned char>& data) const {
  if (path_.empty() || data.empty() || !make_folders(folder_)) return false;
  std::vector<unsigned char> bytes(kMagic.begin(), kMagic.end());
  const u32 sum = crc32(data.data(), data.size());
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<unsigned char>(sum >> shift));
  bytes.insert(bytes.end(), data.begin(), data.end());
  return write_file(path_, bytes);
}

std::string cache_folder(const std::string& chosen) {
  if (!chosen.empty()) return chosen;
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  // The XDG specification: a relative path counts as unset.
  if (xdg != nullptr && xdg[0] == '/') return std::string(xdg) + "/berth";
  const char* home = std::getenv("HOME");
  return home != nullptr && home[0] != '\0' ? std::string(home) + "/.cache/berth" : "";
}

}  // namespace berth::vulkan
