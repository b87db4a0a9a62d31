//! The window on a web page: empty where there is none, so that a machine without that target builds the rest.
//!
//! `page/` holds the page itself and what it does for the program: workers, kept files, downloads.

#![cfg(target_arch = "wasm32")]

use js_sys::Array;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};
use web_sys::HtmlCanvasElement;

/// Opens the window on a canvas, with the files that were kept: pairs of a path and bytes.
///
/// # Errors
/// The browser cannot draw it.
#[wasm_bindgen]
pub async fn open(canvas: HtmlCanvasElement, kept: Array) -> Result<(), JsValue> {
    sindyscope_system::browser::begin(&kept);
    sindyscope::app::run_on_page(canvas).await
}

/// What is on the page for whoever tests it or reads it aloud: from the second call on, every labelled thing with its place in
/// points, as JSON.
#[wasm_bindgen]
pub fn described() -> String {
    sindyscope::app::described()
}
