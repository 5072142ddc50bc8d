"""An ONNX file as a graph to walk along: checked, its constants evaluated, its shapes inferred for one window."""
import importlib.util
import pathlib

import numpy as np
import onnx
import onnx.inliner
from google.protobuf.message import DecodeError
from onnx import helper, numpy_helper
from onnx.reference import ReferenceEvaluator

from model_file import SIDE

OLDEST_OPSET = 9
_KEPT = {"Constant", "Identity", "Transpose", "Reshape", "Cast", "Squeeze",
         "Unsqueeze"}  # evaluated; none makes much of little
# What follows the first input is weights, shapes and the like.
_FIRST_ONLY = {"Conv", "Gemm", "BatchNormalization", "Reshape", "Squeeze", "Unsqueeze", "Dropout", "Clip", "Pad"}
_KNOWN_AS = {"Div": "; PyTorch's LocalResponseNorm is known as torch.onnx.export writes it with dynamo=True"}


class Unsupported(ValueError):
    """What Berth cannot do: where, what, and what to do about it."""


def label(node):
    """Op and name of a node, of one without a name what it computes."""
    return f"{node.op_type} '{node.name}'" if node.name else f"{node.op_type} that computes '{node.output[0]}'"


def refuse(node, what, remedy):
    raise Unsupported(f"{label(node)}: {what}; {remedy}")


def _type_name(number):
    names = {value: name for name, value in onnx.TensorProto.DataType.items()}
    return names.get(number, f"of the unknown type {number}")


def _loaded(path):
    try:
        model = onnx.load(str(path))
        onnx.checker.check_model(model)
        return onnx.inliner.inline_local_functions(model) if model.functions else model
    except OSError as error:
        raise Unsupported(f"{path}: {error.strerror or error}; give a readable .onnx file") from None
    except (DecodeError, onnx.checker.ValidationError, ValueError, RuntimeError) as error:
        why = (str(error).strip() or "no protocol buffer").splitlines()[0]
        raise Unsupported(f"{path}: not a whole and valid ONNX model ({why}); fetch or export it again") from None


class Graph:
    """constants: arrays by tensor; shapes: tuples by tensor, where they are known; input: the tensor of the image."""

    def __init__(self, path):
        self.model = _loaded(path)
        graph = self.model.graph
        self.opset = max((entry.version for entry in self.model.opset_import if entry.domain in ("", "ai.onnx")), default=0)
        if self.opset < OLDEST_OPSET:
            raise Unsupported(f"{path}: opset {self.opset}; {OLDEST_OPSET} or newer is needed, export it again with one")
        texts = [text for node in graph.node for text in (node.name, node.op_type, node.domain, *node.input, *node.output)]
        if not all(isinstance(text, str) for text in texts):
            raise Unsupported(f"{path}: a node's name is no UTF-8; fetch or export it again")
        self.constants = {}
        for tensor in graph.initializer:
            try:
                self.constants[tensor.name] = numpy_helper.to_array(tensor)
            except (ValueError, TypeError, KeyError) as error:  # KeyError: of an unknown type
                raise Unsupported(f"{path}: tensor '{tensor.name}' has no values ({error}); fetch or export it "
                                  "again") from None
        self.input = self._fix_input(path)
        self._evaluate_constants()
        self.producer = {name: node for node in graph.node for name in node.output if name}
        del graph.value_info[:]
        try:
            inferred = onnx.shape_inference.infer_shapes(self.model, data_prop=True).graph
        except onnx.shape_inference.InferenceError as error:
            raise Unsupported(f"{path}: its shapes do not fit together ({error}); export it again") from None
        self.shapes = {info.name: tuple(dim.dim_value for dim in info.type.tensor_type.shape.dim)
                       for info in [*inferred.value_info, *inferred.output, *inferred.input]
                       if all(dim.HasField("dim_value") for dim in info.type.tensor_type.shape.dim)}
        self.producer.update({node.output[0]: self._response_norm(node) for node in graph.node if node.op_type == "Div"})

    def _fix_input(self, path):
        """Name of the image; sides that were left open become one window's."""
        inputs = [info for info in self.model.graph.input if info.name not in self.constants]
        if len(inputs) != 1:
            names = ", ".join(info.name for info in inputs)
            raise Unsupported(f"{path}: {len(inputs)} inputs ({names}); Berth gives one, the image: export it with that alone")
        name, kind = inputs[0].name, inputs[0].type.tensor_type
        if kind.elem_type != onnx.TensorProto.FLOAT:
            raise Unsupported(f"{path}: input '{name}' is {_type_name(kind.elem_type)}; export the network "
                              "with float32")
        dims = kind.shape.dim
        for dim, value in zip(dims, (1, 1, SIDE, SIDE)):
            if dim.dim_value < 1:
                dim.dim_value = value
        sides = [dim.dim_value for dim in dims] or [0]
        if sides[1:] != [1, SIDE, SIDE]:
            raise Unsupported(f"{path}: input '{name}' is {' x '.join(map(str, sides))}; Berth's windows are n x 1 x {SIDE} "
                              f"x {SIDE}, one grey channel: train it for these")
        self.batch = sides[0]
        return name

    def _evaluate_constants(self):
        """Nodes of _KEPT whose inputs are constants become constants."""
        opsets = self.model.opset_import
        for node in self.model.graph.node:
            if node.op_type in _KEPT and all(name in self.constants for name in node.input if name):
                alone = helper.make_graph([node], "constant",
                                          [helper.make_empty_tensor_value_info(n) for n in node.input if n],
                                          [helper.make_empty_tensor_value_info(node.output[0])])
                given = {name: self.constants[name] for name in node.input if name}
                try:
                    values = ReferenceEvaluator(helper.make_model(alone, opset_imports=opsets)).run(None, given)
                except Exception as error:  # whatever numpy makes of a shape that does not fit
                    refuse(node, f"cannot be evaluated ({error})", "export the network again with constants folded")
                self.constants[node.output[0]] = np.asarray(values[0])

    def _response_norm(self, division):
        """The LRN that PyTorch's nn.LocalResponseNorm is, written by torch.onnx.export as x / (k + alpha * mean of x^2)^beta,
        the mean by pooling over channels; another Div as it is."""
        nodes, tensor = [], division.input[1]
        for op in ("Pow", "Add", "Mul", "Squeeze", "AveragePool", "Pad", "Reshape", "Mul"):
            node = self.producer.get(tensor)
            if node is None or node.op_type != op:
                return division
            nodes.append(node)
            tensor = node.input[0]
        power, offset, factor, _, pool, pad, view, square = nodes
        beta, k, alpha, pads = (self.constants.get(node.input[1]) if len(node.input) > 1 else None
                                for node in (power, offset, factor, pad))
        attributes = {a.name: helper.get_attribute_value(a) for a in pool.attribute}
        size, shape = attributes.get("kernel_shape", [0])[0], self.shapes.get(division.output[0], ())
        wanted = {"kernel_shape": [size, 1, 1], "strides": [1, 1, 1], "count_include_pad": 1}
        before = [0, 0, size // 2, 0, 0]
        if (any(value is None or value.size != 1 for value in (alpha, beta, k)) or size % 2 == 0 or len(shape) != 4
                or pads is None or pads.tolist() != before * 2 or any(attributes.get(name) != v for name,
                                                                      v in wanted.items())
                or any(attributes.get("pads", [])) or self.shapes.get(view.output[0]) != (shape[0], 1, *shape[1:])
                or list(square.input) != [division.input[0]] * 2):
            return division
        return helper.make_node("LRN", [division.input[0]], [division.output[0]], division.name or division.output[0],
                                size=size,
                                alpha=float(alpha.item()), beta=float(beta.item()), bias=float(k.item()))

    def path_to(self, output):
        """The nodes between the image and `output`, in order."""
        nodes, tensor = [], output
        while tensor != self.input:
            node = self.producer.get(tensor)
            if node is None:
                raise Unsupported(f"output '{output}' does not depend on the image; leave it out of the export")
            nodes.append(node)
            inputs = node.input[:1] if node.op_type in _FIRST_ONLY else node.input
            data = [name for name in inputs if name and name not in self.constants]
            if len(data) != 1:
                refuse(node, f"joins {len(data)} tensors ({', '.join(data) or 'none depends on the image'})",
                       "Berth's networks are one line of layers: train it without branches" + _KNOWN_AS.get(node.op_type,
                                                                                                            ""))
            tensor = data[0]
        return nodes[::-1]

    def values(self, tensors, x):
        """What a runtime (ONNX Runtime, else ONNX's reference) computes for float[1, 1, 256, 256]: its name, and an array a
        tensor."""
        model = onnx.ModelProto()
        model.CopyFrom(self.model)
        del model.graph.output[:]
        model.graph.output.extend(helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, None) for name in tensors)
        given = {self.input: np.repeat(x, self.batch, 0)}
        runtime, run = ("ONNX Runtime", _run) if importlib.util.find_spec("onnxruntime") else ("ONNX's reference",
                                                                                               _run_reference)
        try:
            return runtime, [value[:1] for value in run(model, list(tensors), given)]
        except Exception as error:  # each runtime has its own kinds
            raise Unsupported(f"{runtime} cannot run the graph ({str(error).splitlines()[0]}); export it again") from None


def _run(model, tensors, given):
    import onnxruntime
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.log_severity_level = 1, 4
    return onnxruntime.InferenceSession(model.SerializeToString(), options, ["CPUExecutionProvider"]).run(tensors, given)


def _run_reference(model, tensors, given):
    return ReferenceEvaluator(model).run(tensors, given)
