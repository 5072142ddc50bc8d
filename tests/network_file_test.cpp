// Network files: what is read is what was written, and whatever is wrong with one is said, never read past.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>

#include "berth/error.hpp"
#include "crc32.hpp"
#include "navigation/network.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const char kTiny[] = BERTH_SOURCE_DIR "/training/tests/data/tiny.berthnet";

using Bytes = std::vector<unsigned char>;

Bytes tiny_bytes() {
  std::ifstream file(kTiny, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

Network parse(const Bytes& bytes) { return parse_network(bytes.data(), bytes.size(), "it.berthnet"); }

/// With a size and a CRC that fit what is there, so that a reader looks further.
Bytes sealed(Bytes bytes) {
  for (std::size_t i = 0; i < 4; ++i) bytes[12 + i] = static_cast<unsigned char>(bytes.size() >> (8 * i));
  const u32 sum = crc32(bytes.data(), bytes.size() - 4);
  for (std::size_t i = 0; i < 4; ++i) bytes[bytes.size() - 4 + i] = static_cast<unsigned char>(sum >> (8 * i));
  return bytes;
}

TEST(NetworkFile, IsReadAndWrittenToTheByte) {
  const Network network = read_network(kTiny);
  EXPECT_EQ(network.side, 256);
  EXPECT_TRUE(network.normalise);
  EXPECT_GT(network.layers.size(), 3u);
  EXPECT_GT(network.parameters(), 1000u);
  EXPECT_EQ(network_bytes(network), tiny_bytes());
}

TEST(NetworkFile, ThatIsNotThereIsNamed) {
  EXPECT_THAT([] { read_network("no/such.berthnet"); },
              ThrowsMessage<Error>(HasSubstr("no/such.berthnet: No such file")));
}

TEST(NetworkFile, OfAnotherKindIsRefused) {
  EXPECT_THAT([] { read_network(BERTH_SOURCE_DIR "/README.md"); }, ThrowsMessage<Error>(HasSubstr("not a network")));
  EXPECT_THAT([] { parse({}); }, ThrowsMessage<Error>(HasSubstr("not a network")));
}

TEST(NetworkFile, OfAnotherVersionIsRefused) {
  Bytes bytes = tiny_bytes();
  bytes[8] = 2;
  EXPECT_THAT([&] { parse(bytes); }, ThrowsMessage<Error>(HasSubstr("version 2; this Berth reads version 1")));
}

TEST(NetworkFile, CutOffAnywhereIsRefused) {
  const Bytes whole = tiny_bytes();
  for (std::size_t length = 0; length < whole.size(); length += 97) {
    const Bytes part(whole.begin(), whole.begin() + static_cast<long>(length));
    EXPECT_THROW(parse(part), Error) << length;
    if (length >= 20) {
      EXPECT_THROW(parse(sealed(part)), Error) << length << ", sealed again";
    }
  }
}

TEST(NetworkFile, WithAFlippedBitIsRefused) {
  Bytes bytes = tiny_bytes();
  bytes[bytes.size() / 2] ^= 4;
  EXPECT_THAT([&] { parse(bytes); }, ThrowsMessage<Error>(HasSubstr("wrong CRC")));
}

TEST(NetworkFile, WithBytesAfterTheEndIsRefused) {
  Bytes bytes = tiny_bytes();
  bytes.insert(bytes.end() - 4, 3, 0);
  EXPECT_THAT([&] { parse(sealed(bytes)); }, ThrowsMessage<Error>(HasSubstr("3 bytes follow the last field")));
}

/// Of a network changed by `change`, written and read.
template <class Change>
std::string refusal(Change change) {
  Network network = read_network(kTiny);
  change(network);
  try {
    parse(network_bytes(network));
  } catch (const Error& error) {
    return error.what();
  }
  return "read";
}

TEST(NetworkFile, WhoseLayersDoNotFitNamesTheLayer) {
  EXPECT_THAT(
      refusal([](Network& n) { n.heads.in_channels -= 4, n.heads.weights.resize(n.heads.weights.size() - 20); }),
      HasSubstr("it.berthnet: the heads: in_channels is"));
  EXPECT_THAT(refusal([](Network& n) { std::get<ConvolveLayer>(n.layers[0]).shift = 31; }),
              HasSubstr("layer 1: shift is 31, not within 0 to 30"));
  EXPECT_THAT(refusal([](Network& n) { std::get<ConvolveLayer>(n.layers[0]).multipliers[0] = 32768; }),
              HasSubstr("layer 1 (convolve): a multiplier of 32768"));
  EXPECT_THAT(refusal([](Network& n) { std::get<ConvolveLayer>(n.layers[0]).bias[1] = 2147483647; }),
              HasSubstr("layer 1 (convolve): the sum of channel 1 may leave 32 bits"));
  EXPECT_THAT(refusal([](Network& n) { std::get<ConvolveLayer>(n.layers[0]).weights[0] = -128; }),
              HasSubstr("layer 1 (convolve): a weight of -128"));
  EXPECT_THAT(refusal([](Network& n) {
                n.layers.insert(n.layers.begin(), MaxPoolLayer{3, 2});
              }),
              HasSubstr("layer 1 (max_pool): comes before any convolution"));
  EXPECT_THAT(refusal([](Network& n) { n.side = 258; }), HasSubstr("258 px, not a multiple of 4"));
  EXPECT_THAT(refusal([](Network& n) { n.x.shift = 0; }), HasSubstr("an output's shift is 0"));
}

TEST(NetworkFile, OfAnUnknownLayerIsRefused) {
  Bytes bytes = tiny_bytes();
  const Network network = read_network(kTiny);
  const std::size_t first_kind = 16 + 4 + network.name.size() + 4 + network.notes.size() + 12 + 4;
  ASSERT_EQ(bytes[first_kind], 1);
  bytes[first_kind] = 77;
  EXPECT_THAT([&] { parse(sealed(bytes)); }, ThrowsMessage<Error>(HasSubstr("layer 1: kind 77 is unknown")));
}

/// Reads it; what is read must be a network that can be laid out, and be the same when written and read again.
bool is_read(const Bytes& bytes) {
  Network network;
  try {
    network = parse(bytes);
  } catch (const Error&) {
    return false;
  }
  EXPECT_EQ(network.shapes(network.side, network.side).size(), network.layers.size() + 1);
  EXPECT_EQ(network_bytes(network), bytes);
  return true;
}

// Every field in turn at values that break sums and products: the CRC fits, so the reader goes as deep as it can.
TEST(NetworkFile, WithAnyFieldAtItsExtremesIsReadOrRefused) {
  const Bytes whole = tiny_bytes();
  const u32 extremes[] = {0, 1, 65, 16384, 0x7fffffffu, 0x80000000u, 0xffffffffu};
  int read = 0;
  int refused = 0;
  // Where the first layers' shapes are, every byte is a beginning; among weights and tables some are.
  for (std::size_t at = 16; at + 8 <= whole.size(); at += at < 400 ? 1 : 211) {
    for (const u32 value : extremes) {
      Bytes bytes = whole;
      for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<unsigned char>(value >> (8 * i));
      ++(is_read(sealed(bytes)) ? read : refused);
    }
  }
  EXPECT_GT(read, 200) << "weights, tables and texts";
  EXPECT_GT(refused, 700) << "shapes";
}

// Parts of the file twice, left out or in another's place: layers of the wrong kind or size follow each other.
TEST(NetworkFile, WithPartsElsewhereIsReadOrRefused) {
  const Bytes whole = tiny_bytes();
  std::mt19937 random(11);
  for (int i = 0; i < 600; ++i) {
    Bytes bytes = whole;
    const auto place = [&] { return static_cast<long>(16 + random() % (bytes.size() - 20)); };
    const long from = place();
    const long length =
        std::min<long>(static_cast<long>(1 + random() % 600), static_cast<long>(bytes.size()) - 4 - from);
    const Bytes part(bytes.begin() + from, bytes.begin() + from + length);
    if (i % 3 == 0) {
      bytes.erase(bytes.begin() + from, bytes.begin() + from + length);
    } else if (i % 3 == 1) {
      bytes.insert(bytes.begin() + place(), part.begin(), part.end());
    } else {
      const long to = std::min(place(), static_cast<long>(bytes.size()) - 4 - length);
      std::copy(part.begin(), part.end(), bytes.begin() + to);
    }
    is_read(sealed(bytes));
  }
}

// Any bytes, with a CRC that fits: a network that passes every check or an error; never a crash, never an endless read.
TEST(NetworkFile, WithRandomDamageIsReadOrRefused) {
  const Bytes whole = tiny_bytes();
  std::mt19937 random(7);
  int refused = 0;
  for (int i = 0; i < 4000; ++i) {
    Bytes bytes = whole;
    const std::size_t near = i % 2 == 0 ? std::size_t{200} : bytes.size();  // where the shapes are, or anywhere
    for (unsigned k = random() % 4; k < 4; ++k) bytes[random() % near] = static_cast<unsigned char>(random());
    if (random() % 8 == 0) bytes.resize(20 + random() % (bytes.size() - 20));
    if (!is_read(sealed(bytes))) ++refused;
  }
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace berth
