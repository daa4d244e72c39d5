"""Touches from measurements: forward models, solver, nets, training and scores.

Names load on first use: a solver never imports what trains a net.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
