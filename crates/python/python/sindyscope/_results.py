"""What was found, as objects."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._error import Error

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._records import Record

    Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Response:
    """A simulated response."""

    #: Time of each sample, s, shape ``(n,)``.
    t: Array
    #: The names of the states: ``x1``, …, ``v1``, …
    names: tuple[str, ...]
    #: The states, shape ``(n, states)``; NaN from where the motion left all bounds.
    states: Array
    #: When it left all bounds, s; None if it never did.
    diverged_at: float | None

    def __getitem__(self, name: str) -> Array:
        """One state, shape ``(n,)``."""
        return np.asarray(self.states[:, self.names.index(name)])

    @property
    def x(self) -> Array:
        """Displacement (first order: state), shape ``(n,)`` or ``(n, masses)``."""
        return self._of("x")

    @property
    def v(self) -> Array:
        """Velocity, likewise."""
        return self._of("v")

    def _of(self, symbol: str) -> Array:
        places = [k for k, name in enumerate(self.names) if name.startswith(symbol)]
        chosen = self.states[:, places]
        return np.asarray(chosen[:, 0] if len(places) == 1 else chosen)


class Model:
    """Equations of motion: printed, simulated, taken apart."""

    def __init__(self, native: _native.NativeModel) -> None:
        self._native = native

    @classmethod
    def of(cls, equations: Sequence[dict[str, float]], *, inputs: int = 0, kind: str = "second-order") -> Model:
        """A model of known coefficients.

        Args:
            equations: Of each acceleration (second order) or state (first order), terms with coefficients: ``{"x": -400, "u": 1}``.
            inputs: Number of inputs.
            kind: ``"second-order"`` or ``"first-order"``.
        """
        each = [[(term, float(c)) for term, c in equation.items()] for equation in equations]
        return cls(_native.NativeModel.of_terms(kind == "second-order", inputs, each))

    @property
    def kind(self) -> str:
        """``"second-order"`` or ``"first-order"``."""
        return "second-order" if self._native.second_order else "first-order"

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return self._native.inputs

    @property
    def states(self) -> tuple[str, ...]:
        """The names of the states, in the order of the state vector."""
        return tuple(self._native.states())

    @property
    def equations(self) -> dict[str, dict[str, float]]:
        """The rate of each state as terms with coefficients, in the records' units."""
        return {state: {text: c for text, _, c, _ in terms} for state, terms in self._native.equations()}

    @property
    def latex(self) -> str:
        """The equations for a display."""
        return self._native.latex()

    @property
    def python(self) -> str:
        """The equations as a function for ``scipy.integrate.solve_ivp``."""
        return self._native.python()

    def simulate(
        self,
        u: Any = None,
        *,
        dt: float,
        samples: int | None = None,
        initial: Sequence[float] | None = None,
    ) -> Response:
        """The response along an input.

        Args:
            u: Input at each sample, shape ``(n,)`` or ``(n, inputs)``; left out for a model without inputs.
            dt: Sampling interval, s.
            samples: Number of samples, where there is no input.
            initial: State at the first sample, as :attr:`states` names it; left out: at rest.
        """
        if u is None:
            if self.inputs:
                raise Error(f"the model has {self.inputs} inputs, and none was given", "give `u`")
            if samples is None:
                raise Error("it is not said how long to simulate", "give `samples`")
            inputs = np.zeros((samples, 0))
        else:
            inputs = np.asarray(u, dtype=np.float64)
            inputs = inputs.reshape(-1, 1) if inputs.ndim == 1 else inputs
        start = np.zeros(len(self.states))
        if initial is not None:
            if len(initial) > len(start):
                raise Error(f"the model has {len(start)} states, and {len(initial)} values were given")
            start[: len(initial)] = initial
        states, diverged_at = self._native.simulate(np.ascontiguousarray(inputs), float(dt), start.tolist())
        return Response(dt * np.arange(len(states), dtype=np.float64), self.states, states, diverged_at)

    def to_sympy(self) -> dict[Any, Any]:
        """The equations for SymPy: the rate of each state as an expression of the symbols ``x``, ``v``, ``u``, ``du``, …; needs
        the package ``sympy``."""
        return {_symbol(state): _expression(terms) for state, terms in self._native.equations()}

    def __str__(self) -> str:
        return self._native.text()

    def __repr__(self) -> str:
        return f"<Model of {self.kind.replace('-', ' ')}: {', '.join(self.states)}>"

    def _repr_latex_(self) -> str:
        return f"$${self.latex}$$"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self._native.json() == other._native.json()

    def __hash__(self) -> int:
        return hash(self._native.json())

    def __reduce__(self) -> tuple[Any, ...]:
        return _model, (self._native.json(),)


def _model(text: str) -> Model:
    return Model(_native.NativeModel.of_json(text))


def _symbol(name: str) -> Any:
    import sympy

    return sympy.Symbol(name, real=True)


def _expression(terms: list[tuple[str, str, float, float | None]]) -> Any:
    import sympy

    # The term in Python's notation, whose functions are NumPy's.
    functions = {
        "sign": sympy.sign,
        "abs": sympy.Abs,
        "sin": sympy.sin,
        "cos": sympy.cos,
        "exp": sympy.exp,
        "log": sympy.log,
        "maximum": sympy.Max,
        "minimum": sympy.Min,
        "max": sympy.Max,
        "min": sympy.Min,
        "clip": lambda a, low, high: sympy.Max(low, sympy.Min(a, high)),
        "heaviside": lambda a, at_zero: sympy.Heaviside(a, at_zero),
        "sqrt": sympy.sqrt,
    }
    total = sympy.Float(0)
    for _, text, coefficient, _ in terms:
        plain = re.sub(r"\b(np|numpy|math)\.", "", text)
        names = set(re.findall(r"[A-Za-z_]\w*", plain)) - set(functions)
        symbols = {name: _symbol(name) for name in names}
        total += sympy.Float(coefficient, 17) * sympy.sympify(plain, locals={**functions, **symbols})
    return total


def _si(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


def _scaled(svg: str) -> str:
    """A figure that is never wider than its cell."""
    return f'<div style="max-width:160mm">{svg[svg.find("<svg"):]}</div>'


class Identification:
    """What :func:`sindyscope.identify` found."""

    def __init__(self, native: _native.NativeIdentification) -> None:
        self._kept: dict[str, Any] = {}
        self._found: _native.NativeIdentification | None = native
        self._json = native.json()
        self._dict: dict[str, Any] = json.loads(self._json)
        #: The equations.
        self.model = Model(native.model())

    def _of(self, what: str) -> Any:
        """Something that is drawn or copied only if it is wanted; what was pickled has it."""
        if what not in self._kept and self._found is not None:
            self._kept[what] = getattr(self._found, what)()
        return self._kept[what]

    def to_dict(self) -> dict[str, Any]:
        """The JSON of the command ``identify``, to the last digit."""
        found: dict[str, Any] = json.loads(self._json)
        return found

    def to_json(self) -> str:
        """The text that the command writes."""
        return self._json

    def to_row(self) -> dict[str, Any]:
        """The row that a table of many records has of it: errors, and a column for each coefficient and its standard error."""
        row: dict[str, Any] = json.loads(self._of("row"))
        return row

    @property
    def status(self) -> str:
        """``"ok"``, or ``"diverged"``: the fit stands, its simulation left the data's range."""
        return str(self._dict["status"])

    @property
    def equations(self) -> dict[str, dict[str, float]]:
        """The rate of each state as terms with coefficients, in the records' units."""
        return self.model.equations

    @property
    def settings(self) -> dict[str, Any]:
        """The settings it came from."""
        return dict(self._dict["settings"])

    @property
    def train(self) -> dict[str, Any]:
        """Errors on what was fitted: ``rmse`` and ``max_error`` in the first sensor's unit, ``nrmse``, ``best_fit`` in %, …"""
        return dict(self._dict["train"] or {})

    @property
    def test(self) -> dict[str, Any] | None:
        """Errors on what was held out; None where nothing was."""
        score: dict[str, Any] | None = self._dict["test"]
        return score

    @property
    def warnings(self) -> list[str]:
        """What is wrong or doubtful, worst first."""
        return [str(w["text"]) for w in self._dict["warnings"]]

    def simulate(self, u: Any = None, *, dt: float | None = None, **how: Any) -> Response:
        """The response along an input, from rest unless ``initial`` says otherwise; see :meth:`Model.simulate`. ``dt`` is that of
        the first record unless it is given."""
        interval = self._of("starts")[0][1] if dt is None else dt
        return self.model.simulate(u, dt=interval, **how)

    def follow(self, records: Sequence[Record]) -> list[Array]:
        """The response along each record from the initial state that fits its beginning best, as held-out records are scored: what
        the first sensor would show."""
        return self.model._native.follow([r._native for r in records], self._of("smoothing"))

    def to_sympy(self) -> dict[Any, Any]:
        """See :meth:`Model.to_sympy`."""
        return self.model.to_sympy()

    def svg(self) -> str:
        """The measured and the simulated response of the first record, and the error, as an SVG document."""
        return str(self._of("svg"))

    def plot(self, record: int = 0, axes: Any = None) -> Any:
        """Draws the measured and the simulated response with matplotlib; returns the axes (response above, error below)."""
        import matplotlib.pyplot as plt

        name, usage, channel, unit, t, measured, simulated = self._of("curves")[record]
        if axes is None:
            _, axes = plt.subplots(2, 1, sharex=True, height_ratios=(2, 1), layout="constrained")
        upper, lower = axes
        until = len(simulated)
        upper.plot(t, measured, label="measured", color="0.4")
        upper.plot(t[:until], simulated, label="identified", linewidth=1)
        lower.plot(t[:until], np.abs(measured[:until] - simulated), linewidth=1)
        upper.set(ylabel=f"{channel} ({unit})" if unit else channel, title=f"{name} ({usage})")
        lower.set(ylabel="error", xlabel="t (s)")
        upper.legend()
        return axes

    def __str__(self) -> str:
        return str(self.model)

    def __repr__(self) -> str:
        test = "" if self.test is None else f", held out {_si(self.test['rmse'])}"
        return f"<Identification ({self.status}): RMSE {_si(self.train.get('rmse'))}{test}>\n{self.model}"

    def _repr_html_(self) -> str:
        rows = [("fitted", self.train), *([("held out", self.test)] if self.test else [])]
        cells = "".join(
            f"<tr><th>{what}</th><td>{_si(s.get('rmse'))}</td><td>{_si(s.get('nrmse'))}</td>"
            f"<td>{_si(s.get('max_error'))}</td><td>{_si(s.get('best_fit'))} %</td></tr>"
            for what, s in rows
        )
        doubts = "".join(f"<li>{html.escape(text)}</li>" for text in self.warnings)
        return (
            f"<pre>{html.escape(str(self.model))}</pre>"
            "<table><tr><th></th><th>RMSE</th><th>NRMSE</th><th>largest error</th><th>best fit</th></tr>"
            f"{cells}</table>" + (f"<ul>{doubts}</ul>" if doubts else "") + _scaled(self.svg())
        )

    def __getstate__(self) -> dict[str, Any]:
        kept = {what: self._of(what) for what in ("row", "svg", "curves", "smoothing", "starts")}
        return {"json": self._json, "model": self.model, "kept": kept}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._found = None
        self._json = state["json"]
        self._dict = json.loads(self._json)
        self.model = state["model"]
        self._kept = state["kept"]


class Diagnosis:
    """What :func:`sindyscope.diagnose` found."""

    def __init__(self, native: _native.NativeDiagnosis) -> None:
        self._json = native.json()
        self._dict: dict[str, Any] = json.loads(self._json)
        self._text = native.text()
        self._row = native.row()
        model = native.model()
        #: The final equations; None if no model could be fitted.
        self.model = None if model is None else Model(model)

    def to_dict(self) -> dict[str, Any]:
        """The JSON of the command ``diagnose``, to the last digit."""
        found: dict[str, Any] = json.loads(self._json)
        return found

    def to_json(self) -> str:
        """The text that the command writes."""
        return self._json

    def to_row(self) -> dict[str, Any]:
        """The row that a table of many records has of it: verdict, effects, errors, and a column for each parameter and its standard
        error."""
        row: dict[str, Any] = json.loads(self._row)
        return row

    @property
    def verdict(self) -> str:
        """``"named"``, ``"ambiguous"``, ``"unexplained"`` or ``"nothing_missing"``."""
        return str(self._dict["verdict"])

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        return str(self._dict["sentence"])

    @property
    def effects(self) -> list[str]:
        """The effects that were added, in their order."""
        return [str(step["effect"]) for step in self._dict["steps"]]

    @property
    def steps(self) -> list[dict[str, Any]]:
        """Each effect with its terms, parameters, gap and evidence."""
        return list(self._dict["steps"])

    @property
    def description(self) -> dict[str, Any] | None:
        """The shortest formula for what no effect closes, a description and not a law; None where there is none."""
        found: dict[str, Any] | None = self._dict["description"]
        return found

    def simulate(self, u: Any = None, *, dt: float, **how: Any) -> Response:
        """The response of the final equations; see :meth:`Model.simulate`."""
        if self.model is None:
            raise Error("no model could be fitted", "")
        return self.model.simulate(u, dt=dt, **how)

    def to_sympy(self) -> dict[Any, Any]:
        """The final equations; see :meth:`Model.to_sympy`."""
        return {} if self.model is None else self.model.to_sympy()

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"<Diagnosis ({self.verdict}): {', '.join(self.effects) or 'no effect'}>\n{self.sentence}"

    def _repr_html_(self) -> str:
        return f"<p>{html.escape(self.sentence)}</p><pre>{html.escape(self._text)}</pre>"


class Structure:
    """What :func:`sindyscope.modes` found: modes with their errors, and the force that they lack where that was searched for."""

    def __init__(self, result: str, text: str) -> None:
        self._json, self._text = result, text
        self._dict: dict[str, Any] = json.loads(result)

    def to_dict(self) -> dict[str, Any]:
        """The JSON of the command with ``--base modes``."""
        found: dict[str, Any] = json.loads(self._json)
        return found

    @property
    def modes(self) -> list[dict[str, Any]]:
        """The modes in the band that is driven: ``frequency`` (Hz), ``damping`` (ratio), ``shape`` and ``phase`` over the sensors,
        and standard errors."""
        return list(self.to_dict()["modes"])

    @property
    def frequencies(self) -> Array:
        """Natural frequencies, Hz, shape ``(modes,)``."""
        return np.array([mode["frequency"] for mode in self._dict["modes"]], dtype=np.float64)

    @property
    def damping(self) -> Array:
        """Damping ratios, shape ``(modes,)``."""
        return np.array([mode["damping"] for mode in self._dict["modes"]], dtype=np.float64)

    @property
    def shapes(self) -> Array:
        """Mode shapes, real parts, the largest of each 1: shape ``(modes, sensors)``."""
        shapes = [np.multiply(mode["shape"], np.cos(mode["phase"])) for mode in self._dict["modes"]]
        return np.array(shapes, dtype=np.float64)

    @property
    def records(self) -> list[dict[str, Any]]:
        """Of each record the error of every sensor along it."""
        return list(self.to_dict()["records"])

    @property
    def verdict(self) -> str | None:
        """What the search for a missing force came to, as of :class:`Diagnosis`; None where there was none."""
        said: str | None = self._dict.get("verdict")
        return said

    @property
    def missing(self) -> list[dict[str, Any]]:
        """The force that the modes lack, with ``effect``, ``place`` and ``parameters``; empty where there is none."""
        return list(self.to_dict().get("steps", []))

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        listed = ", ".join(f"{f:.4g} Hz" for f in self.frequencies)
        return f"<Structure of {len(self.frequencies)} modes: {listed}>"

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self._text)}</pre>"
