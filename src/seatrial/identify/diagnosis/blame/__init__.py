"""Whether an instrument is at fault, or the model: other instruments and other trials judge."""
