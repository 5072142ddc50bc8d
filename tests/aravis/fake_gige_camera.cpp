// A GigE Vision camera on the loopback interface, Aravis' own fake one with the serial number GV77, that shows a
// source's frames in turn:
//   fake_gige_camera SOURCE FRAMES [KEY=VALUE...]
// It is there once it has written a line, and until its standard input ends. A number on a line there: so many frames
// more, then it is silent. Keys:
//   address=A   of the interface, 127.0.0.1 unless given: one camera has each
//   chunks=N    has chunk data (chunk_data.hpp), without which every Nth frame comes
//   lost=SHARE  of the packets, which it loses on the way
//   nodes=FILE  of GenICam nodes that it has besides its own
//   sent=FILE   where it writes each frame's time as it takes it, a line each, whatever becomes of the process
#include <arv.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "aravis/chunk_data.hpp"
#include "camera/sources.hpp"

namespace {

struct Show {
  std::vector<berth::GrayImage> images;
  std::atomic<std::size_t> next = 0, most = SIZE_MAX;
  int sent = -1;
  /// 0: no chunk data.
  std::size_t chunks = 0;
  ArvGvFakeCamera* camera = nullptr;
};

void lose(ArvGvFakeCamera* camera, double share) { g_object_set(camera, "gvsp-lost-ratio", share, nullptr); }

/// In one call, so that a line is there as soon as the frame is.
void note_time(const Show& show, ArvBuffer* buffer) {
  const std::string line = std::to_string(arv_buffer_get_timestamp(buffer)) + "\n";
  if (show.sent >= 0 && write(show.sent, line.data(), line.size()) < 0) std::perror("fake_gige_camera: sent");
}

/// Aravis says that the buffer has 0 bytes; it has room for a frame of the size that the camera is set to.
void draw(ArvBuffer* buffer, void* data, guint32, guint32, ArvPixelFormat) {
  Show& show = *static_cast<Show*>(data);
  if (show.next >= show.most) return lose(show.camera, 1);
  note_time(show, buffer);
  const berth::GrayImage& image = show.images[show.next++ % show.images.size()];
  std::size_t ignored = 0;
  auto* pixels = static_cast<unsigned char*>(const_cast<void*>(arv_buffer_get_data(buffer, &ignored)));
  int width = 0, height = 0;
  arv_buffer_get_image_region(buffer, nullptr, nullptr, &width, &height);
  const int columns = std::min(width, image.width());
  for (int y = 0; y < std::min(height, image.height()); ++y) {
    std::memcpy(pixels + static_cast<std::ptrdiff_t>(y) * width, image.view().row(y),
                static_cast<std::size_t>(columns));
  }
  if (show.chunks == 0) return;
  berth::test::write_chunks(arv_gv_fake_camera_get_fake_camera(show.camera), buffer, show.next % show.chunks != 0);
}

/// The fake camera's own description, with these nodes beside its own.
std::string describe(const std::string& nodes) {
  ArvFakeCamera* plain = arv_fake_camera_new("plain");
  std::size_t bytes = 0;
  const char* text = arv_fake_camera_get_genicam_xml(plain, &bytes);
  std::string description(text, bytes);
  g_object_unref(plain);
  description.insert(description.rfind("</RegisterDescription>"), nodes);
  return description;
}

/// The file of the description that the keys ask for; empty where the camera's own does.
std::string description_file(const std::map<std::string, std::string>& keys) {
  const auto nodes = keys.find("nodes");
  if (nodes == keys.end() && keys.count("chunks") == 0) return "";
  std::string given;
  if (nodes != keys.end()) {
    std::ifstream file(nodes->second);
    given.assign(std::istreambuf_iterator<char>(file), {});
  }
  std::string description = describe(given);
  if (keys.count("chunks") > 0) description = berth::test::with_chunk_nodes(std::move(description));
  std::string path = std::filesystem::temp_directory_path() / "fake-gige-XXXXXX";
  const int file = mkstemp(path.data());
  if (file < 0 || write(file, description.data(), description.size()) < 0) {
    throw std::invalid_argument(path + ": it cannot be written");
  }
  close(file);
  return path;
}

}  // namespace

int main(int argc, char** argv) try {
  std::map<std::string, std::string> keys;
  for (int i = 3; i < argc; ++i) {
    const std::string given = argv[i];
    const std::size_t equals = given.find('=');
    if (equals == std::string::npos) throw std::invalid_argument(given + ": give KEY=VALUE");
    keys[given.substr(0, equals)] = given.substr(equals + 1);
  }
  if (argc < 3) throw std::invalid_argument("fake_gige_camera SOURCE FRAMES [KEY=VALUE...]");
  Show show;
  const auto source = berth::open_source(argv[1]);
  for (int left = std::stoi(argv[2]); left > 0; --left) show.images.push_back(source->next().value().image);
  if (keys.count("sent") > 0) {
    show.sent = open(keys["sent"].c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (show.sent < 0) throw std::invalid_argument(keys["sent"] + ": it cannot be written");
  }
  const std::string description = description_file(keys);
  const std::string address = keys.count("address") > 0 ? keys["address"] : "127.0.0.1";
  ArvGvFakeCamera* camera =
      arv_gv_fake_camera_new_full(address.c_str(), "GV77", description.empty() ? nullptr : description.c_str());
  if (arv_gv_fake_camera_is_running(camera) == 0) {
    return std::fprintf(stderr, "UDP port 3956 of %s cannot be had\n", address.c_str()), 1;
  }
  if (!description.empty()) unlink(description.c_str());  // it has been read
  show.camera = camera;
  if (keys.count("chunks") > 0) {
    show.chunks = std::stoul(keys["chunks"]);
    berth::test::set_tick_frequency(arv_gv_fake_camera_get_fake_camera(camera));
  }
  if (keys.count("lost") > 0) lose(camera, std::stod(keys["lost"]));
  arv_fake_camera_set_fill_pattern(arv_gv_fake_camera_get_fake_camera(camera), draw, &show);
  std::puts("ready");
  std::fflush(stdout);
  for (std::string line; std::getline(std::cin, line);) show.most = show.next + std::stoul(line);
  g_object_unref(camera);
  return 0;
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
