"""docs/network-arithmetic.md in plain Python, number by number: what integer_network.py and the backends are held to.
Slow, and shares nothing with them. Tensors are lists [channel][row][column]."""
import math


def normalise(image):
    """Rows of grey levels to rows of s8."""
    n = sum(len(row) for row in image)
    total, squares = sum(map(sum, image)), sum(p * p for row in image for p in row)
    m = (total + n // 2) // n
    v = max(0, squares // n - m * m)
    s = max(1, math.isqrt(v))
    gain = min(2048, max(128, (256 * 48 + s // 2) // s))
    return [[min(127, max(-128, ((p - m) * gain + 128) >> 8)) for p in row] for row in image]


def fold(rows):
    """Four pixels a word: [4][height][width / 4]."""
    return [[row[c::4] for row in rows] for c in range(4)]


def accumulate(x, weights, stride, pad, groups):
    """weights [out][in / groups][row][column]."""
    height, width = len(x[0]), len(x[0][0])
    group_inputs, kernel_rows, kernel_columns = len(weights[0]), len(weights[0][0]), len(weights[0][0][0])
    rows = (height + 2 * pad[0] - kernel_rows) // stride[0] + 1
    columns = (width + 2 * pad[1] - kernel_columns) // stride[1] + 1
    out = []
    for o, kernel in enumerate(weights):
        first = o // (len(weights) // groups) * group_inputs
        plane = []
        for i in range(rows):
            line = []
            for j in range(columns):
                acc = 0
                for c in range(group_inputs):
                    for k in range(kernel_rows):
                        y = i * stride[0] - pad[0] + k
                        if 0 <= y < height:
                            for l in range(kernel_columns):
                                z = j * stride[1] - pad[1] + l
                                if 0 <= z < width:
                                    acc += kernel[c][k][l] * x[first + c][y][z]
                line.append(acc)
            plane.append(line)
        out.append(plane)
    return out


def requantise(acc, bias, m, shift):
    r = 1 << (shift - 1) if shift else 0
    assert abs(acc + bias + r) < 2**31
    a = min(32767, max(-32768, (acc + bias + r) >> shift))
    return min(127, max(0, (a * m + 2**21) >> 22))


def each(tensor, function):
    return [[[function(c, value) for value in line] for line in plane] for c, plane in enumerate(tensor)]


def local_response_norm(x, table):
    out = []
    for c, plane in enumerate(x):
        neighbours = x[max(0, c - 2):c + 3]
        lines = []
        for i, line in enumerate(plane):
            values = []
            for j, a in enumerate(line):
                s = sum(other[i][j] ** 2 >> 1 for other in neighbours)
                if s < 2048:
                    k, f = s >> 5, (s & 31) << 3
                else:
                    k, f = 62 + (s >> 10), (s & 1023) >> 2
                t = table[k] + (((table[k + 1] - table[k]) * f + 128) >> 8)
                values.append(min(127, (a * t + 2**13) >> 14))
            lines.append(values)
        out.append(lines)
    return out


def max_pool(x, kernel, stride):
    rows, columns = (len(x[0]) - kernel) // stride + 1, (len(x[0][0]) - kernel) // stride + 1
    return [[[max(plane[i * stride + k][j * stride + l] for k in range(kernel) for l in range(kernel))
              for j in range(columns)] for i in range(rows)] for plane in x]


def multiply(v, m, k):
    return min(2**30, max(-2**30, (v * m + (1 << (k - 1))) >> k))


def score_q15(absent, present, m, k, logistic):
    return logistic[min(2047, max(-2048, multiply(present - absent, m, k))) + 2048]


def root_of_two_q30(i):
    """2^(2^-i) in Q30, rounded, from integers."""
    value = 2 << 400
    for _ in range(i):
        value = math.isqrt(value << 400)
    return ((value >> (400 - 31)) + 1) >> 1


def size_q16(g, m, k):
    e = min(3 << 16, max(-3 << 16, multiply(g, m, k)))
    whole, fraction = e >> 16, e & 65535
    power = 1 << 30
    for i in range(1, 17):
        if fraction >> (16 - i) & 1:
            power = (power * root_of_two_q30(i) + (1 << 29)) >> 30
    return power >> (8 - whole)  # 64 px in Q16 is 2^22


def step(layer, x):
    """One layer of model_file's on [channel][row][column]."""
    if layer.title == "convolve":
        acc = accumulate(x, layer.weights.tolist(), layer.stride, layer.pad, layer.groups)
    elif layer.title == "local_response_norm":
        return local_response_norm(x, [int(t) for t in layer.table])
    elif layer.title == "max_pool":
        return max_pool(x, layer.kernel, layer.stride)
    elif layer.title == "fully_connected":
        by_pixel = layer.weights.tolist()  # [out][row][column][channel]
        weights = [[[[cell[c] for cell in line] for line in kernel] for c in range(len(kernel[0][0]))]
                   for kernel in by_pixel]
        acc = accumulate(x, weights, (1, 1), (0, 0), 1)
    else:
        acc = accumulate(x, [[[[int(w)]] for w in row] for row in layer.weights], (1, 1), (0, 0), 1)
        return each(acc, lambda c, value: value + int(layer.bias[c]))
    return each(acc, lambda c, value: requantise(value, int(layer.bias[c]), int(layer.multiplier[c]), layer.shift))
