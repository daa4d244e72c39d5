"""What a bench finds on this machine, what it lacks, and the remedy."""
