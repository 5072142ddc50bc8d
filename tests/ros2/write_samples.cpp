// ros2_samples FOLDER: the sample messages and their schemas as files, for ros2/read_messages.py.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "ros2/sample_messages.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: ros2_samples FOLDER\n"), 2;
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  int number = 0;
  berth::ros2::CdrWriter cdr;
  berth::ros2::SampleMessages().each([&](const auto& message) {
    write(message, cdr);
    const std::string name = std::to_string(number++);
    std::ofstream(folder / (name + ".cdr"), std::ios::binary)
        .write(reinterpret_cast<const char*>(cdr.bytes().data()), static_cast<std::streamsize>(cdr.bytes().size()));
    std::ofstream(folder / (name + ".type")) << message.kType;
    std::ofstream(folder / (name + ".msg")) << berth::ros2::schema_of(message.kType);
  });
}
