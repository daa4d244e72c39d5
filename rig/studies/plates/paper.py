"""The plate of the paper, which several studies load."""

import fe

PAPER = fe.Plate((100.0, 100.0), thickness=1.0, young=3000.0, poisson=0.3)
