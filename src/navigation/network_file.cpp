#include <cstdio>
#include <cstring>
#include <memory>

#include "berth/error.hpp"
#include "crc32.hpp"
#include "little_endian.hpp"
#include "navigation/network.hpp"
#include "navigation/network_check.hpp"

namespace berth {
namespace {

constexpr char kMagic[] = {'B', 'E', 'R', 'T', 'H', 'N', 'E', 'T'};
constexpr u32 kVersion = 1;
constexpr std::size_t kHeaderBytes = sizeof kMagic + 8;
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;
constexpr s32 kMaxLayers = 64;
constexpr s32 kMaxText = 1 << 20;

enum class Kind : u32 { convolve = 1, local_response_norm, max_pool, fully_connected, heads };

/// Takes fields off the body, never past its end.
class Reader {
 public:
  Reader(const unsigned char* at, const unsigned char* end, std::string file)
      : at_(at), end_(end), file_(std::move(file)) {}

  /// What is being read, for errors.
  std::string where;

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(file_ + (where.empty() ? "" : ": " + where) + ": " + what + "; export the network again");
  }
  u32 word() { return read_le32(take(4)); }
  s32 number() {
    const u32 value = word();
    s32 result = 0;
    std::memcpy(&result, &value, sizeof result);
    return result;
  }
  /// A number within bounds.
  int within(const char* what, int low, int high) {
    const s32 value = number();
    if (value < low || value > high) {
      fail(std::string(what) + " is " + std::to_string(value) + ", not within " + std::to_string(low) + " to " +
           std::to_string(high));
    }
    return value;
  }
  std::string text(const char* what) {
    const int length = within(what, 0, kMaxText);
    const unsigned char* from = take(static_cast<std::size_t>(length));
    return {from, from + length};
  }
  std::vector<signed char> weights(std::size_t count) {
    const unsigned char* from = take(count);
    std::vector<signed char> values(count);
    if (count > 0) std::memcpy(values.data(), from, count);
    return values;
  }
  std::vector<s32> numbers(int count) {
    left_for(static_cast<std::size_t>(count) * 4);
    std::vector<s32> values(static_cast<std::size_t>(count));
    for (s32& value : values) value = number();
    return values;
  }
  void left_for(std::size_t bytes) const {
    if (bytes > static_cast<std::size_t>(end_ - at_)) {
      fail("needs " + std::to_string(bytes) + " bytes, the file has " + std::to_string(end_ - at_) + " left");
    }
  }
  std::size_t left() const { return static_cast<std::size_t>(end_ - at_); }

 private:
  const unsigned char* take(std::size_t count) {
    left_for(count);
    const unsigned char* from = at_;
    at_ += count;
    return from;
  }

  const unsigned char* at_;
  const unsigned char* end_;
  std::string file_;
};

std::size_t product(std::initializer_list<int> factors) {
  std::size_t result = 1;
  for (const int factor : factors) result *= static_cast<std::size_t>(factor);
  return result;
}

ConvolveLayer read_convolve(Reader& in) {
  ConvolveLayer layer;
  layer.in_channels = in.within("in_channels", 1, kMaxChannels);
  layer.out_channels = in.within("out_channels", 1, kMaxChannels);
  layer.kernel_height = in.within("kernel_height", 1, kMaxKernel);
  layer.kernel_width = in.within("kernel_width", 1, kMaxKernel);
  layer.stride_y = in.within("stride_y", 1, kMaxKernel);
  layer.stride_x = in.within("stride_x", 1, kMaxKernel);
  layer.pad_y = in.within("pad_y", 0, kMaxKernel);
  layer.pad_x = in.within("pad_x", 0, kMaxKernel);
  layer.groups = in.within("groups", 1, kMaxChannels);
  layer.shift = in.within("shift", 0, 30);
  if (layer.in_channels % layer.groups != 0 || layer.out_channels % layer.groups != 0) {
    in.fail(std::to_string(layer.groups) + " groups do not divide " + std::to_string(layer.in_channels) + " and " +
            std::to_string(layer.out_channels) + " channels");
  }
  layer.weights = in.weights(
      product({layer.out_channels, layer.in_channels / layer.groups, layer.kernel_height, layer.kernel_width}));
  layer.bias = in.numbers(layer.out_channels);
  layer.multipliers = in.numbers(layer.out_channels);
  return layer;
}

LocalResponseNormLayer read_local_response_norm(Reader& in) {
  LocalResponseNormLayer layer;
  for (s32& value : layer.table) value = in.within("a value of the table", 0, 65535);
  return layer;
}

MaxPoolLayer read_max_pool(Reader& in) {
  MaxPoolLayer layer;
  layer.kernel = in.within("kernel", 1, kMaxKernel);
  layer.stride = in.within("stride", 1, kMaxKernel);
  return layer;
}

FullyConnectedLayer read_fully_connected(Reader& in) {
  FullyConnectedLayer layer;
  layer.in_channels = in.within("in_channels", 1, kMaxChannels);
  layer.rows = in.within("rows", 1, kMaxKernel);
  layer.columns = in.within("columns", 1, kMaxKernel);
  layer.out_channels = in.within("out_channels", 1, kMaxChannels);
  layer.shift = in.within("shift", 0, 30);
  layer.weights = in.weights(product({layer.out_channels, layer.rows, layer.columns, layer.in_channels}));
  layer.bias = in.numbers(layer.out_channels);
  layer.multipliers = in.numbers(layer.out_channels);
  return layer;
}

Heads read_heads(Reader& in) {
  Heads heads;
  heads.in_channels = in.within("in_channels", 1, kMaxChannels);
  heads.scores = in.within("score_outputs", 2, 2);
  heads.geometry = in.within("geometry_outputs", 0, 3);
  if (heads.geometry != 0 && heads.geometry != 3) in.fail("geometry_outputs is neither 0 nor 3");
  heads.weights = in.weights(product({heads.scores + heads.geometry, heads.in_channels}));
  heads.bias = in.numbers(heads.scores + heads.geometry);
  return heads;
}

void read_layers(Reader& in, Network& network) {
  const int count = in.within("the number of layers", 1, kMaxLayers);
  for (int i = 0; i < count; ++i) {
    in.where = "layer " + std::to_string(i + 1);
    const u32 kind = in.word();
    const bool last = i == count - 1;
    if (last != (kind == static_cast<u32>(Kind::heads))) in.fail("the heads are not the last layer, once");
    switch (static_cast<Kind>(kind)) {
      case Kind::convolve:
        network.layers.emplace_back(read_convolve(in));
        break;
      case Kind::local_response_norm:
        network.layers.emplace_back(read_local_response_norm(in));
        break;
      case Kind::max_pool:
        network.layers.emplace_back(read_max_pool(in));
        break;
      case Kind::fully_connected:
        network.layers.emplace_back(read_fully_connected(in));
        break;
      case Kind::heads:
        network.heads = read_heads(in);
        break;
      default:
        in.fail("kind " + std::to_string(kind) + " is unknown");
    }
  }
  in.where.clear();
}

/// Puts fields behind each other.
class Writer {
 public:
  void word(u32 value) { append_le32(bytes, value); }
  void number(s32 value) { word(static_cast<u32>(value)); }
  void numbers(std::initializer_list<s32> values) {
    for (const s32 value : values) number(value);
  }
  void numbers(const std::vector<s32>& values) {
    for (const s32 value : values) number(value);
  }
  void text(const std::string& value) {
    number(static_cast<s32>(value.size()));
    bytes.insert(bytes.end(), value.begin(), value.end());
  }
  void weights(const std::vector<signed char>& values) {
    for (const signed char value : values) bytes.push_back(static_cast<unsigned char>(value));
  }
  void kind(Kind value) { word(static_cast<u32>(value)); }

  void operator()(const ConvolveLayer& layer) {
    kind(Kind::convolve);
    numbers({layer.in_channels, layer.out_channels, layer.kernel_height, layer.kernel_width, layer.stride_y,
             layer.stride_x, layer.pad_y, layer.pad_x, layer.groups, layer.shift});
    weights(layer.weights);
    numbers(layer.bias);
    numbers(layer.multipliers);
  }
  void operator()(const LocalResponseNormLayer& layer) {
    kind(Kind::local_response_norm);
    for (const s32 value : layer.table) number(value);
  }
  void operator()(const MaxPoolLayer& layer) {
    kind(Kind::max_pool);
    numbers({layer.kernel, layer.stride});
  }
  void operator()(const FullyConnectedLayer& layer) {
    kind(Kind::fully_connected);
    numbers({layer.in_channels, layer.rows, layer.columns, layer.out_channels, layer.shift});
    weights(layer.weights);
    numbers(layer.bias);
    numbers(layer.multipliers);
  }

  std::vector<unsigned char> bytes;
};

void check_frame(const unsigned char* bytes, std::size_t count, const std::string& name) {
  if (count < kHeaderBytes + 4 || std::memcmp(bytes, kMagic, sizeof kMagic) != 0) {
    throw Error(name + ": not a network (.berthnet) file");
  }
  const u32 version = read_le32(bytes + sizeof kMagic);
  if (version != kVersion) {
    throw Error(name + ": version " + std::to_string(version) + "; this Berth reads version " +
                std::to_string(kVersion) + ": export the network again");
  }
  const u32 said = read_le32(bytes + sizeof kMagic + 4);
  if (said != count) {
    throw Error(name + ": has " + std::to_string(count) + " bytes, not the " + std::to_string(said) +
                " it says: copy it again");
  }
  if (read_le32(bytes + count - 4) != crc32(bytes, count - 4))
    throw Error(name + ": damaged (wrong CRC): copy it again");
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

Network parse_network(const unsigned char* bytes, std::size_t count, const std::string& name) {
  check_frame(bytes, count, name);
  Reader in(bytes + kHeaderBytes, bytes + count - 4, name);
  Network network;
  network.name = in.text("the name's length");
  network.notes = in.text("the notes' length");
  network.side = in.within("the input's side", 16, 1024);
  network.normalise = in.within("normalise", 0, 1) == 1;
  network.mean = in.within("the mean", 0, 255);
  read_layers(in, network);
  for (FixedScale* scale : {&network.score, &network.x, &network.y, &network.d}) {
    scale->multiplier = in.within("an output's multiplier", 0, 2147483647);
    scale->shift = in.within("an output's shift", 1, 62);
  }
  in.left_for(network.logistic.size() * 2);
  for (std::size_t i = 0; i < network.logistic.size(); i += 2) {
    const u32 pair = in.word();
    network.logistic[i] = static_cast<unsigned short>(pair & 0xffffu);
    network.logistic[i + 1] = static_cast<unsigned short>(pair >> 16);
  }
  if (in.left() != 0) in.fail(std::to_string(in.left()) + " bytes follow the last field");
  check_network(network, name);
  return network;
}

Network read_network(const std::string& path) {
  const std::unique_ptr<std::FILE, CloseFile> file(std::fopen(path.c_str(), "rb"));
  if (file == nullptr) throw Error(path + ": " + std::strerror(errno));
  std::vector<unsigned char> bytes;
  unsigned char block[65536];
  while (const std::size_t got = std::fread(block, 1, sizeof block, file.get())) {
    bytes.insert(bytes.end(), block, block + got);
    if (bytes.size() > kMaxBytes) throw Error(path + ": above 1 GiB: not a network (.berthnet) file");
  }
  if (std::ferror(file.get()) != 0) throw Error(path + ": " + std::strerror(errno));
  return parse_network(bytes.data(), bytes.size(), path);
}

std::vector<unsigned char> network_bytes(const Network& network) {
  Writer out;
  out.bytes.assign(kMagic, kMagic + sizeof kMagic);
  out.word(kVersion);
  out.word(0);
  out.text(network.name);
  out.text(network.notes);
  out.numbers({network.side, network.normalise ? 1 : 0, network.mean, static_cast<s32>(network.layers.size() + 1)});
  for (const Layer& layer : network.layers) std::visit(out, layer);
  out.kind(Kind::heads);
  out.numbers({network.heads.in_channels, network.heads.scores, network.heads.geometry});
  out.weights(network.heads.weights);
  out.numbers(network.heads.bias);
  for (const FixedScale& scale : {network.score, network.x, network.y, network.d}) {
    out.numbers({scale.multiplier, scale.shift});
  }
  for (std::size_t i = 0; i < network.logistic.size(); i += 2) {
    out.word(network.logistic[i] | static_cast<u32>(network.logistic[i + 1]) << 16);
  }
  const u32 size = static_cast<u32>(out.bytes.size() + 4);
  for (std::size_t i = 0; i < 4; ++i) out.bytes[sizeof kMagic + 4 + i] = static_cast<unsigned char>(size >> (8 * i));
  out.word(crc32(out.bytes.data(), out.bytes.size()));
  return out.bytes;
}

}  // namespace berth
