use trabecula::{cell::*,extract::*,lattice::*,map::*,grade::*,solid::*,field::*,math::*,region::*};
use std::sync::Arc;
struct Cube(f64);
impl Field for Cube {
    fn values(&self, points: &[Vec3], out: &mut [f64]) { points.iter().zip(out).for_each(|(p, o)| *o = p.iter().map(|x| (x - self.0).max(-x)).fold(f64::NEG_INFINITY, f64::max)); }
    fn gradients(&self, points: &[Vec3], values: &mut [f64], g: &mut [Vec3]) { self.values(points, values); g.fill([1.0,0.0,0.0]); }
    fn bound(&self, b: &Aabb) -> Interval { let (c, r) = (self.value(b.center()), norm(b.size()) / 2.0); Interval::new(c - r, c + r) }
}
impl Shape for Cube { fn bounds(&self)->Aabb{Aabb{min:[0.0;3],max:[self.0;3]}} fn planes(&self,_:usize,out:&mut Vec<f64>){out.extend([0.0,self.0]);} fn volume(&self)->Option<f64>{None} }
fn main(){
 let n:f64=std::env::args().nth(1).unwrap().parse().unwrap();
 let c=Cell::new(Series::new(named("gyroid").unwrap().terms()).unwrap());
 let l=Lattice::new(Arc::new(c),Map::Affine(Affine::rigid([1.0;3],[0.0;3],[0.0;3],&[]).unwrap()),Part::Lower,Level::Iso(Grade::Constant(0.0)));
 let solid=Solid{region:Arc::new(Cube(4.0)),field:Some(Arc::new(l)),wavelength:1.0};
 let mut f=std::fs::File::create(std::env::args().nth(2).unwrap()).unwrap();
 let t=std::time::Instant::now();
 let s=stream_stl(&solid,4.0/(n-1.0),&mut f,&Silent).unwrap();
 println!("{:?} {}",t.elapsed(),s.triangles);
}
