#include "aravis/chunk_data.hpp"

#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <stdexcept>

namespace {

constexpr std::uint32_t kModeRegister = 0x1f8, kEnableRegister = 0x1fc, kTickFrequency = 125'000'000;
/// GigE Vision's bootstrap registers.
constexpr std::uint32_t kTickFrequencyHigh = 0x093c, kTickFrequencyLow = 0x0940;
constexpr std::uint64_t kBeforeLeaderNs = 3'000'000;
constexpr std::uint32_t kImageChunk = 1, kTimestampChunk = 2;

constexpr const char* kNodes = R"(
  <IntConverter Name="ImageHeight">
    <FormulaTo>FROM + 1</FormulaTo><FormulaFrom>TO - 1</FormulaFrom><pValue>HeightRegister</pValue>
  </IntConverter>
  <Boolean Name="ChunkModeActive"><pValue>ChunkMode</pValue><OnValue>1</OnValue><OffValue>0</OffValue></Boolean>
  <Enumeration Name="ChunkSelector">
    <EnumEntry Name="Timestamp"><Value>2</Value></EnumEntry><Value>2</Value>
  </Enumeration>
  <Boolean Name="ChunkEnable"><pValue>ChunkOn</pValue><OnValue>1</OnValue><OffValue>0</OffValue></Boolean>
  <IntReg Name="ChunkMode">
    <Address>0x1f8</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>
    <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>
  </IntReg>
  <IntReg Name="ChunkOn">
    <Address>0x1fc</Address><Length>4</Length><AccessMode>RW</AccessMode><pPort>Device</pPort>
    <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>
  </IntReg>
  <Integer Name="ChunkTimestamp"><pValue>ChunkTime</pValue></Integer>
  <IntReg Name="ChunkTime">
    <Address>0</Address><Length>8</Length><AccessMode>RO</AccessMode><pPort>TimestampPort</pPort>
    <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>
  </IntReg>
  <Port Name="TimestampPort"><ChunkID>00000002</ChunkID></Port>
)";

/// Whether the leader of the frame being sent has to be changed, and whether it says that there are chunks. By the
/// camera's thread alone.
bool has_extra_row = false, has_chunks = false;

void replace(std::string& text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  if (at == std::string::npos) throw std::runtime_error("Aravis' fake camera has no " + what);
  text.replace(at, what.size(), by);
}

unsigned char* put(unsigned char* to, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) *to++ = static_cast<unsigned char>(value >> 8 * (bytes - 1 - i));
  return to;
}

/// Of GVSP: a leader of an image, told from the camera's answers by its length.
bool is_leader(const unsigned char* packet, std::size_t size) { return size == 44 && packet[4] == 1; }

/// Its payload type with the bit for chunks, and its height without the extra row.
void change_leader(unsigned char* packet) {
  if (has_chunks) packet[10] |= 0x40;
  unsigned char* const height = packet + 28;
  std::uint32_t rows = 0;
  for (int i = 0; i < 4; ++i) rows = rows << 8 | height[i];
  put(height, rows - 1, 4);
}

}  // namespace

/// In place of the C library's, for the fake camera's sockets.
// NOLINTNEXTLINE(readability-inconsistent-declaration-parameter-name): its names are reserved ones
extern "C" ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  std::array<unsigned char, 44> leader = {};
  iovec part = {leader.data(), leader.size()};
  msghdr changed = *message;
  if (has_extra_row && message->msg_iovlen == 1 &&
      is_leader(static_cast<const unsigned char*>(message->msg_iov->iov_base), message->msg_iov->iov_len)) {
    std::memcpy(leader.data(), message->msg_iov->iov_base, leader.size());
    change_leader(leader.data());
    changed.msg_iov = &part;
  }
  return syscall(SYS_sendmsg, socket, &changed, flags);
}

namespace berth::test {

std::string with_chunk_nodes(std::string description) {
  replace(description, "<pValue>HeightRegister</pValue>", "<pValue>ImageHeight</pValue>");
  replace(description, "<pVariable Name=\"HEIGHT\">Height</pVariable>",
          "<pVariable Name=\"HEIGHT\">HeightRegister</pVariable>");
  description.insert(description.rfind("</RegisterDescription>"), kNodes);
  return description;
}

void set_tick_frequency(ArvFakeCamera* camera) {
  arv_fake_camera_write_register(camera, kTickFrequencyHigh, 0);
  arv_fake_camera_write_register(camera, kTickFrequencyLow, kTickFrequency);
}

void write_chunks(ArvFakeCamera* camera, ArvBuffer* buffer, bool sends) {
  guint32 is_active = 0, is_enabled = 0;
  arv_fake_camera_read_register(camera, kModeRegister, &is_active);
  arv_fake_camera_read_register(camera, kEnableRegister, &is_enabled);
  has_extra_row = true;
  has_chunks = sends && is_active == 1 && is_enabled == 1;
  int width = 0, height = 0;
  arv_buffer_get_image_region(buffer, nullptr, nullptr, &width, &height);
  std::size_t ignored = 0;
  auto* pixels = static_cast<unsigned char*>(const_cast<void*>(arv_buffer_get_data(buffer, &ignored)));
  const auto bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  // Each chunk's number and size stand behind it: the image's, then the time's.
  constexpr std::size_t kTail = 8;
  const std::size_t image_bytes = bytes - 3 * kTail;
  unsigned char* at = pixels + image_bytes;
  at = put(put(at, kImageChunk, 4), image_bytes, 4);
  const std::uint64_t ticks = (arv_buffer_get_timestamp(buffer) - kBeforeLeaderNs) / (1'000'000'000 / kTickFrequency);
  at = put(at, ticks, 8);
  put(put(at, kTimestampChunk, 4), 8, 4);
}

}  // namespace berth::test
