"""Plate mechanics: plate and touches in; displacement and strain out.

Names load on first use: a linear plate never loads the shell.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
