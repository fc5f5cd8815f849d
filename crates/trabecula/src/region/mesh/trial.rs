//! Trial on files: TRIAL=dir cargo test trial -- --ignored --nocapture
use super::*;
#[test]
#[ignore]
fn trial() {
    let dir = std::env::var("TRIAL").unwrap();
    let only = std::env::var("ONLY").unwrap_or_default();
    let mut names: Vec<_> = std::fs::read_dir(dir)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    names.sort();
    for p in names {
        let ext = p.extension().unwrap().to_string_lossy().to_lowercase();
        if ext == "md" || !p.to_string_lossy().contains(&only) {
            continue;
        }
        let mesh = crate::io::read_mesh(&std::fs::read(&p).unwrap(), &ext)
            .unwrap()
            .mesh;
        let b = mesh.bounds();
        let n = mesh.triangles.len();
        let vol = mesh.volume();
        let t = std::time::Instant::now();
        match MeshRegion::new(mesh, Repair::Auto) {
            Ok(r) => {
                println!(
                    "{}: {n} tri, size {:?}, vol {} -> {} tri, vol {}, normals {}, {:?}\n   {:?}",
                    p.file_name().unwrap().to_string_lossy(),
                    b.size(),
                    vol,
                    r.mesh.triangles.len(),
                    r.volume,
                    r.winding.is_none(),
                    t.elapsed(),
                    r.repaired.sentence()
                );
                // integrality
                let mut seed = 3;
                let w = Winding::new(&r.tree);
                let (mut worst, mut worst_fast) = (0.0f64, 0.0f64);
                for i in 0..2000 {
                    let p = [0, 1, 2].map(|a| {
                        b.center()[a] + b.size()[a] * 0.6 * crate::region::tests::random(&mut seed)
                    });
                    let fast = w.at(&r.tree, p, 2.0, |_| false);
                    let exact = if i < 200 {
                        w.at(&r.tree, p, 1e9, |_| false)
                    } else {
                        fast
                    };
                    worst = worst.max((exact - exact.round()).abs());
                    worst_fast = worst_fast.max((fast - fast.round()).abs());
                    let d = r.value(p);
                    assert!(d == 0.0 || (d < 0.0) == (fast > 0.5), "{p:?} {d} {fast}");
                }
                println!("   integrality {worst:e} fast {worst_fast:e}");
            }
            Err(e) => println!(
                "{}: {n} tri, size {:?} REFUSED {} ({:?})",
                p.file_name().unwrap().to_string_lossy(),
                b.size(),
                e,
                t.elapsed()
            ),
        }
    }
}
