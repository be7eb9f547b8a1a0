"""The four-tank in closed loop: two controllers that exchange messages as bytes, and the linear plant.

Usage: four_tank.py PACKAGE, the folder that `dpc-codegen system.toml --emit c --out PACKAGE` has written.
"""

import ctypes
import re
import struct
import sys
from pathlib import Path

STEPS = 600
DPC_OK = 0

# x+ = A x + B u: h1, h2, h3, h4 [cm] and v1, v2 [V], as deviations from the operating point.
A = [[0.9921, 0.0, 0.0, 0.0206], [0.0, 0.9835, 0.0, 0.0], [0.0, 0.0165, 0.9945, 0.0], [0.0, 0.0, 0.0, 0.9793]]
B = [[0.0417, 2.47e-4], [0.0156, 0.0], [1.30e-4, 0.0311], [0.0, 0.0235]]

# Of h1 and h3 [cm], a quarter of the run each.
PROFILE = [(2.0, 1.0), (-0.5, 2.5), (9.0, -0.5), (0.0, 0.0)]


class Status(ctypes.Structure):
    """dpc_status of dpc.h."""

    _fields_ = [
        (name, ctypes.c_int32)
        for name in (
            "control",
            "control_row",
            "iterations",
            "active_rows",
            "references",
            "references_row",
            "messages_missing",
        )
    ] + [(name, ctypes.c_uint8) for name in ("guaranteed", "certified", "load_within", "degraded")]


class Network:
    """The shared library of a package, and what its headers define."""

    def __init__(self, package):
        suffix = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
        library = next(path for path in (package / "lib").iterdir() if path.suffix == suffix)
        self.library = ctypes.CDLL(str(library.resolve()))
        self.text = self.library.four_tank_result_text
        self.text.restype, self.text.argtypes = ctypes.c_char_p, [ctypes.c_int32]
        self.headers = "".join(path.read_text(encoding="utf-8") for path in (package / "include").glob("*.h"))
        self.library.four_tank_design.restype = ctypes.c_uint64
        if self.library.four_tank_design() != int(self.defined("FOUR_TANK_DESIGN", r"UINT64_C\((\w+)\)"), 16):
            sys.exit("headers and library are of different designs")

    def defined(self, name, value=r"(\S+)"):
        return re.search(rf"^#define {name} {value}", self.headers, re.MULTILINE).group(1)


class Controller:
    """One subsystem: `prefix` is that of its functions."""

    def __init__(self, network, prefix):
        self.network, self.prefix = network, prefix
        number = {"double": ctypes.c_double, "float": ctypes.c_float}[self.defined("REAL")]
        nx, nu, ny = (int(self.defined(name)) for name in ("NX", "NU", "NY"))
        self.x, self.u, self.y = number * nx, number * nu, number * ny
        self.network_y = number * int(self.defined("NETWORK_NY"))
        self.message = (ctypes.c_uint8 * int(self.defined("MESSAGE_BYTES")))()
        self.status = Status()
        size = self.function("size")
        size.restype, size.argtypes = ctypes.c_size_t, []
        self.size = ctypes.c_size_t(size())
        # Words, so that it is aligned.
        self.memory = (ctypes.c_uint64 * ((self.size.value + 7) // 8))()

    def defined(self, name):
        return self.network.defined(f"{self.prefix.upper()}_{name}")

    def function(self, verb):
        return getattr(self.network.library, f"{self.prefix}_{verb}")

    def call(self, verb, *arguments):
        code = self.function(verb)(*arguments)
        if code != DPC_OK:
            raise RuntimeError(f"{self.prefix}_{verb}: {self.network.text(code).decode()}")

    def start(self, outputs):
        """At rest with the outputs of the whole network; returns the first message."""
        x, u = self.x(), self.u()
        self.call("steady_state", self.network_y(*outputs), x, u)
        self.call("start", self.memory, self.size, x, u, self.message, None)
        return bytes(self.message)

    def accept(self, message):
        self.call("accept", self.memory, message, ctypes.c_size_t(len(message)))

    def step(self, x, set_point):
        """The inputs, and the message for the neighbours."""
        u = self.u()
        y = self.y(*set_point)
        self.call("step", self.memory, self.x(*x), y, u, self.message, ctypes.byref(self.status))
        return list(u), bytes(self.message)

    def bits(self, number):
        form = {8: ">d", 4: ">f"}[ctypes.sizeof(self.u) // len(self.u())]
        return struct.pack(form, number).hex()


def advance(x, u):
    following = []
    for row_a, row_b in zip(A, B):
        total = 0.0
        for a, value in zip(row_a, x):
            total += a * value
        for b, value in zip(row_b, u):
            total += b * value
        following.append(total)
    return following


def main(package):
    network = Network(package)
    left, right = Controller(network, "four_tank_left"), Controller(network, "four_tank_right")
    from_left, from_right = left.start([0.0, 0.0]), right.start([0.0, 0.0])
    x = [6.0, 0.0, 0.0, 0.05]  # off the steady state: the first problems have something to solve
    for t in range(STEPS):
        first, second = PROFILE[t // (STEPS // 4)]
        left.accept(from_right)
        right.accept(from_left)
        (v1,), from_left = left.step(x[:2], [first])
        (v2,), from_right = right.step(x[2:], [second])
        guaranteed = left.status.guaranteed and right.status.guaranteed
        print(
            f"{t:3d}  v1 {v1:9.5f} V  v2 {v2:9.5f} V  {left.bits(v1)} {right.bits(v2)}  {left.status.control} "
            f"{right.status.control}  {'guaranteed' if guaranteed else 'NOT GUARANTEED'}"
        )
        x = advance(x, [v1, v2])
        if t == STEPS // 2:
            x[2] -= 4.0  # a bucket of water


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
