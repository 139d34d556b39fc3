"""Local and global optimisation by multiple shooting (You 2023)."""
