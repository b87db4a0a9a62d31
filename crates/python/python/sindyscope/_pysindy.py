"""Models of the package PySINDy, taken over and given back."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from ._error import Error
from ._results import Model

if TYPE_CHECKING:
    from collections.abc import Sequence

_FUNCTIONS = {"sign": "sgn", "sgn": "sgn", "sin": "sin", "cos": "cos", "exp": "exp", "log": "log", "abs": "abs"}


def _term(text: str, names: dict[str, str]) -> str:
    """One name of PySINDy's library as a term: ``1``, ``x0 x1^2``, ``sin(1 x0)``, ``|x1|``."""

    def known(match: re.Match[str]) -> str:
        word = match.group(0)
        if word in names:
            return names[word]
        if word in _FUNCTIONS:
            return _FUNCTIONS[word]
        raise Error(f"the term `{text}` uses `{word}`, which no term here knows", "leave it out of the library")

    written = re.sub(r"[A-Za-z_]\w*", known, text.strip()).replace("**", "^")
    # A blank multiplies; between a number and what it scales as well.
    written = re.sub(r"(?<=[\w)|])\s+(?=[\w(|])", "*", written)
    return written


def _names(features: Sequence[str], states: Sequence[str], inputs: int) -> dict[str, str]:
    controls = ["u"] if inputs == 1 else [f"u{k + 1}" for k in range(inputs)]
    return dict(zip(features, [*states, *controls]))


def from_pysindy(model: Any) -> Model:
    """A fitted model of PySINDy as equations here: simulated with dry friction, printed, exported.

    Where the first half of its states has the second half as rates, and nothing else (``x' = v``), the model is of second order;
    else of first order.

    Args:
        model: A fitted ``pysindy.SINDy``.

    Raises:
        Error: a term of its library that no term here knows.
    """
    coefficients = np.asarray(model.coefficients(), dtype=np.float64)
    library = list(model.get_feature_names())
    inputs = int(getattr(model, "n_control_features_", 0) or 0)
    features = list(getattr(model, "feature_names", None) or [])
    count = coefficients.shape[0]
    if len(features) < count + inputs:
        features = [f"x{k}" for k in range(count)] + [f"u{k}" for k in range(inputs)]
    half = count // 2

    def rate(state: int) -> dict[str, float]:
        return {name: float(c) for name, c in zip(library, coefficients[state]) if c != 0.0}

    def is_velocity(state: int) -> bool:
        (term, c), *more = list(rate(state).items()) or [("", 0.0)]
        return not more and term == features[half + state] and abs(c - 1.0) < 1e-2

    second = count % 2 == 0 and count > 0 and all(is_velocity(k) for k in range(half))
    if second:
        numbers = [""] if half == 1 else [str(k + 1) for k in range(half)]
        states = [f"x{n}" for n in numbers] + [f"v{n}" for n in numbers]
    else:
        states = ["x"] if count == 1 else [f"x{k + 1}" for k in range(count)]
    names = _names(features, states, inputs)
    wanted = range(half, count) if second else range(count)
    equations = [{_term(name, names): c for name, c in rate(k).items()} for k in wanted]
    return Model.of(equations, inputs=inputs, kind="second-order" if second else "first-order")


def to_pysindy(model: Model) -> Any:
    """A model as a fitted ``pysindy.SINDy`` that predicts and prints the same equations; needs the package ``pysindy``.

    Raises:
        Error: a term that PySINDy's library cannot hold: another than products of powers of states and inputs.
    """
    import pysindy

    states, inputs = list(model.states), model.inputs
    controls = [] if not inputs else ["u"] if inputs == 1 else [f"u{k + 1}" for k in range(inputs)]
    variables = states + controls
    powers: dict[str, tuple[int, ...]] = {}
    for equation in model.equations.values():
        for term in equation:
            powers[term] = _powers(term, variables)
    degree = max([sum(p) for p in powers.values()] + [1])
    library = pysindy.PolynomialLibrary(degree=degree)
    theirs = pysindy.SINDy(feature_library=library)
    # Enough random samples for the library to take its shape; the coefficients are put in afterwards.
    random = np.random.default_rng(0)
    samples = random.normal(size=(20 * (1 + len(variables)) ** degree, len(states)))
    drive = random.normal(size=(len(samples), inputs)) if inputs else None
    named = {"feature_names": variables}
    try:
        theirs.fit(samples, t=1.0, x_dot=samples, u=drive, **named)
    except TypeError:
        theirs.feature_names = variables
        theirs.fit(samples, t=1.0, x_dot=samples, u=drive)
    held = [tuple(int(p) for p in row) for row in theirs.feature_library.powers_]
    matrix = np.zeros((len(states), len(held)))
    for row, equation in enumerate(model.equations.values()):
        for term, coefficient in equation.items():
            matrix[row, held.index(powers[term])] = coefficient
    optimizer = getattr(theirs.optimizer, "optimizer", theirs.optimizer)
    optimizer.coef_ = matrix
    optimizer.ind_ = matrix != 0.0
    return theirs


def _powers(term: str, variables: Sequence[str]) -> tuple[int, ...]:
    """The exponents of a product of powers: of ``x^2*v``, 2 and 1."""
    exponents = dict.fromkeys(variables, 0)
    for factor in term.split("*"):
        base, _, power = factor.partition("^")
        if base == "1" and not power:
            continue
        if base not in exponents or not (power or "1").isdigit():
            raise Error(f"PySINDy's polynomial library cannot hold the term `{term}`", "leave it out")
        exponents[base] += int(power or "1")
    return tuple(exponents.values())
