//! Integer programmes.
