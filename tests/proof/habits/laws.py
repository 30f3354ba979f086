# SPDX-License-Identifier: GPL-3.0-or-later
"""Laws of hysteresis, rate-independent: the output depends on the path of the drive and not on when it was travelled.

Drives are in half ranges, -1 to 1 (effects may push them a little beyond). A law is made with random numbers of its
kind and then called once with a past (drives that it visited before) and a path. It works from one turn of the drive to
the next: between two turns the drive is monotone, and the output is a function of the drive there, computed for all
samples of the branch at once. `reversible` is the slope that has no memory, kept apart: a threshold that grows with
the rate does not act on it.
"""
import numpy as np


def branches(path):
    """First and last index of each monotone stretch; neighbours share a sample."""
    step = np.sign(np.diff(path))
    moving = np.flatnonzero(step)
    if len(moving) == 0:
        return [(0, len(path) - 1)] if len(path) > 1 else []
    turned = np.flatnonzero(np.diff(step[moving]) != 0)
    ends = [0, *(moving[turned] + 1).tolist(), len(path) - 1]
    return list(zip(ends[:-1], ends[1:]))


class Law:
    reversible = 0.0
    numbers = {}

    def with_memory(self, past, path):
        """The part with memory, along the path after the past."""
        whole = np.concatenate([np.asarray(past, float), path])
        out = np.empty(len(whole))
        out[0] = self.begin(whole[0])
        for first, last in branches(whole):
            out[first + 1:last + 1] = self.branch(whole[first], whole[first + 1:last + 1])
        return out[len(past):]

    def __call__(self, past, path, widened=None):
        """`widened`: the path that a part with thresholds sees where these grow with the rate."""
        return self.reversible * path + self.with_memory(past, path if widened is None else widened)


class Plays(Law):
    """Play operators, begun demagnetised."""

    def __init__(self, thresholds, weights, reversible, curve=None):
        self.r, self.w, self.reversible, self.curve = thresholds, weights, reversible, curve or (lambda u: (u, u))

    def begin(self, u):
        rising, falling = self.curve(u)
        self.z = np.clip(0.0, rising - self.r, falling + self.r)
        return float(self.w @ self.z)

    def branch(self, start, u):
        rising, falling = self.curve(u)
        if u[-1] >= start:
            z = np.maximum(self.z[:, None], rising[None, :] - self.r[:, None])
        else:
            z = np.minimum(self.z[:, None], falling[None, :] + self.r[:, None])
        self.z = z[:, -1]
        return self.w @ z


class Everett(Law):
    """E(a, b) >= 0 is the output of a rise from b to a after which nothing inside is remembered; a fall gives it back.
    Turns are stacked, and wiped out when the drive passes them."""

    def __init__(self, everett, reversible):
        self.everett, self.reversible = everett, reversible

    def begin(self, u):
        self.stack = [(-4.0, 0.0)]  # from far below
        self.rising(-4.0, np.array([u]))
        return self.level

    def rising(self, start, u):
        out = np.empty(len(u))
        done = 0
        while done < len(u):
            # a minimum was stacked last; before it, if any, stands the maximum at which this branch rejoins
            low, at_low = self.stack[-1]
            high = self.stack[-2][0] if len(self.stack) >= 2 else np.inf
            end = len(u) if u[-1] <= high else int(np.searchsorted(u, high, side="right"))
            out[done:end] = at_low + self.everett(u[done:end], low)
            done = end
            if done < len(u):
                self.stack.pop()
                self.stack.pop()
        self.level = float(out[-1])
        return out

    def falling(self, start, u):
        out = np.empty(len(u))
        done = 0
        while done < len(u):
            high, at_high = self.stack[-1]
            low = self.stack[-2][0] if len(self.stack) >= 2 else -np.inf
            end = len(u) if u[-1] >= low else int(np.searchsorted(-u, -low, side="right"))
            out[done:end] = at_high - self.everett(high, u[done:end])
            done = end
            if done < len(u):
                self.stack.pop()
                self.stack.pop()
        self.level = float(out[-1])
        return out

    def branch(self, start, u):
        going_up = u[-1] >= start
        last_is_minimum = len(self.stack) % 2 == 1
        if going_up != last_is_minimum:
            self.stack.append((float(start), self.level))
        return self.rising(start, u) if going_up else self.falling(start, u)


class Density(Everett):
    """A Preisach plane with a density over (half width, middle), as a table of its double integral with cubic
    interpolation of the fourth order (of Catmull and Rom), which is smooth across the cells."""
    CELLS = 240

    def __init__(self, density, reversible, span=1.6):
        n = self.CELLS
        edge = np.linspace(-span, span, n + 1)
        middle = 0.5 * (edge[1:] + edge[:-1])
        high, low = np.meshgrid(middle, middle, indexing="ij")
        mass = np.where(high > low, density(0.5 * (high - low), 0.5 * (high + low)), 0.0)
        # Integral of the density over low >= b and high <= a: continued antisymmetrically it is smooth at a = b
        whole = mass + mass.T
        total = np.zeros((n + 1, n + 1))
        total[1:, 1:] = np.cumsum(np.cumsum(whole, axis=0), axis=1)
        at = np.arange(n + 1)
        diagonal = total[at, at]
        # square [b, a] x [b, a] holds the triangle twice
        table = 0.5 * (diagonal[:, None] - total - total.T + diagonal[None, :])
        self.span, self.table = span, np.where(at[:, None] >= at[None, :], table, -table)
        self.scale = 1.0
        super().__init__(self.interpolated, reversible)

    def interpolated(self, a, b):
        n, span = self.CELLS, self.span
        a, b = np.broadcast_arrays(np.asarray(a, float), np.asarray(b, float))
        out = 0.0
        parts = []
        for value in (a, b):
            at = (np.clip(value, -span, span) + span) / (2.0 * span) * n    # there are no relays beyond
            cell = np.minimum(at.astype(int), n - 1)
            t = at - cell
            parts.append((cell, (((-0.5 * t + 1.0) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1.0,
                                 ((-1.5 * t + 2.0) * t + 0.5) * t, (0.5 * t - 0.5) * t * t)))
        (row, row_weight), (column, column_weight) = parts
        for i in range(4):
            for j in range(4):
                node = np.clip(row + i - 1, 0, n), np.clip(column + j - 1, 0, n)
                out = out + row_weight[i] * column_weight[j] * self.table[node]
        return self.scale * out


class Moving(Law):
    """The plane sees the drive and a part of its own output: y = P[u + k y]. Loops are not congruent."""

    def __init__(self, plane, feedback):
        self.plane, self.feedback, self.reversible = plane, feedback, plane.reversible

    def settle(self, start, u, before):
        x = u + self.feedback * before
        for _ in range(60):
            stack, level = list(self.plane.stack), self.plane.level
            y = self.plane.branch(start, x)
            new = u + self.feedback * y
            moved = float(np.max(np.abs(new - x)))
            x = new
            if moved < 1e-13:
                break
            self.plane.stack, self.plane.level = stack, level
        return x, y

    def begin(self, u):
        self.before, self.x = self.plane.begin(u), u
        return self.before

    def branch(self, start, u):
        x, y = self.settle(self.x, u, self.before)
        self.x, self.before = float(x[-1]), float(y[-1])
        return y


class Master(Law):
    """dh/du depends on h and the direction alone: a branch is a piece of one curve for each direction, found by its
    inverse. (Bouc-Wen and Dahl.)"""

    def __init__(self, slope, weight, reversible, limit):
        """slope(h, direction); limit: where the slope becomes 0, from below and above, slightly inside."""
        self.reversible, self.weight, self.tables = reversible, weight, {}
        for direction in (1.0, -1.0):
            low, high = limit(direction)
            if direction > 0:
                low = -abs(high) * 1.6 if low is None else low
            else:
                high = abs(low) * 1.6 if high is None else high
            # dense towards the end that is only approached
            part = np.concatenate([[0.0], np.cumsum(np.geomspace(1.0, 1e-7, 20000))])
            part /= part[-1]
            h = low + (high - low) * part if direction > 0 else high + (low - high) * part
            inverse = 1.0 / np.maximum(slope(0.5 * (h[1:] + h[:-1]), direction), 1e-14)
            self.tables[direction] = h, np.concatenate([[0.0], np.cumsum(np.abs(np.diff(h)) * inverse)])

    def begin(self, u):
        self.h = 0.0
        return 0.0

    def branch(self, start, u):
        direction = 1.0 if u[-1] >= start else -1.0
        h, path = self.tables[direction]
        at = np.interp(direction * self.h, direction * h, path)
        out = np.interp(at + np.abs(u - start), path, h)
        self.h = float(out[-1])
        return self.weight * out


class Duhem(Law):
    """dh/du = s a (f(u) - h) + g(u), s the direction (Coleman and Hodgdon). Linear in h: branches are a particular
    solution each way, and what deviates from it decays with the path."""

    def __init__(self, a, f, g, weight, reversible):
        self.a, self.weight, self.reversible = a, weight, reversible
        self.u = np.linspace(-2.0, 2.0, 16001)
        h = self.u[1] - self.u[0]
        e = np.exp(-a * h)
        self.particular = {}
        for direction in (1.0, -1.0):
            u = self.u if direction > 0 else self.u[::-1]
            drive = a * f(u) + direction * g(u)     # along the path: dh/dl = -a h + drive
            late = (h + np.expm1(-a * h) / a) / (a * h)
            early = (-np.expm1(-a * h) / a - h * e) / (a * h)
            y = np.empty(len(u))
            y[0] = drive[0] / a
            for k in range(1, len(u)):
                y[k] = e * y[k - 1] + late * drive[k] + early * drive[k - 1]
            self.particular[direction] = y if direction > 0 else y[::-1]

    def begin(self, u):
        self.h = 0.5 * sum(float(np.interp(u, self.u, y)) for y in self.particular.values())
        return self.weight * self.h

    def branch(self, start, u):
        y = self.particular[1.0 if u[-1] >= start else -1.0]
        off = self.h - np.interp(start, self.u, y)
        out = np.interp(u, self.u, y) + off * np.exp(-self.a * np.abs(u - start))
        self.h = float(out[-1])
        return self.weight * out


class Leaky(Law):
    """dz/du = 1 - s z / L, a sum of several: relaxations along the path."""

    def __init__(self, lengths, weights, products, reversible):
        self.lengths, self.weights, self.products, self.reversible = lengths, weights, products, reversible

    def begin(self, u):
        self.z = np.zeros(len(self.lengths))
        return 0.0

    def branch(self, start, u):
        s = 1.0 if u[-1] >= start else -1.0
        ends = s * self.lengths
        z = ends[:, None] + (self.z - ends)[:, None] * np.exp(-np.abs(u - start)[None, :] / self.lengths[:, None])
        self.z = z[:, -1]
        return self.weights @ z + self.products @ (z * z)


class Stepwise(Law):
    """dm/du = slope(u, m, s), by the method of Runge and Kutta of the fourth order."""

    def __init__(self, slope, weight, reversible):
        self.slope, self.weight, self.reversible = slope, weight, reversible

    def begin(self, u):
        self.m = 0.0
        return 0.0

    def branch(self, start, u):
        s, m, f = (1.0 if u[-1] >= start else -1.0), self.m, self.slope
        out, before = np.empty(len(u)), float(start)
        for k, to in enumerate(u.tolist()):
            parts = max(1, int(abs(to - before) / 0.02) + 1)
            d = (to - before) / parts
            for i in range(parts):
                at = before + i * d
                k1 = f(at, m, s)
                k2 = f(at + 0.5 * d, m + 0.5 * d * k1, s)
                k3 = f(at + 0.5 * d, m + 0.5 * d * k2, s)
                k4 = f(at + d, m + d * k3, s)
                m += d * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
            before = to
            out[k] = m
        self.m = m
        return self.weight * out


def masing(initial, reversible):
    """Branches are the initial curve, twice as large: E(a, b) = 2 F((a - b) / 2)."""
    return Everett(lambda a, b: 2.0 * initial(0.5 * (a - b)), reversible)
