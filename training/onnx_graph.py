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
_KEPT = {"Constant", "Identity", "Transpose", "Reshape", "Cast", "Squeeze", "Unsqueeze"}  # evaluated; none makes much of little
# What follows the first input is weights, shapes and the like.
_FIRST_ONLY = {"Conv", "Gemm", "BatchNormalization", "Reshape", "Squeeze", "Unsqueeze", "Dropout", "Clip", "Pad"}


class Unsupported(ValueError):
    """What Berth cannot do: where, what, and what to do about it."""


def label(node):
    """Op and name of a node, of one without a name what it computes."""
    return f"{node.op_type} '{node.name}'" if node.name else f"{node.op_type} that computes '{node.output[0]}'"


def refuse(node, what, remedy):
    raise Unsupported(f"{label(node)}: {what}; {remedy}")


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
            raise Unsupported(f"{path}: opset {self.opset}; at least {OLDEST_OPSET} is needed, export it again with a newer one")
        self.constants = {}
        for tensor in graph.initializer:
            try:
                self.constants[tensor.name] = numpy_helper.to_array(tensor)
            except (ValueError, TypeError) as error:
                raise Unsupported(f"{path}: tensor '{tensor.name}': {error}; fetch or export it again") from None
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

    def _fix_input(self, path):
        """Name of the image; sides that were left open become one window's."""
        inputs = [info for info in self.model.graph.input if info.name not in self.constants]
        if len(inputs) != 1:
            raise Unsupported(f"{path}: {len(inputs)} inputs ({', '.join(info.name for info in inputs)}); Berth gives one, the "
                              "image: export it with that alone")
        name, kind = inputs[0].name, inputs[0].type.tensor_type
        if kind.elem_type != onnx.TensorProto.FLOAT:
            raise Unsupported(f"{path}: input '{name}' is {helper.tensor_dtype_to_string(kind.elem_type)}; export the network "
                              "with float32")
        dims = kind.shape.dim
        for dim, value in zip(dims, (1, 1, SIDE, SIDE)):
            if dim.dim_value < 1:
                dim.dim_value = value
        sides = [dim.dim_value for dim in dims] or [0]
        if sides[1:] != [1, SIDE, SIDE]:
            raise Unsupported(f"{path}: input '{name}' is {' x '.join(map(str, sides))}; Berth's windows are n x 1 x {SIDE} x "
                              f"{SIDE}, one grey channel: train it for these")
        self.batch = sides[0]
        return name

    def _evaluate_constants(self):
        """Nodes of _KEPT whose inputs are constants become constants."""
        opsets = self.model.opset_import
        for node in self.model.graph.node:
            if node.op_type in _KEPT and all(name in self.constants for name in node.input if name):
                alone = helper.make_graph([node], "constant", [helper.make_empty_tensor_value_info(n) for n in node.input if n],
                                          [helper.make_empty_tensor_value_info(node.output[0])])
                given = {name: self.constants[name] for name in node.input if name}
                try:
                    values = ReferenceEvaluator(helper.make_model(alone, opset_imports=opsets)).run(None, given)
                except Exception as error:  # whatever numpy makes of a shape that does not fit
                    refuse(node, f"cannot be evaluated ({error})", "export the network again with constants folded")
                self.constants[node.output[0]] = np.asarray(values[0])

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
                       "Berth's networks are one line of layers: train it without branches")
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
        if importlib.util.find_spec("onnxruntime"):
            import onnxruntime
            options = onnxruntime.SessionOptions()
            options.intra_op_num_threads, options.log_severity_level = 1, 4
            session = onnxruntime.InferenceSession(model.SerializeToString(), options, ["CPUExecutionProvider"])
            return "ONNX Runtime", [value[:1] for value in session.run(list(tensors), given)]
        return "ONNX's reference", [value[:1] for value in ReferenceEvaluator(model).run(None, given)]
