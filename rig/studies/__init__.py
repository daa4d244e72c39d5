"""Studies that measure, each a program; `touchplate report` runs them and makes a page of them."""
