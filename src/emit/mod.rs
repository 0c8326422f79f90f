//! Stage 12: bytes of the output files.
