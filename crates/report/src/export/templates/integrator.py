# ---- Inputs between their samples: the spline of degree 7 through them, one polynomial an interval.

MARGIN = 48
POLES = [-0.5352804307964382, -0.12255461519232669, -0.009148694809608277]
BASIS = [
    np.array([1, 120, 1191, 2416, 1191, 120, 1]) / 5040,
    np.array([-1, -56, -245, 0, 245, 56, 1]) / 720,
    np.array([1, 24, 15, -80, 15, 24, 1]) / 120,
    np.array([-1, -8, 19, 0, -19, 8, 1]) / 24,
]


def extended(last):
    """MARGIN values beyond some last ones (the outermost first), on the polynomial through them."""
    differences = list(last)
    for order in range(1, len(last)):
        for k in range(len(last) - 1, order - 1, -1):
            differences[k] = differences[k - 1] - differences[k]
    values = []
    for _ in range(MARGIN):
        for order in range(len(last) - 2, -1, -1):
            differences[order] += differences[order + 1]
        values.append(differences[0])
    return values


def spline(y):
    """Eight coefficients an interval.

    Recursive filter: M. Unser, A. Aldroubi, M. Eden, IEEE Trans. Signal Processing 41 (1993) 821-848.
    """
    y = [float(value) for value in y]
    n, count = len(y), min(6, len(y))
    after, before = extended(y[::-1][:count]), extended(y[:count])
    c = before[::-1] + y + after
    gain = np.prod([(1 - z) * (1 - 1 / z) for z in POLES])
    c = [gain * value for value in c]
    for z in POLES:
        held = c[0] / (1 - z)
        for i in range(len(c)):
            c[i] = held = c[i] + z * held
        c[-1] = held = z / (z * z - 1) * (c[-1] + z * c[-2])
        for i in range(len(c) - 2, -1, -1):
            c[i] = held = z * (held - c[i])
    inner = np.array(c[MARGIN - 3 : MARGIN + n + 3])
    jets = np.array([np.correlate(inner, basis, "valid") for basis in BASIS])
    jets[0] = y
    a, b = jets[:, :-1], jets[:, 1:]
    p = [a[0], a[1], a[2] / 2, a[3] / 6]
    r0, r1 = b[0] - (p[0] + p[1] + p[2] + p[3]), b[1] - (p[1] + 2 * p[2] + 3 * p[3])
    r2, r3 = b[2] - (2 * p[2] + 6 * p[3]), b[3] - 6 * p[3]
    p.append(35 * r0 - 15 * r1 + 2.5 * r2 - r3 / 6)
    p.append(-84 * r0 + 39 * r1 - 7 * r2 + r3 / 2)
    p.append(70 * r0 - 34 * r1 + 6.5 * r2 - r3 / 2)
    p.append(-20 * r0 + 10 * r1 - 2 * r2 + r3 / 6)
    return np.array(p).T.tolist()


class Inputs:
    """Sampled inputs made continuous; a derivative with a column of its own has its own curve."""

    def __init__(self, times, values, value_rates):
        self.start, self.count = times[0], len(times)
        self.interval = (times[-1] - times[0]) / (len(times) - 1)
        if np.max(np.abs(times - self.start - self.interval * np.arange(len(times)))) > 0.01 * self.interval:
            sys.exit("the times are not evenly spaced, or more than one record is in the file")
        self.values = [spline(v) for v in values]
        self.rates = [None if r is None else spline(r) for r in value_rates]

    def at(self, t):
        """Value, first and second derivative of each input."""
        place = (t - self.start) / self.interval
        k = min(max(int(place), 0), self.count - 2)
        found = []
        for values, rates_ in zip(self.values, self.rates):
            value, first, second = polynomial(values[k], place - k)
            first, second = first / self.interval, second / self.interval**2
            if rates_ is not None:
                first, second, _ = polynomial(rates_[k], place - k)
                second /= self.interval
            found.append((value, first, second))
        return found


def polynomial(p, s):
    """Value and two derivatives."""
    value = first = half = 0.0
    for coefficient in reversed(p):
        half = half * s + first
        first = first * s + value
        value = value * s + coefficient
    return value, first, 2 * half


# ---- Motion between, at and on the surfaces.

MOST_CHANGES = 64  # within an interval
RESOLUTION = 1e-12


class Motion:
    """Which sign is held at each surface, and which surfaces the motion is stuck on."""

    def __init__(self, inputs):
        self.inputs = inputs
        self.side = [0.0] * len(SLIDES)
        self.stuck = [False] * len(SLIDES)

    def effects(self, t, X, active):
        """Rates with some signs at zero, the slopes of their surfaces then, and what each sign adds to both."""
        U, s = self.inputs.at(t), list(self.side)
        for k in active:
            s[k] = 0.0
        f = np.array(rates(t, X, U, s))
        if not active:
            return f, None, None, None
        base = surface_rates(t, X, U, s, f)
        columns, effect = [], np.empty((len(active), len(active)))
        for j, k in enumerate(active):
            s[k] = 1.0
            rate = np.array(rates(t, X, U, s))
            moved = surface_rates(t, X, U, s, rate)
            s[k] = 0.0
            columns.append(rate - f)
            effect[:, j] = [moved[i] - base[i] for i in active]
        return f, np.array([base[k] for k in active]), columns, effect

    def stuck_list(self):
        return [k for k, stuck in enumerate(self.stuck) if stuck]

    def __call__(self, t, X):
        """The rates; stuck signs take the values that keep their surfaces at zero."""
        X = [float(x) for x in X]
        active = self.stuck_list()
        f, slope, columns, effect = self.effects(t, X, active)
        if active:
            for k, sign, column in zip(active, np.linalg.lstsq(effect, -slope, rcond=1e-10)[0], columns):
                self.side[k] = float(sign)
                f = f + sign * column
        return f

    def shown(self, t, X):
        """A sample of the response: the states, then the outputs."""
        if any(self.stuck):
            self(t, X)
        return np.append(X, outputs(t, [float(x) for x in X], self.inputs.at(t), self.side))

    def surfaces(self, t, X):
        return surfaces(t, [float(x) for x in X], self.inputs.at(t), self.side)

    def project(self, t, X):
        """The state moved back on to the surfaces that it is stuck on."""
        active = self.stuck_list()
        if not active:
            return X
        _, _, columns, effect = self.effects(t, [float(x) for x in X], active)
        g = self.surfaces(t, X)
        moves = np.linalg.lstsq(effect, np.array([-g[k] for k in active]), rcond=1e-10)[0]
        return X + sum(move * column for move, column in zip(moves, columns))

    def settle(self, t, X, changed):
        """Decides between passing and sticking for surfaces at zero; `changed` has just come there.

        The signs for which each slope is zero, or points away from zero where its sign is at a bound, by projected
        Gauss-Seidel sweeps.
        """
        active = [k for k in range(len(SLIDES)) if self.stuck[k] or k == changed]
        if not active:
            return X
        before = [0.0 if self.stuck[k] else self.side[k] for k in active]
        s = [self.side[k] for k in active]
        _, slope, _, effect = self.effects(t, [float(x) for x in X], active)
        for _ in range(200):
            moved = 0.0
            for i, k in enumerate(active):
                rate = slope[i] + sum(effect[i, j] * s[j] for j in range(len(active)) if j != i)
                if effect[i, i] < 0:
                    needed = -rate / effect[i, i]
                    new = needed if abs(needed) < HOLD else min(max(needed, -1.0), 1.0)
                else:
                    new = -before[i] if k == changed and before[i] else np.sign(rate)
                moved = max(moved, abs(new - s[i]))
                s[i] = float(new)
            if len(active) < 2 or moved < 1e-14:
                break
        for i, k in enumerate(active):
            self.stuck[k] = bool(effect[i, i] < 0 and abs(s[i]) < HOLD and abs(s[i]) != 1)
            self.side[k] = s[i]
        return self.project(t, X)

    def ahead(self, k, t, X):
        """The sign of a surface that is passed, just after."""
        slope = surface_rates(t, [float(x) for x in X], self.inputs.at(t), self.side, self(t, X))[k]
        return float(np.sign(self.surfaces(t, X)[k] + 1e-6 * self.inputs.interval * slope))

    def begin(self, t, X):
        g = self.surfaces(t, X)
        self.side = [float(np.sign(value)) for value in g]
        self.stuck = [value == 0 and slides for value, slides in zip(g, SLIDES)]
        X = self.settle(t, X, None)
        for k in range(len(SLIDES)):
            if not self.stuck[k] and self.side[k] == 0:
                self.side[k] = self.ahead(k, t, X)
        return X

    def change(self, k, t, X):
        if self.stuck[k]:
            self.stuck[k] = False
            self.side[k] = float(np.sign(self.side[k]))
        elif SLIDES[k]:
            X = self.settle(t, X, k)
        else:
            self.side[k] = self.ahead(k, t, X)
        return X

    def distances(self, t, X):
        """What must stay positive for each surface: how far the motion is from a change."""
        if any(self.stuck):
            self(t, X)
        found = []
        for value, side, stuck in zip(self.surfaces(t, X), self.side, self.stuck):
            if stuck:
                found.append(HOLD * (1 + RESOLUTION) - abs(side))
            elif side == 0:
                # A surface that has been zero all along changes once it is not.
                found.append(-1.0 if value != 0 else 1.0)
            else:
                found.append(side * value)
        return found


def first_change(motion, solver, dense, before):
    """The surface that changes first within the solver's last step, and when; None where none does."""
    t0, t1 = solver.t_old, solver.t
    left = t0
    for place in (0.25, 0.5, 0.75, 1.0):
        right = t1 if place == 1 else t0 + place * (t1 - t0)
        after = motion.distances(right, dense(right))
        found = []
        for k in range(len(SLIDES)):
            if after[k] >= 0:
                continue
            if before[k] > 0:
                at = brentq(lambda t: motion.distances(t, dense(t))[k], left, right, xtol=1e-15, rtol=1e-15)
                found.append((at, k))
            else:
                found.append((left, k))
        if found:
            at, k = min(found)
            return k, at
        left, before = right, after
    return None


def simulate(inputs, X):
    """States and outputs at every sample."""
    times = inputs.start + inputs.interval * np.arange(inputs.count)
    motion = Motion(inputs)
    t, X = times[0], motion.begin(times[0], np.array(X, float))
    response, changes, changed_at = [motion.shown(t, X)], 0, 0
    tolerance = {"rtol": 1e-11, "atol": 1e-13 * np.array(SCALE), "max_step": inputs.interval}
    while len(response) < len(times):
        solver = DOP853(motion, t, X, times[-1], **tolerance)
        before = motion.distances(t, X)
        while len(response) < len(times):
            message = solver.step()
            if solver.status == "failed":
                sys.exit(f"the response leaves the finite numbers: {message}")
            dense = solver.dense_output()
            change = None
            if changes < MOST_CHANGES:
                change = first_change(motion, solver, dense, before)
            end = solver.t if change is None else change[1]
            while len(response) < len(times) and times[len(response)] <= end:
                at = times[len(response)]
                response.append(motion.shown(at, motion.project(at, dense(at))))
            if len(response) != changed_at:
                changes, changed_at = 0, len(response)
            if change is not None:
                t, X = end, motion.project(end, dense(end))
                X = motion.change(change[0], t, X)
                changes += 1
                break
            before = motion.distances(solver.t, solver.y)
            if changes >= MOST_CHANGES:
                # A motion that switches without end is followed less closely: its signs are read where it is.
                for k, value in enumerate(motion.surfaces(solver.t, solver.y)):
                    if not motion.stuck[k] and value != 0:
                        motion.side[k] = float(np.sign(value))
                t, X = solver.t, solver.y
                break
    return times, np.array(response)


# ---- Files.


def first_word(cell):
    cell = cell.strip().strip('"').lower()
    end = next((i for i, c in enumerate(cell) if not c.isalnum()), len(cell))
    return cell[:end]


def read_inputs(path):
    """Times and inputs of a CSV file, columns by their header's first words."""
    with open(path, newline="") as file:
        text = [line for line in file if line.strip() and line.lstrip()[0] not in "#%"]
    separator = next((c for c in ";\t," if c in text[0]), ",") if text else ","
    rows = list(csv.reader(text, delimiter=separator))
    columns = {"t": 0, **{f"u{j}": 1 + j for j in range(len(INPUT_NAMES))}}
    try:
        float(rows[0][0])
    except (ValueError, IndexError):
        header = [first_word(cell) for cell in rows.pop(0)] if rows else []
        wanted = {"t": ["t", "time"]}
        wanted.update({f"u{j}": names for j, names in enumerate(INPUT_NAMES)})
        wanted.update({f"du{j}": names for j, names in enumerate(RATE_NAMES)})
        columns = {}
        for key, names in wanted.items():
            name = next((name for name in names if name in header), None)
            if name is not None:
                columns[key] = header.index(name)
            elif not key.startswith("du"):
                sys.exit(f"{path}: the header names no column {' or '.join(names)}")
    if len(rows) < 2:
        sys.exit(f"{path}: fewer than two rows of numbers")
    try:
        series = {key: np.array([float(row[i]) for row in rows]) for key, i in columns.items()}
    except (ValueError, IndexError):
        sys.exit(f"{path}: a row has too few cells, or one that is no number")
    count = range(len(INPUT_NAMES))
    return Inputs(series["t"], [series[f"u{j}"] for j in count], [series.get(f"du{j}") for j in count])


def main():
    arguments = sys.argv[1:]
    if not arguments or len(arguments) not in (1, 2, 2 + len(STATES)):
        sys.exit(f"usage: {sys.argv[0]} INPUT.csv [RESPONSE.csv [INITIAL STATE]]")
    initial = [float(x) for x in arguments[2:]] or INITIAL
    times, response = simulate(read_inputs(arguments[0]), initial)
    out = open(arguments[1], "w") if len(arguments) > 1 else sys.stdout
    with out:
        print("t", *STATES, *OUTPUTS, sep=",", file=out)
        for t, X in zip(times.tolist(), response.tolist()):
            print(t, *X, sep=",", file=out)


if __name__ == "__main__":
    main()
