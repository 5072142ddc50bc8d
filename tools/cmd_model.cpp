// berth model: what is in a network's file.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "commands.hpp"
#include "frame_json.hpp"
#include "navigation/network.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth model show lite.berthnet
  berth model show lite.berthnet --json | jq .layers

A network from elsewhere (ONNX) is brought in by a script of Berth's sources, which needs Python with PyTorch and onnx:
  training/import_onnx.py NET.onnx --calibrate PICTURES --mean 0 --scale 1/255 -o net.berthnet
training/README.md says which layers it takes.)";

/// What each kind of layer has of its own; what it has not gets no field.
struct LayerFields {
  Json& row;
  void operator()(const ConvolveLayer& layer) const {
    row["kernel"] = {layer.kernel_height, layer.kernel_width};
    row["stride"] = {layer.stride_y, layer.stride_x};
    row["pad"] = {layer.pad_y, layer.pad_x};
    row["groups"] = layer.groups;
    weighted(layer.weights.size(), layer.bias.size(), layer.shift);
  }
  void operator()(const LocalResponseNormLayer&) const {}
  void operator()(const MaxPoolLayer& layer) const {
    row["kernel"] = {layer.kernel, layer.kernel};
    row["stride"] = {layer.stride, layer.stride};
  }
  void operator()(const FullyConnectedLayer& layer) const {
    row["kernel"] = {layer.rows, layer.columns};
    weighted(layer.weights.size(), layer.bias.size(), layer.shift);
  }
  /// Every weight is used once at each position.
  void weighted(std::size_t weights, std::size_t biases, int shift) const {
    const Json& output = row["output"];
    row["parameters"] = weights + biases;
    row["macs"] = weights * output[0].get<std::size_t>() * output[1].get<std::size_t>();
    row["shift"] = shift;
  }
};

Json to_json(const Shape& shape) { return {shape.height, shape.width, shape.channels}; }

Json describe(const Network& network, const std::string& path) {
  const std::vector<Shape> shapes = network.shapes(network.side, network.side);
  Json layers = Json::array();
  for (std::size_t i = 0; i < network.layers.size(); ++i) {
    Json row = {{"kind", name_of(network.layers[i])}, {"output", to_json(shapes[i + 1])}};
    std::visit(LayerFields{row}, network.layers[i]);
    layers.push_back(row);
  }
  const Heads& heads = network.heads;
  const std::size_t biases = heads.bias.size();
  layers.push_back({{"kind", "heads"},
                    {"output", to_json(Shape{1, 1, static_cast<int>(biases)})},
                    {"parameters", heads.weights.size() + biases},
                    {"macs", heads.weights.size()}});
  std::size_t macs = 0;
  for (const Json& layer : layers) macs += layer.value("macs", std::size_t{0});

  const auto scale = [](const FixedScale& s) { return Json{{"multiplier", s.multiplier}, {"shift", s.shift}}; };
  Json scales = {{"score", scale(network.score)}};
  if (heads.geometry > 0) {
    scales["x"] = scale(network.x);
    scales["y"] = scale(network.y);
    scales["d"] = scale(network.d);
  }
  return {{"file", path},
          {"name", network.name},
          {"notes", network.notes},
          {"side", network.side},
          {"normalise", network.normalise},
          {"mean", network.mean},
          {"input", to_json(shapes[0])},
          {"layers", layers},
          {"parameters", network.parameters()},
          {"macs", macs},
          {"scales", scales}};
}

/// A file's text must not steer the terminal.
std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return (c < 0x20 && c != '\n') || c == 0x7f; }, '?');
  return text;
}

/// A field of a layer: numbers of an array with x between them, nothing where the layer has none.
std::string cell(const Json& row, const char* field) {
  if (!row.contains(field)) return "";
  const Json& value = row[field];
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const Json& part : value) text += (text.empty() ? "" : "x") + part.dump();
  return text;
}

void print(const Json& network, std::ostream& out) {
  out << fmt::format("name       {}\n", printable(network["name"].get<std::string>()));
  const std::string notes = printable(network["notes"].get<std::string>());
  if (!notes.empty()) out << fmt::format("notes      {}\n", notes);
  out << fmt::format("input      {0} x {0} px, {1}\n", network["side"].get<int>(),
                     network["normalise"].get<bool>()
                         ? "the contrast of each window normalised"
                         : fmt::format("minus a mean of {} grey levels", network["mean"].get<int>()));
  out << "\n| | layer | kernel | stride | pad | groups | output | parameters | multiply-accumulates | shift |\n"
         "|---|---|---|---|---|---|---|---|---|---|\n";
  out << fmt::format("| | input, four pixels a word | | | | | {} | | | |\n", cell(network, "input"));
  int number = 0;
  for (const Json& row : network["layers"]) {
    out << fmt::format("| {} | {} |", ++number, cell(row, "kind"));
    for (const char* field : {"kernel", "stride", "pad", "groups", "output", "parameters", "macs", "shift"}) {
      const std::string text = cell(row, field);
      out << (text.empty() ? " |" : " " + text + " |");
    }
    out << '\n';
  }
  out << fmt::format("| | all | | | | | | {} | {} | |\n", cell(network, "parameters"), cell(network, "macs"));
  out << "\n| head | multiplier | shift |\n|---|---|---|\n";
  for (const auto& [name, scale] : network["scales"].items()) {
    out << fmt::format("| {} | {} | {} |\n", name, cell(scale, "multiplier"), cell(scale, "shift"));
  }
}

}  // namespace

void add_model(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* model = app.add_subcommand("model", "Look into the file of a navigation network");
  model->require_subcommand(1);
  CLI::App* show = model->add_subcommand("show", "Layers with their sizes and costs, input, notes and scales");
  struct Options {
    std::string network;
    bool json = false;
  };
  const auto options = std::make_shared<Options>();
  show->add_option("network", options->network, "the network's file (.berthnet)")->required()->type_name("FILE");
  show->add_flag("--json", options->json, "as one JSON object");
  for (CLI::App* command : {model, show}) command->footer(kExamples);
  show->callback([options, &console, &exit_code] {
    const Json description = describe(read_network(options->network), options->network);
    if (options->json) {
      console.out() << description.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
    } else {
      print(description, console.out());
    }
    exit_code = kOk;
  });
}

}  // namespace berth::cli
