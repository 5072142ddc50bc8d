"""ONNX graphs of torch modules, node by node, for tests: no exporter's packages, no exporter's choices."""
import numpy as np
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import nn


class Export:
    """An ONNX graph from torch modules, one node after the other."""

    def __init__(self, shape=("n", 1, 256, 256), kind=TensorProto.FLOAT):
        self.input = helper.make_tensor_value_info("image", kind, shape)
        self.nodes, self.constants, self.outputs = [], [], []

    def constant(self, value):
        name = f"w{len(self.constants)}"
        value = value.detach().numpy() if isinstance(value, torch.Tensor) else np.asarray(value)
        self.constants.append(numpy_helper.from_array(value, name))
        return name

    def node(self, op, inputs, **attributes):
        name = f"{op.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(op, inputs, [name + "_out"], name, **attributes))
        return name + "_out"

    def module(self, m, x):
        if isinstance(m, nn.Conv2d):
            return self.node("Conv", [x, self.constant(m.weight), self.constant(m.bias)], kernel_shape=list(m.kernel_size),
                             strides=list(m.stride), pads=[*m.padding, *m.padding], group=m.groups)
        if isinstance(m, (nn.BatchNorm2d, nn.BatchNorm1d)):
            return self.node("BatchNormalization",
                             [x, *map(self.constant, (m.weight, m.bias, m.running_mean, m.running_var))],
                             epsilon=m.eps)
        if isinstance(m, nn.LocalResponseNorm):
            return self.node("LRN", [x], size=m.size, alpha=m.alpha, beta=m.beta, bias=float(m.k))
        if isinstance(m, nn.MaxPool2d):
            return self.node("MaxPool", [x], kernel_shape=[m.kernel_size] * 2, strides=[m.stride] * 2)
        if isinstance(m, nn.Linear):
            return self.node("Gemm", [x, self.constant(m.weight), self.constant(m.bias)], transB=1)
        if isinstance(m, nn.Softmax):
            return self.node("Softmax", [x], axis=1)
        return self.node({nn.ReLU: "Relu", nn.Flatten: "Flatten", nn.Sigmoid: "Sigmoid", nn.Dropout: "Dropout",
                          nn.Identity: "Identity"}[type(m)], [x])

    def sequence(self, modules, x="image"):
        for module in modules:
            x = self.module(module, x)
        return x

    def output(self, x, kind=TensorProto.FLOAT, rank=2):
        self.outputs.append(helper.make_tensor_value_info(x, kind, [f"{x}_{i}" for i in range(rank)]))
        return self

    def proto(self, opset=17):
        graph = helper.make_graph(self.nodes, "net", [self.input], self.outputs, self.constants)
        return helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)], ir_version=8)


def lively(modules):
    """Weights as before training, batch norms that do something."""
    torch.manual_seed(5)
    for m in modules:
        if isinstance(m, (nn.Conv2d, nn.Linear)):
            nn.init.kaiming_normal_(m.weight, nonlinearity="relu")
            m.bias.data.uniform_(-0.2, 0.2)
        if isinstance(m, (nn.BatchNorm2d, nn.BatchNorm1d)):
            m.running_mean.uniform_(-0.2, 0.2)
            m.running_var.uniform_(1, 4)
            m.weight.data.uniform_(0.3, 2)
            m.bias.data.uniform_(-0.3, 0.3)
    return nn.Sequential(*modules).eval()


def trunk(first=None):
    """Every kind of layer; 10 and 18 channels are no multiples of four."""
    return [first or nn.Conv2d(1, 8, 8, 4), nn.BatchNorm2d(8), nn.ReLU(), nn.LocalResponseNorm(5, 0.02, 0.6, 1.5),
            nn.MaxPool2d(3, 2), nn.Identity(), nn.Conv2d(8, 16, 5, 3, 2, groups=2), nn.ReLU(), nn.MaxPool2d(2, 2),
            nn.Conv2d(16, 10, 3, 1, 1), nn.MaxPool2d(2, 2), nn.Dropout(0.5), nn.ReLU(),
            nn.LocalResponseNorm(5, 1e-4, 0.75, 1.0), nn.Flatten(), nn.Linear(40, 18), nn.BatchNorm1d(18), nn.ReLU(),
            nn.Dropout(0.4)]
