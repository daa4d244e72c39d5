"""The figures of the paper, each drawn from kept trainings of its scenes."""
