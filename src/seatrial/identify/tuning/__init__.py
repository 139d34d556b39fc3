"""Fine-tuning within exploration ranges (Suyama 2023)."""
