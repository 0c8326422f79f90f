//! Stage 11: what is reported about a compiled mission.
