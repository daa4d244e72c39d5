"""Touches from measurements: forward models, solver, nets, training and scores.

Names load on first use: a solver never imports what trains a net.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from models.answer import Answer as Answer
    from models.answer import balance as balance
    from models.answer import superpose as superpose
    from models.bound import cramer_rao as cramer_rao
    from models.bound import pixel_level as pixel_level
    from models.dataset import Dataset as Dataset
    from models.dataset_file import DatasetFile as DatasetFile
    from models.dataset_file import begin_dataset as begin_dataset
    from models.descent import covariance as covariance
    from models.estimate import Estimate as Estimate
    from models.estimate import Result as Result
    from models.forward import Forward as Forward
    from models.forward import LinearForward as LinearForward
    from models.knowledge import Prior as Prior
    from models.knowledge import prior as prior
    from models.large import LargeForward as LargeForward
    from models.large import LargePlate as LargePlate
    from models.large import large_gauges as large_gauges
    from models.large import large_plate as large_plate
    from models.matching import match as match
    from models.motions import Motions as Motions
    from models.motions import see_motions as see_motions
    from models.motions import with_tilts as with_tilts
    from models.net import NetOptions as NetOptions
    from models.net import predict as predict
    from models.occlusion import hidden_tiles as hidden_tiles
    from models.pattern import Pattern as Pattern
    from models.pattern import see_pattern as see_pattern
    from models.plan import Box as Box
    from models.plan import Lattice as Lattice
    from models.plan import Plan as Plan
    from models.robust import find_robust as find_robust
    from models.samples import Samples as Samples
    from models.samples import read_dataset as read_dataset
    from models.score import position_error as position_error
    from models.search import Search as Search
    from models.search import prepare_search as prepare_search
    from models.search import renewed as renewed
    from models.solver import find as find
    from models.solver import solve as solve
    from models.strain_gauges import gauges as gauges
    from models.strain_map import StrainMap as StrainMap
    from models.strain_map import see_strain as see_strain

_HOMES = {
    "answer": ("Answer", "balance", "superpose"),
    "bound": ("cramer_rao", "pixel_level"),
    "dataset": ("Dataset",),
    "dataset_file": ("DatasetFile", "begin_dataset"),
    "descent": ("covariance",),
    "estimate": ("Estimate", "Result"),
    "forward": ("Forward", "LinearForward"),
    "strain_gauges": ("gauges",),
    "knowledge": ("Prior", "prior"),
    "large": ("LargeForward", "LargePlate", "large_gauges", "large_plate"),
    "matching": ("match",),
    "net": ("NetOptions", "predict"),
    "motions": ("Motions", "see_motions", "with_tilts"),
    "occlusion": ("hidden_tiles",),
    "pattern": ("Pattern", "see_pattern"),
    "plan": ("Box", "Lattice", "Plan"),
    "robust": ("find_robust",),
    "samples": ("Samples", "read_dataset"),
    "score": ("position_error",),
    "search": ("Search", "prepare_search", "renewed"),
    "solver": ("find", "solve"),
    "strain_map": ("StrainMap", "see_strain"),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'models' has no attribute {name!r}")
    return getattr(import_module(f"models.{_HOME_OF[name]}"), name)
