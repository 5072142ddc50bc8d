// Writes the tables of every built-in marker family as C++ (families.cpp includes the result). A tool of the build: it
// links libapriltag and OpenCV's ArUco so that nobody retypes a code and nothing of Berth needs them later.

#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h10.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagCircle49h12.h>
#include <apriltag/tagCustom48h12.h>
#include <apriltag/tagStandard41h12.h>
#include <apriltag/tagStandard52h13.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "opencv_aruco.hpp"

namespace {

struct Family {
  std::string name;
  int border_width = 0;
  int total_width = 0;
  bool reversed_border = false;
  int min_hamming = 0;
  std::vector<int> bit_x, bit_y;
  std::vector<std::uint64_t> codes;
};

struct LibraryFamily {
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

const LibraryFamily kLibraryFamilies[] = {{tag36h11_create, tag36h11_destroy},
                                          {tag36h10_create, tag36h10_destroy},
                                          {tag25h9_create, tag25h9_destroy},
                                          {tag16h5_create, tag16h5_destroy},
                                          {tagStandard41h12_create, tagStandard41h12_destroy},
                                          {tagStandard52h13_create, tagStandard52h13_destroy},
                                          {tagCircle21h7_create, tagCircle21h7_destroy},
                                          {tagCircle49h12_create, tagCircle49h12_destroy},
                                          {tagCustom48h12_create, tagCustom48h12_destroy}};

[[noreturn]] void fail(const std::string& why) {
  std::cerr << "generate_families: " << why << "\n";
  std::exit(1);
}

// The module at (x, y) lies at (border_width - 1 - y, x) once the marker is turned clockwise by a quarter turn.
std::vector<int> quarter_turn(const Family& family) {
  std::vector<int> turn;
  for (std::size_t i = 0; i < family.bit_x.size(); ++i) {
    const int x = family.border_width - 1 - family.bit_y[i];
    const int y = family.bit_x[i];
    std::size_t seen = 0;
    while (seen < family.bit_x.size() && (family.bit_x[seen] != x || family.bit_y[seen] != y)) ++seen;
    if (seen == family.bit_x.size()) fail(family.name + ": the layout does not map onto itself in a quarter turn");
    turn.push_back(static_cast<int>(seen));
  }
  return turn;
}

std::uint64_t turned(std::uint64_t code, const std::vector<int>& turn) {
  const std::size_t n = turn.size();
  std::uint64_t result = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t bit = (code >> (n - 1 - i)) & 1;
    result |= bit << (n - 1 - static_cast<std::size_t>(turn[i]));
  }
  return result;
}

// Smallest distance of two codes in any rotation, and of one code to itself turned: either mistake gives a wrong pose.
int smallest_distance(const Family& family) {
  const std::vector<int> turn = quarter_turn(family);
  int smallest = 64;
  for (std::size_t i = 0; i < family.codes.size(); ++i) {
    std::uint64_t code = family.codes[i];
    for (int rotation = 0; rotation < 4; ++rotation) {
      for (std::size_t j = i; j < family.codes.size(); ++j) {
        if (j == i && rotation == 0) continue;
        const int distance = __builtin_popcountll(code ^ family.codes[j]);
        if (distance < smallest) smallest = distance;
      }
      code = turned(code, turn);
    }
  }
  return smallest;
}

Family from_apriltag(const apriltag_family_t* source) {
  Family family;
  family.name = source->name;
  family.border_width = source->width_at_border;
  family.total_width = source->total_width;
  family.reversed_border = source->reversed_border;
  family.min_hamming = static_cast<int>(source->h);
  for (std::uint32_t i = 0; i < source->nbits; ++i) {
    // libapriltag keeps signed positions (data outside the border) in unsigned fields.
    family.bit_x.push_back(static_cast<int>(source->bit_x[i]));
    family.bit_y.push_back(static_cast<int>(source->bit_y[i]));
  }
  family.codes.assign(source->codes, source->codes + source->ncodes);
  return family;
}

Family from_aruco(const std::string& name, int dictionary_name) {
  const berth::aruco::Dictionary dictionary = berth::aruco::getPredefinedDictionary(dictionary_name);
  const int side = dictionary.markerSize;
  Family family;
  family.name = name;
  family.border_width = side + 2;
  family.total_width = side + 4;  // with a quiet zone of one module, as AprilTag counts it
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      family.bit_x.push_back(x + 1);
      family.bit_y.push_back(y + 1);
    }
  }
  for (int id = 0; id < dictionary.bytesList.rows; ++id) {
    const cv::Mat bits = berth::aruco::Dictionary::getBitsFromByteList(dictionary.bytesList.rowRange(id, id + 1), side);
    std::uint64_t code = 0;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) code = code << 1 | (bits.at<unsigned char>(y, x) != 0 ? 1 : 0);
    }
    family.codes.push_back(code);
  }
  family.min_hamming = smallest_distance(family);
  return family;
}

void write_ints(std::ostream& out, const std::string& type, const std::string& name, const std::vector<int>& values) {
  out << "const " << type << " " << name << "[] = {";
  for (std::size_t i = 0; i < values.size(); ++i) out << (i == 0 ? "" : ", ") << values[i];
  out << "};\n";
}

void write_codes(std::ostream& out, const Family& family) {
  out << "const u64 " << family.name << "_codes[] = {";
  char text[32];
  for (std::size_t i = 0; i < family.codes.size(); ++i) {
    std::snprintf(text, sizeof text, "0x%llxu,", static_cast<unsigned long long>(family.codes[i]));
    out << (i % 6 == 0 ? "\n  " : " ") << text;
  }
  out << "\n};\n";
}

void write(std::ostream& out, const std::vector<Family>& families) {
  out << "// Generated by generate_families from libapriltag and OpenCV; do not edit.\n";
  for (const Family& family : families) {
    if (family.bit_x.size() > 64) fail(family.name + ": more than 64 bits");
    write_ints(out, "signed char", family.name + "_x", family.bit_x);
    write_ints(out, "signed char", family.name + "_y", family.bit_y);
    write_ints(out, "signed char", family.name + "_turn", quarter_turn(family));
    write_codes(out, family);
  }
  out << "const FamilyTable kFamilyTables[] = {\n";
  for (const Family& family : families) {
    out << "  {\"" << family.name << "\", " << family.border_width << ", " << family.total_width << ", "
        << (family.reversed_border ? "true" : "false") << ", " << family.min_hamming << ", " << family.bit_x.size()
        << ", " << family.codes.size() << ", " << family.name << "_x, " << family.name << "_y, " << family.name
        << "_turn, " << family.name << "_codes},\n";
  }
  out << "};\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) fail("usage: generate_families OUTPUT");
  std::vector<Family> families;
  for (const LibraryFamily& source : kLibraryFamilies) {
    apriltag_family_t* const made = source.create();
    families.push_back(from_apriltag(made));
    source.destroy(made);
  }
  int dictionary = cv::aruco::DICT_4X4_50;
  for (int side = 4; side <= 7; ++side) {
    for (const int count : {50, 100, 250, 1000}) {
      const std::string square = std::to_string(side) + "x" + std::to_string(side);
      families.push_back(from_aruco("aruco" + square + "_" + std::to_string(count), dictionary++));
    }
  }
  families.push_back(from_aruco("aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL));

  std::ofstream out(argv[1], std::ios::binary);
  write(out, families);
  out.close();
  if (!out) fail(std::string("cannot write ") + argv[1]);
  return 0;
}
