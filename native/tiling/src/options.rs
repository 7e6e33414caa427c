//! What the caller may choose.

/// Options of the functions that search for tilings. `Default` gives the recommended values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// Most memory for the states of the search, in bytes. Default 4 GiB.
    pub memory: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { memory: 4 << 30 }
    }
}
