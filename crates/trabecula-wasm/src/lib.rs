//! The core as WebAssembly: a page asks in JSON, with bytes where there are files, and is answered alike.
//!
//! The page writes a request into the buffer of [`reserve`], calls [`ask`] and reads the answer at [`answer`]. A request is a line of
//! JSON and, after a line feed, bytes; an answer is a line of JSON, spaces up to a multiple of eight bytes, and bytes. The tour:
//!
//! - `requests`: what can be asked, and the answers.
//! - `resolution`: at which spacing a mesh is made: the rules of the command.
//! - `corners`: a mesh as the arrays that a graphics card draws.
//! - `rays`: textures by which it marches rays through a solid that has no mesh.
//! - `edit`: one value of a design's text changed, its comments kept.

use std::cell::RefCell;

mod corners;
mod edit;
mod rays;
mod requests;
mod resolution;

use requests::Session;

/// What the page lends: the worker's own functions.
#[cfg(target_arch = "wasm32")]
mod host {
    #[link(wasm_import_module = "host")]
    #[allow(unsafe_code)] // Foreign functions are declared so; these take numbers alone.
    unsafe extern "C" {
        /// `done` of `total` steps of the work are done.
        pub safe fn progress(done: f64, total: f64);
        /// The core failed by a mistake of ours: the text at this address.
        pub safe fn failed(text: *const u8, length: usize);
    }
}

/// Elsewhere nobody listens.
#[cfg(not(target_arch = "wasm32"))]
mod host {
    pub fn progress(_: f64, _: f64) {}
    pub fn failed(_: *const u8, _: usize) {}
}

thread_local! {
    static SESSION: RefCell<Session> = RefCell::default();
    static INPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static OUTPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// The address of `size` bytes for the next request.
#[allow(unsafe_code)] // The attribute alone: a name for the page.
#[unsafe(no_mangle)]
pub extern "C" fn reserve(size: usize) -> *mut u8 {
    INPUT.with_borrow_mut(|input| {
        *input = vec![0; size];
        input.as_mut_ptr()
    })
}

/// Answers the request in the buffer; gives the size of the answer in bytes.
#[allow(unsafe_code)] // As above.
#[unsafe(no_mangle)]
pub extern "C" fn ask() -> usize {
    std::panic::set_hook(Box::new(|info| {
        let text = info.to_string();
        host::failed(text.as_ptr(), text.len());
    }));
    let request = INPUT.take();
    let made = SESSION.with_borrow_mut(|session| session.answer(&request));
    OUTPUT.with_borrow_mut(|output| {
        *output = made;
        output.len()
    })
}

/// The address of the answer.
#[allow(unsafe_code)] // As above.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    OUTPUT.with_borrow(|output| output.as_ptr())
}
