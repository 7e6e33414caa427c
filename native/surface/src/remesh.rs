//! shim
use mesh::*;
pub struct RemeshOptions { pub split_chords: bool }
impl Default for RemeshOptions { fn default() -> Self { Self{split_chords:false} } }
pub struct Remeshed { pub mesh: TriangleMesh, pub vertex: Vec<u32>, pub source: Vec<u32> }
#[derive(Debug)] pub struct RemeshError;
impl std::fmt::Display for RemeshError { fn fmt(&self, f:&mut std::fmt::Formatter<'_>)->std::fmt::Result{write!(f,"x")}}
pub fn remesh(_m:&TriangleMesh,_f:&[[u32;2]],_s:&[f64],_o:&RemeshOptions,_mo:&Monitor)->Result<Remeshed,RemeshError>{unimplemented!()}
