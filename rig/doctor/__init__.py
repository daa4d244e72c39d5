"""What a bench finds on this machine, what it lacks, and how to mend that."""
