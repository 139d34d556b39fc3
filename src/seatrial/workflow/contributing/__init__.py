"""Whether a contributed ship file is fit for the library."""
