//! Quad Boolean: QuadMixer (Nuvoli et al., SIGGRAPH Asia 2019).
