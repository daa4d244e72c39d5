"""The paper's systems, trained anew."""
