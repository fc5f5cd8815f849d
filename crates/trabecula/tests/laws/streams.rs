//! A mesh that is written while it is made is, byte by byte, the file of the mesh in memory.

use std::io::Cursor;

use geometry::formats::{Metadata, write_mesh};
use geometry::progress::{Progress, Silent, Stopped};
use trabecula::cell::Part;
use trabecula::design::{Design, NoFiles};
use trabecula::extract::GridSurface;
use trabecula::surface_maker::{Islands, ScratchStores, Store, Summary, SurfaceMaker, SurfaceOptions, stream_mesh};

use crate::common::{ball, lattice, solid};
use crate::islands::Until;

/// The file that a method streams, and what it says of it.
fn streamed(
    maker: &dyn SurfaceMaker,
    suffix: &str,
    options: &SurfaceOptions,
    progress: &dyn Progress,
) -> Result<(Vec<u8>, Summary), Stopped> {
    let mut files = [0; 3].map(|_| Cursor::new(Vec::new()));
    let scratch: ScratchStores = files.each_mut().map(|f| f as &mut dyn Store);
    let mut out = Vec::new();
    let found = stream_mesh(maker, options, (suffix, &meta()), scratch, &mut out, progress)?;
    Ok((out, found))
}

fn meta() -> Metadata {
    Metadata { title: "Part".into(), design: "schema = 1 # <&>".into(), application: "laws".into() }
}

/// Holds the streamed files of a solid to those of its mesh, for one thread and for three; gives the number of pieces dropped.
fn held(maker: &dyn SurfaceMaker, options: &SurfaceOptions) -> u64 {
    let made = maker.mesh(options, &Silent).expect("mesh");
    for suffix in ["3mf", "ply", "obj"] {
        let mut whole = Vec::new();
        write_mesh(&made.surface.mesh, suffix, &meta(), &mut whole).expect("memory");
        let (file, found) = streamed(maker, suffix, options, &Silent).expect("streamed");
        assert!(file == whole, "{suffix}: {} bytes for {}", file.len(), whole.len());
        assert_eq!((found.triangles, found.components), (made.surface.mesh.triangles.len() as u64, made.components));
    }
    made.components.dropped
}

fn of_threads(count: usize, work: impl FnOnce() + Send) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("pool");
    pool.install(work);
}

/// Several layers of tiles; a network below its limit is loose blobs, which are dropped all over them.
#[test]
fn files_of_a_grid_are_those_of_its_mesh() {
    let blobs = lattice("primitive", Part::Lower, 0.1, [1.0, 1.1, 0.9], [5.0, 15.0, 25.0]);
    let solid = solid(ball([0.0; 3], 1.7), Some(blobs));
    for threads in [1, 3] {
        of_threads(threads, || {
            let dropped = [Islands::Keep, Islands::DropSmall, Islands::Drop].map(|islands| {
                let options = SurfaceOptions { resolution: 0.02, islands };
                held(&GridSurface(&solid), &options)
            });
            assert!(dropped[0] == 0 && dropped[2] > 10, "{dropped:?}");
        });
    }
}

/// Over tetrahedra, and beams by their own patches.
#[test]
fn files_of_tetrahedra_and_beams_are_those_of_their_meshes() {
    let built = |more: &str| {
        let text = format!("schema = 1\n[region.box]\nsize = [12, 12, 12]\n{more}");
        Design::from_toml(&text).expect("text").build(&NoFiles).expect("built")
    };
    let tets = built(
        "[lattice.core]\npart = \"sheet\"\ncell.tet.name = \"diamond_sheet\"\nmap.tets.size = 5\nlevel.fraction = 0.3\n",
    );
    let beams = built("[beams.core]\ncell = \"bcc\"\nmap.affine.wavelength = 4\nradius = 0.3\n");
    of_threads(3, || {
        held(&*tets.surface(), &SurfaceOptions::new(0.3));
        held(&*beams.surface(), &SurfaceOptions::new(0.2));
    });
}

#[test]
fn progress_rises_to_the_end_and_stops_at_any_time() {
    let field = lattice("gyroid", Part::Upper, 0.15, [1.0, 1.1, 0.9], [5.0, 15.0, 25.0]);
    let solid = solid(ball([0.0; 3], 1.7), Some(field));
    // Within the tiles, while the file is written, never.
    for stop in [0.3, 0.9, 2.0] {
        let until = Until(stop, Default::default());
        let options = SurfaceOptions { resolution: 0.05, islands: Islands::Drop };
        let done = streamed(&GridSurface(&solid), "3mf", &options, &until);
        let last = *until.1.lock().expect("no other");
        match done {
            Ok(_) => assert!(last == 1.0 && stop > 1.0),
            Err(Stopped::Interrupted) => assert!(last > stop),
            Err(e) => panic!("{e:?}"),
        }
    }
}

/// A file that cannot be written is an error, whichever it is.
#[test]
fn failures_of_any_file_are_told() {
    struct Full;
    impl std::io::Read for Full {
        fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
            Ok(0)
        }
    }
    impl std::io::Write for Full {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::ErrorKind::StorageFull.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    impl std::io::Seek for Full {
        fn seek(&mut self, _: std::io::SeekFrom) -> std::io::Result<u64> {
            Ok(0)
        }
    }
    impl Store for Full {
        fn truncate_to(&mut self, _: u64) -> std::io::Result<()> {
            Ok(())
        }
    }
    let solid = solid(ball([0.0; 3], 1.0), None);
    for full in 0..4 {
        let (mut files, mut bad, mut out) = ([0; 3].map(|_| Cursor::new(Vec::new())), Full, Vec::new());
        let mut scratch: ScratchStores = files.each_mut().map(|f| f as &mut dyn Store);
        let mut refusing = Full;
        let out: &mut dyn std::io::Write = match full {
            3 => &mut refusing,
            n => {
                scratch[n] = &mut bad;
                &mut out
            }
        };
        let done =
            stream_mesh(&GridSurface(&solid), &SurfaceOptions::new(0.1), ("3mf", &meta()), scratch, out, &Silent);
        assert!(
            matches!(&done, Err(Stopped::Io(e)) if e.kind() == std::io::ErrorKind::StorageFull),
            "{full}: {done:?}"
        );
    }
}
