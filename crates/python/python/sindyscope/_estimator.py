"""The study as an estimator of scikit-learn's kind, which it does not need to be installed for."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

import numpy as np

from ._error import Error
from ._records import Record, records
from ._study import identify

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._results import Identification, Model
    from ._settings import Number, Terms

    Array = npt.NDArray[np.float64]

try:
    from sklearn.base import BaseEstimator, RegressorMixin

    class _Estimator(RegressorMixin, BaseEstimator):  # type: ignore[misc, unused-ignore]
        """What scikit-learn's tools ask of an estimator beside its methods: tags, a picture."""

except ImportError:

    class _Estimator:  # type: ignore[no-redef]
        """Without scikit-learn nothing asks for it."""


class SindyRegressor(_Estimator):
    """Identifies ``y`` (the motion) driven by ``X`` (time, then inputs), for pipelines and searches over settings.

    ``X`` has shape ``(n, 1 + inputs)``: its first column is the time in s, so that folds which cut a hole into the record are
    seen as what they are, two records; shuffled rows are put in order. ``y`` has shape ``(n,)`` or ``(n, masses)``.

    Every parameter is a setting of :func:`sindyscope.identify`; what is None is chosen from the data.

    Attributes:
        result_: what was identified.
        model_: its equations.
        coef_: the coefficients of the first acceleration (first order: of the first state), in the order of ``terms_``.
        terms_: its terms.
    """

    def __init__(
        self,
        *,
        terms: Terms | None = None,
        lock: Terms | None = None,
        drop: Terms | None = None,
        constrain: str | None = None,
        mass: Number | None = None,
        differentiation: str | None = None,
        window: int | None = None,
        order: int | None = None,
        form: str | None = None,
        half_width: int | None = None,
        regressor: str | None = None,
        threshold: Number | None = None,
        ridge: Number | None = None,
        scaling: str | None = None,
        refine: bool | None = None,
        kind: str | None = None,
    ) -> None:
        self.terms = terms
        self.lock = lock
        self.drop = drop
        self.constrain = constrain
        self.mass = mass
        self.differentiation = differentiation
        self.window = window
        self.order = order
        self.form = form
        self.half_width = half_width
        self.regressor = regressor
        self.threshold = threshold
        self.ridge = ridge
        self.scaling = scaling
        self.refine = refine
        self.kind = kind

    @classmethod
    def _names(cls) -> list[str]:
        return sorted(name for name in inspect.signature(cls.__init__).parameters if name != "self")

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The settings by name."""
        return {name: getattr(self, name) for name in self._names()}

    def set_params(self, **params: Any) -> SindyRegressor:
        """Changes settings."""
        for name, value in params.items():
            if name not in self._names():
                raise ValueError(f"there is no parameter {name!r}; there are {', '.join(self._names())}")
            setattr(self, name, value)
        return self

    def _records(self, X: Any, y: Any) -> list[Record]:
        """The records of rows, put in the order of time."""
        X, y = np.asarray(X, dtype=np.float64), np.asarray(y, dtype=np.float64)
        if X.ndim != 2 or X.shape[1] < 1:
            raise Error("`X` is no matrix", "give (samples, 1 + inputs): the time in s, then the inputs")
        if len(X) != len(y):
            raise Error(f"`X` has {len(X)} rows, and `y` has {len(y)}", "")
        order = np.argsort(X[:, 0], kind="stable")
        X, y = X[order], y[order]
        given = X[:, 1:] if X.shape[1] > 1 else None
        settings: dict[str, Any] = {} if self.kind is None else {"kind": self.kind}
        return records(X[:, 0], y, given, name="fold", **settings)

    def fit(self, X: Any, y: Any) -> SindyRegressor:
        """Identifies the equation of motion.

        Args:
            X: Time in s and inputs, shape ``(n, 1 + inputs)``.
            y: The motion, shape ``(n,)`` or ``(n, masses)``.

        Raises:
            sindyscope.Error: the samples cannot be used, or settings do not go together.
        """
        found = self._records(X, y)
        settings = {name: value for name, value in self.get_params().items() if value is not None}
        self.result_: Identification = identify(found, **settings)
        self.model_: Model = self.result_.model
        self.n_features_in_ = int(np.shape(X)[1])
        states = self.model_.states
        first = "v" + states[0][1:] if self.model_.kind == "second-order" else states[0]
        equation = self.model_.equations[first]
        self.terms_ = list(equation)
        self.coef_ = np.array(list(equation.values()))
        return self

    def _fitted(self) -> Model:
        if not hasattr(self, "model_"):
            raise Error("nothing is fitted yet", "call fit first")
        return self.model_

    def predict(self, X: Any, initial: Any = None) -> Array:
        """The motion that the model has along a drive, by a free run.

        Args:
            X: Time in s (even) and inputs, shape ``(n, 1 + inputs)``.
            initial: State at the first sample; left out: at rest.

        Returns:
            The motion, shape ``(n,)`` or ``(n, masses)``.
        """
        model = self._fitted()
        X = np.asarray(X, dtype=np.float64)
        order = np.argsort(X[:, 0], kind="stable")
        steps = np.diff(X[order, 0])
        dt = float(np.median(steps)) if len(steps) else 1.0
        if len(steps) and np.any(np.abs(steps - dt) > 1e-3 * dt):
            raise Error("the time in `X` is not even", "predict stretches without gaps, each by itself")
        given = X[order, 1:] if X.shape[1] > 1 else None
        response = model.simulate(given, dt=dt, samples=len(X), initial=initial)
        motion = response.x if model.kind == "second-order" else response.states
        back = np.empty_like(motion)
        back[order] = motion
        return np.asarray(back)

    def score(self, X: Any, y: Any, sample_weight: Any = None) -> float:
        """R² of free runs along the records of ``X`` and ``y``, of which only the initial states are fitted: 1 is perfect, 0 as good
        as the mean; minus infinity where a run leaves all bounds. Of the first sensor."""
        self._fitted()
        found = self._records(X, y)
        residual = total = 0.0
        for record, response in zip(found, self.result_.follow(found)):
            measured = record[record.channels[0]]
            if len(response) < len(measured):
                return -np.inf
            residual += float(np.sum((measured - response) ** 2))
            total += float(np.sum((measured - measured.mean()) ** 2))
        return 1.0 - residual / total
