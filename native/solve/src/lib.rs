//! Sparse factorisation, integer programmes and matching, with no geometry in them.
