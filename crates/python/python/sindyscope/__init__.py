"""Finds the equation of motion of a vibrating thing from its measurements, and names the physics that a model lacks.

Five lines, from a record to an equation that never saw the second one::

    import sindyscope
    found = sindyscope.identify("friction_noisy.csv", test="friction_noisy_test.csv")
    print(found)                      # the equation with standard errors
    found.test["rmse"]                # error on the record that was not fitted, in its unit
    missing = sindyscope.diagnose("friction_noisy.csv", test="friction_noisy_test.csv")

Records come from NumPy arrays (``identify(t, x, u)``), pandas or polars frames, files, or a list of any of these. Every result
has ``to_dict()``, which is the JSON of the command of the same name. Units are SI unless a heading or ``units`` says otherwise.
"""

from ._batch import Batch, batch
from ._error import Error
from ._native import __version__
from ._records import Record, records
from ._results import Diagnosis, Identification, Model, Response, Structure
from ._study import diagnose, effects, generate, identify, modes, read, report, scenarios
from ._estimator import SindyRegressor
from ._pysindy import from_pysindy, to_pysindy

__all__ = [
    "Batch",
    "Diagnosis",
    "Error",
    "Identification",
    "Model",
    "Record",
    "Response",
    "SindyRegressor",
    "Structure",
    "__version__",
    "batch",
    "diagnose",
    "effects",
    "from_pysindy",
    "generate",
    "identify",
    "modes",
    "read",
    "records",
    "report",
    "scenarios",
    "to_pysindy",
]
