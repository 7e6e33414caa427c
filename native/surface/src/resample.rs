//! shim
use mesh::*;
pub struct Chain { pub vertices: Vec<u32>, pub positions: Vec<f64> }
pub struct Resampled { pub mesh: TriangleMesh, pub vertex: Vec<u32>, pub source: Vec<u32>, pub chains: Vec<Vec<u32>> }
#[derive(Debug)] pub struct ResampleError;
impl std::fmt::Display for ResampleError { fn fmt(&self, f:&mut std::fmt::Formatter<'_>)->std::fmt::Result{write!(f,"x")}}
pub fn resample_chains(_m:&TriangleMesh,_c:&[Chain],_mo:&Monitor)->Result<Resampled,ResampleError>{unimplemented!()}
