use trabecula::cell::*;
fn main(){
 let c=Cell::new(Series::new(named("gyroid").unwrap().terms()).unwrap());
 let n=2048; let u:Vec<[f64;3]>=(0..n).map(|i|{let i=i as f64;[i*0.0123,i*0.0321-3.0,i*0.001]}).collect();
 let mut v=vec![0.0;n]; let mut g=vec![[0.0;3];n];
 let t=std::time::Instant::now();
 for _ in 0..1000 { c.gradients(&u,&mut v,&mut g);} 
 println!("{:.2} ns/pt", t.elapsed().as_secs_f64()*1e9/(n as f64*1000.0));
}
