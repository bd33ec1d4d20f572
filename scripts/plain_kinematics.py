"""The plain kinematic model of ground robots that scripts/wrong_robots.py calibrates files with.

Its own equations and its own least squares, so that a diagnosis is not tried on files that it made.
Values are ratios to the robot's file (left, right, ahead, separation, steering_gain), or numbers in
its units (lag, delay, marker_x, ...).  Windows of 1 and 4 s (or whole runs, of two poses) that begin
at a measured pose, with half a second of run-in; Huber's weights.  Standard library only.
"""
import bisect
import math
import tomllib

STEP_S = 0.04
RUN_IN_S = 0.5
WINDOWS_S = (1.0, 4.0)
SPEED_S = 0.25  # either side of a start
HUBER = 2.0  # robust standard deviations
ROUNDS = 12

TABLE_SETS = ("lag", "delay", "marker_x", "marker_y", "marker_yaw")
# Name: start (None: the file's), step of slopes, standard deviation of what is believed before.
VALUES = {
    "left": (1, 0.002, 0.2), "right": (1, 0.002, 0.2), "ahead": (1, 0.002, 0.2),
    "separation": (1, 0.005, 0.5), "steering_gain": (1, 0.005, 0.3),
    "steering_left": (1, 0.005, 0.3), "steering_right": (1, 0.005, 0.3),
    "steering_offset": (0, 0.002, 0.1), "understeer": (0, 0.005, 0.1),
    "gain": (None, 0.05, 5), "zero": (None, 0.002, 0.1), "back_emf": (None, 0.02, 1),
    "drag": (None, 0.02, 1), "coulomb": (None, 0.01, 0.5), "cornering": (None, 0.02, 0.5),
    "lag": (0.05, 0.01, 0.1), "delay": (0, 0.01, 0.1),
    "marker_x": (None, 0.002, 0.1), "marker_y": (None, 0.002, 0.1), "marker_yaw": (None, 0.002, 0.1),
}
MAGNITUDES = ("lag", "back_emf", "drag", "coulomb", "cornering", "understeer")
OF_KIND = {
    "sides": ("left", "right", "separation"),
    "omni": ("ahead", "separation"),
    "tricycle": ("ahead", "steering_gain", "steering_offset"),
    "car": ("steering_left", "steering_right", "steering_offset", "understeer", "gain", "zero", "back_emf", "drag",
            "coulomb", "cornering"),
}


def wrapped(angle):
    return angle - 2 * math.pi * math.ceil((angle - math.pi) / (2 * math.pi))


def compose(a, b):
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2]


def between(a, b):
    c, s = math.cos(a[2]), math.sin(a[2])
    dx, dy = b[0] - a[0], b[1] - a[1]
    return c * dx + s * dy, -s * dx + c * dy, wrapped(b[2] - a[2])


def inverse_of(a):
    return between(a, (0.0, 0.0, 0.0))


def solve(A, columns):
    """Gauss and Jordan; A symmetric and positive."""
    n = len(A)
    rows = [list(A[i]) + [c[i] for c in columns] for i in range(n)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [v / rows[i][i] for v in rows[i]]
        for k in range(n):
            if k != i and rows[k][i]:
                factor = rows[k][i]
                rows[k] = [a - factor * b for a, b in zip(rows[k], rows[i])]
    return [[rows[i][n + j] for i in range(n)] for j in range(len(columns))]


def median(values):
    return sorted(values)[len(values) // 2]


class Track:
    """Mean of a command over a step: rows hold until the next."""

    def __init__(self, commands):
        self.t = [t for t, _ in commands]
        self.v = [values for _, values in commands]
        self.sums = [[0.0] * len(self.v[0])]
        for i in range(1, len(self.t)):
            dt = self.t[i] - self.t[i - 1]
            self.sums.append([s + dt * v for s, v in zip(self.sums[-1], self.v[i - 1])])

    def integral(self, t):
        i = max(0, bisect.bisect_right(self.t, t) - 1)
        dt = max(0.0, t - self.t[i])
        return [s + dt * v for s, v in zip(self.sums[i], self.v[i])]

    def mean(self, t, dt):
        return [(b - a) / dt for a, b in zip(self.integral(t), self.integral(t + dt))]


class Model:
    def __init__(self, kind, text, only_ends=False):
        self.kind = kind
        self.robot = robot = tomllib.loads(text)
        self.channels = robot["commands"]
        if self.channels == ["v", "omega"]:
            self.channels = ["left", "right"]  # wrong_robots.py turns twists into wheel speeds
        # Two poses at rest do not see when and how wheels follow.
        self.names = OF_KIND[kind] + (TABLE_SETS[2:] if only_ends else TABLE_SETS)
        if kind == "car":  # its tyres slip, which a marker elsewhere would make up for
            self.names = OF_KIND[kind] + ("lag", "delay")
        self.radius = robot.get("wheel_radius", 0.1)
        self.base = robot.get("wheel_separation", robot.get("robot_radius", 1.0))
        self.wheelbase = robot.get("wheelbase", 1.0)
        self.driving = [i for i, name in enumerate(self.channels) if name != "steering"]
        if kind == "car":
            self.table = [tuple(p) for p in robot["steering_table"]]
            self.middle = dict(self.table)[0.0]

    def start(self):
        marker = self.robot.get("marker", {})
        values = {"lag": 0.0, "delay": 0.0}
        for name in self.names + TABLE_SETS[2:]:
            value = VALUES[name][0]
            if name.startswith("marker"):
                value = marker.get(name[7:], 0.0)
            elif value is None:
                value = self.robot["throttle"][name]
            values[name] = float(value)
        if self.kind == "car":
            values.update(understeer=self.robot["understeer"], lag=self.robot["lag"],
                          delay=self.robot["delay"])
        return values

    def angle(self, command, values):
        """Of the table, whose angle at 0 is its offset, with a gain to either side."""
        table = self.table
        i = min(max(1, bisect.bisect_right([c for c, _ in table], command)), len(table) - 1)
        (a, x), (b, y) = table[i - 1], table[i]
        share = min(max((command - a) / (b - a), 0.0), 1.0)
        angle = x + share * (y - x) - self.middle
        side = "steering_left" if angle > 0 else "steering_right"
        return self.middle + values[side] * angle + values["steering_offset"]

    def window_end(self, values, track, window):
        """The marker's motion through a window, by the model."""
        begin, end, speed = window
        at, delay = begin - RUN_IN_S, values["delay"]
        state, X = None, (0.0, 0.0, 0.0)
        lag, limit = abs(values["lag"]), values.get("acceleration_limit")
        omega = 0.0
        while at < end - 1e-9:
            dt = min(STEP_S, (begin if at < begin - 1e-9 else end) - at)
            commanded = track.mean(at - delay, dt)
            if self.kind == "car":
                wanted = self.angle(commanded[1], values)
                decay = math.exp(-dt / lag) if lag > 1e-4 and state is not None else 0.0
                state = wanted + ((state or 0.0) - wanted) * decay
                if at < begin - 1e-9:
                    v = speed
                else:
                    push = max(0.0, abs(commanded[0]) - values["zero"])
                    slow = push * values["back_emf"] + values["drag"] + values["cornering"] * abs(omega)
                    after = (speed + dt * math.copysign(push * values["gain"], commanded[0])) / (1 + dt * slow)
                    held = values["coulomb"] * dt
                    after = 0.0 if abs(after) <= held else after - math.copysign(held, after)
                    v, speed = (speed + after) / 2, after
                base = values.get("wheelbase", self.wheelbase)
                omega = v * math.tan(state) / base / (1 + values["understeer"] * v * v)
                twist = (v, 0.0, omega)
            else:
                if state is None:
                    state = commanded[:]
                decay = math.exp(-dt / lag) if lag > 1e-4 else 0.0
                share = (1 - decay) * lag / dt if lag > 1e-4 else 0.0
                if limit:
                    most = limit / self.radius * dt
                    limited = self.limited if at > begin - RUN_IN_S + 1e-9 else commanded
                    commanded = [min(max(u, l - most), l + most) for u, l in zip(commanded, limited)]
                    self.limited = commanded
                used = [u + (s - u) * share for u, s in zip(commanded, state)]
                state = [u + (s - u) * decay for u, s in zip(commanded, state)]
                twist = self.twist(values, used)
            if at >= begin - 1e-9:
                half = twist[2] * dt / 2
                c, s = math.cos(X[2] + half), math.sin(X[2] + half)
                X = (X[0] + dt * (c * twist[0] - s * twist[1]), X[1] + dt * (s * twist[0] + c * twist[1]),
                     X[2] + dt * twist[2])
            at += dt
        marker = (values["marker_x"], values["marker_y"], values["marker_yaw"])
        return compose(compose(inverse_of(marker), X), marker)

    def twist(self, values, u):
        r = self.radius
        if self.kind == "sides":
            by = dict(zip(self.channels, u))
            left, right = r * values["left"] * by["left"], r * values["right"] * by["right"]
            return (left + right) / 2, 0.0, (right - left) / (self.base * values["separation"])
        if self.kind == "tricycle":
            angle = values["steering_gain"] * u[1] + values["steering_offset"]
            v = r * values["ahead"] * u[0] * math.cos(angle)
            return v, 0.0, v * math.tan(angle) / values.get("wheelbase", self.wheelbase)
        r *= values["ahead"]
        if len(u) == 4:
            fl, fr, rl, rr = (r * s for s in u)
            arm = (self.base + self.wheelbase) / 2 * values["separation"]
            return (fl + fr + rl + rr) / 4, (-fl + fr + rl - rr) / 4, (-fl + fr - rl + rr) / (4 * arm)
        at = (-math.pi / 3, math.pi / 3, math.pi)  # wheels that drive clockwise
        a, b, c = (r * s for s in u)
        v = 2 / 3 * sum(math.sin(p) * s for p, s in zip(at, (a, b, c)))
        w = -2 / 3 * sum(math.cos(p) * s for p, s in zip(at, (a, b, c)))
        return v, w, -(a + b + c) / 3 / (self.base * values["separation"])

    def windows(self, poses):
        if len(poses) == 2:
            return [(poses[0], poses[1], 0.0)]
        times, out = [p[0] for p in poses], []
        for length in WINDOWS_S:
            i = bisect.bisect_left(times, times[0] + RUN_IN_S)
            while True:
                j = bisect.bisect_left(times, times[min(i, len(times) - 1)] + length)
                if j >= len(times):
                    break
                a = bisect.bisect_left(times, times[i] - SPEED_S)
                b = min(bisect.bisect_left(times, times[i] + SPEED_S), len(times) - 1)
                moved = between(poses[a][1:], poses[b][1:])
                out.append((poses[i], poses[j], moved[0] / max(times[b] - times[a], 1e-3)))
                i = j
        return out

    def residuals(self, runs, values):
        out = []
        for commands, poses in runs:
            track = Track(commands)
            for a, b, speed in self.windows(poses):
                end = self.window_end(values, track, (a[0], b[0], speed))
                got = between(a[1:], b[1:])
                turned = between((0, 0, end[2]), (got[0] - end[0], got[1] - end[1], got[2]))
                out.append(turned)
        return out

    def scales(self, residuals):
        return [max(1.4826 * median([abs(r[c]) for r in residuals]), 1e-5) for c in range(3)]

    def misfit(self, runs, values):
        """Mean squared residual in units that the model sets once, at the values that it fitted."""
        residuals = self.residuals(runs, values)
        units = self.units
        return sum((r[c] / units[c]) ** 2 for r in residuals for c in range(3)) / len(residuals) / 3

    def fit(self, runs):
        """Values, and the standard error of each with all others free."""
        values, damping = self.start(), 1e-2
        shifts = range(-5, 8) if "delay" in self.names and self.kind != "car" else [0]
        tries = [dict(values, delay=values["delay"] + 0.1 * k) for k in shifts]
        sizes = [self.scales(self.residuals(runs, t)) for t in tries]
        values = min(zip(tries, sizes), key=lambda p: sum(math.log(s) for s in p[1]))[0]
        first = dict(values)
        for _ in range(ROUNDS):
            r = self.residuals(runs, values)
            s = self.scales(r)
            J = []
            for name in self.names:
                moved = self.residuals(runs, dict(values, **{name: values[name] + VALUES[name][1]}))
                J.append([[(m[c] - b[c]) / VALUES[name][1] for c in range(3)] for m, b in zip(moved, r)])
            H, g, cost = self.equations(r, s, J, values, first)
            for _ in range(5):
                damped = [[v * (1 + damping) if i == j else v for j, v in enumerate(row)]
                          for i, row in enumerate(H)]
                step = solve(damped, [g])[0]
                new = dict(values, **{n: values[n] - d for n, d in zip(self.names, step)})
                for name in MAGNITUDES:
                    if name in new:
                        new[name] = max(0.0, new[name])
                after = self.cost(self.residuals(runs, new), s, new, first)
                if after < cost:
                    break
                damping *= 10
            else:
                break
            gained, values, damping = cost - after, new, damping / 10
            if gained < 1e-3:
                break
        r = self.residuals(runs, values)
        self.units = [math.sqrt(sum(e[c] ** 2 for e in r) / len(r)) for c in range(3)]
        identity = [[float(i == j) for i in range(len(H))] for j in range(len(H))]
        inverse = solve(H, identity)
        return values, {n: math.sqrt(inverse[i][i]) for i, n in enumerate(self.names)}

    def cost(self, residuals, s, values, first):
        total = sum(((values[n] - first[n]) / VALUES[n][2]) ** 2 / 2 for n in self.names)
        for r in residuals:
            for c in range(3):
                z = abs(r[c]) / s[c]
                total += z * z / 2 if z < HUBER else HUBER * (z - HUBER / 2)
        return total

    def equations(self, r, s, J, values, first):
        n = len(self.names)
        H = [[0.0] * n for _ in range(n)]
        g = [0.0] * n
        for k, name in enumerate(self.names):
            H[k][k] += 1 / VALUES[name][2] ** 2
            g[k] += (values[name] - first[name]) / VALUES[name][2] ** 2
        for i, e in enumerate(r):
            for c in range(3):
                w = min(1.0, HUBER * s[c] / max(abs(e[c]), 1e-12)) / s[c] ** 2
                slopes = [J[k][i][c] for k in range(n)]
                for k in range(n):
                    if slopes[k]:
                        g[k] += w * slopes[k] * e[c]
                        for l in range(n):
                            H[k][l] += w * slopes[k] * slopes[l]
        return H, g, self.cost(r, s, values, first)

    def robot_file(self, v):
        robot, lines = self.robot, []
        put = lambda key, value: lines.append(f"{key} = {value}")
        names = ", ".join(f'"{c}"' for c in self.channels)
        put("drive", f'"{robot["drive"]}"')
        put("commands", f"[{names}]")
        if robot.get("measured"):
            put("measured", "true")
        if "mass" in robot:
            put("mass", robot["mass"])
        put("lag", f"{v['lag']:.4f}")
        put("delay", f"{v['delay']:.4f}")
        if "acceleration_limit" in v:
            put("acceleration_limit", v["acceleration_limit"])
        wheels = []
        if self.kind == "sides":
            put("wheel_separation", self.base if robot["drive"] == "skid" else f"{self.base * v['separation']:.5f}")
            if robot["drive"] == "skid":
                put("wheel_separation_multiplier", f"{v['separation']:.5f}")
            for side in ("left", "right"):
                wheels.append(f"[wheels.{side}]\nradius = {self.radius * v[side]:.6f}")
        elif self.kind == "omni":
            put("wheel_radius", f"{self.radius * v['ahead']:.6f}")
            if len(self.channels) == 4:
                put("wheelbase", f"{self.wheelbase * v['separation']:.5f}")
                put("wheel_separation", f"{self.base * v['separation']:.5f}")
            else:
                put("robot_radius", f"{self.base * v['separation']:.5f}")
                for name, w in robot["wheels"].items():
                    wheels.append(f'[wheels.{name}]\nkind = "omni"\nradius = {self.radius * v["ahead"]:.6f}\n'
                                  f'x = {w["x"] * v["separation"]:.5f}\ny = {w["y"] * v["separation"]:.5f}\n'
                                  f'heading = {w["heading"]}')
        else:
            put("wheelbase", f"{v.get('wheelbase', self.wheelbase):.5f}")
        if self.kind == "car":
            put("understeer", f"{v['understeer']:.5f}")
            table = [[c, round(self.angle(c, v), 5)] for c, _ in self.table]
            put("steering_table", table)
            wheels.append("[throttle]\n" + "\n".join(f"{n} = {v[n]:.5f}" for n in robot["throttle"]))
        elif self.kind == "tricycle":
            put("wheel_radius", f"{self.radius * v['ahead']:.6f}")
            wheels.append(f"[steering]\ngain = {v['steering_gain']:.5f}\noffset = {v['steering_offset']:.5f}")
        wheels.append(f"[marker]\nx = {v['marker_x']:.5f}\ny = {v['marker_y']:.5f}\nyaw = {v['marker_yaw']:.5f}")
        return "\n".join(lines + wheels) + "\n"
