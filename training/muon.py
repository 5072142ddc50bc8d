"""The optimizer of training: Muon for the matrices inside the network, AdamW for the rest.

Muon (Jordan et al., 2024, https://kellerjordan.github.io/posts/muon/) takes the momentum of a weight matrix and sets all
its singular values to about 1 before it goes that way, so that rare directions are learnt as fast as common ones. A
convolution's weights count as a matrix of one row an output channel. On this task it needs about half of AdamW's
iterations for the same loss, for a twentieth more time (README.md)."""
import math

import torch

MOMENTUM = 0.95
STEPS = 5
LARGEST = 1024  # a matrix whose shorter side is longer is left to AdamW: the fifth power of iteration costs too much
ADAMW_SHARE = 0.1  # AdamW's learning rate, of Muon's


def orthogonalised(matrix):
    """The nearest matrix with singular values of one, roughly (0.7 to 1.2): five steps of a Newton-Schulz iteration
    with Jordan's coefficients."""
    wide = matrix if matrix.shape[0] <= matrix.shape[1] else matrix.T
    x = wide / (wide.norm() + 1e-7)
    for _ in range(STEPS):
        square = x @ x.T
        x = 3.4445 * x + (-4.7750 * square + 2.0315 * square @ square) @ x
    return x if wide is matrix else x.T


class Muon(torch.optim.Optimizer):
    """Of weights with two dimensions or more. Steps have the root mean square of AdamW's (Liu et al., 2025,
    arXiv:2502.16982), and like there, weights decay."""

    def __init__(self, parameters, lr, weight_decay):
        super().__init__(parameters, {"lr": lr, "weight_decay": weight_decay})

    @torch.no_grad()
    def step(self):
        for group in self.param_groups:
            for weight in group["params"]:
                if weight.grad is None:
                    continue
                state = self.state[weight]
                if not state:
                    state["momentum"] = torch.zeros_like(weight)
                state["momentum"].lerp_(weight.grad, 1 - MOMENTUM)
                ahead = weight.grad.lerp(state["momentum"], MOMENTUM).flatten(1)
                way = orthogonalised(ahead) * (0.2 * math.sqrt(max(ahead.shape)))
                weight.mul_(1 - group["lr"] * group["weight_decay"])
                weight.add_(way.reshape(weight.shape), alpha=-group["lr"])


class Optimizer:
    """Both, as one. `outputs`: the layers whose results are the network's; theirs are AdamW's too."""

    def __init__(self, network, outputs, learning_rate, weight_decay):
        last = {id(p) for layer in outputs for p in layer.parameters()}
        matrices = [p for p in network.parameters()
                    if p.ndim > 1 and id(p) not in last and min(p.flatten(1).shape) <= LARGEST]
        chosen = {id(p) for p in matrices}
        others = [p for p in network.parameters() if id(p) not in chosen]
        self.muon = Muon(matrices, learning_rate, weight_decay)
        self.adamw = torch.optim.AdamW(others, ADAMW_SHARE * learning_rate, weight_decay=weight_decay)

    def step(self, learning_rate):
        for optimizer, share in ((self.muon, 1), (self.adamw, ADAMW_SHARE)):
            for group in optimizer.param_groups:
                group["lr"] = share * learning_rate
            optimizer.step()
            optimizer.zero_grad()

    def state_dict(self):
        return {"muon": self.muon.state_dict(), "adamw": self.adamw.state_dict()}

    def load_state_dict(self, state):
        self.muon.load_state_dict(state["muon"])
        self.adamw.load_state_dict(state["adamw"])
