"""Population search: CMA-ES within bounds (Suyama 2023)."""
