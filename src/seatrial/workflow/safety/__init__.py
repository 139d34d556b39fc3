"""What a safety case has beside its runs: stacks in processes of their own."""
