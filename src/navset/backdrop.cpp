#include "navset/backdrop.hpp"

#include <fstream>
#include <sstream>

#include "berth/error.hpp"
#include "navset/hash.hpp"

namespace berth::navset {
namespace {

constexpr BackdropKind kTurn[] = {BackdropKind::lab,     BackdropKind::station, BackdropKind::earth, BackdropKind::lab,
                                  BackdropKind::stars,   BackdropKind::station, BackdropKind::earth, BackdropKind::lab,
                                  BackdropKind::station, BackdropKind::abstract};

GrayImage read_pgm(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string magic;
  int width = 0, height = 0, most = 0;
  if (!(file >> magic >> width >> height >> most) || magic != "P5" || most != 255 || width != height || width < 64 ||
      width > 8192) {
    throw Error(path + ": no square 8-bit PGM");
  }
  file.get();
  GrayImage image(width, height);
  const std::streamsize bytes = static_cast<std::streamsize>(width) * height;
  file.read(reinterpret_cast<char*>(image.view().data), bytes);
  if (file.gcount() != bytes) throw Error(path + ": the file ends early");
  return image;
}

}  // namespace

const char* name_of(BackdropKind kind) {
  static constexpr const char* kNames[] = {"lab", "station", "earth", "stars", "abstract", "photo"};
  return kNames[static_cast<std::size_t>(kind)];
}

Gallery::Gallery(const std::string& photo_folder) {
  for (int i = 0; i < kRendered; ++i) {
    const BackdropKind kind = kTurn[i % 10];
    // Tens take turns, so that each kind is in both halves.
    const bool held_out = (i / 10) % 10 < 3;
    entries_.push_back(
        {kind, name_of(kind) + ("-" + std::to_string(i)), held_out, std::make_unique<std::once_flag>(), {}});
  }
  if (!photo_folder.empty()) read_photos(photo_folder);
}

void Gallery::read_photos(const std::string& folder) {
  std::ifstream index(folder + "/index.txt");
  if (!index) throw Error("cannot read " + folder + "/index.txt: training/backgrounds.py makes it");
  photo_hash_ = kHashStart;
  std::string line;
  while (std::getline(index, line)) {
    std::istringstream words(line);
    std::string file, source;
    if (!(words >> file >> source)) continue;
    const bool held_out = sim::scatter(hash_bytes(source.data(), source.size())) % 10 < 3;
    entries_.push_back({BackdropKind::photo, file.substr(0, file.rfind('.')), held_out,
                        std::make_unique<std::once_flag>(), read_pgm(std::string(folder).append("/").append(file))});
    const View2D<const u8> image = entries_.back().image.view();
    photo_hash_ = hash_bytes(image.data, static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
                             photo_hash_);
  }
}

View2D<const u8> Gallery::pixels(int index) const {
  const Entry& e = entry(index);
  if (e.kind != BackdropKind::photo) {
    std::call_once(*e.once, [&] { e.image = render_backdrop(e.kind, static_cast<u64>(index), kSide_px); });
  }
  return static_cast<const GrayImage&>(e.image).view();
}

}  // namespace berth::navset
