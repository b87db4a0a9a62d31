//! The window on a web page.

use std::cell::{Cell, RefCell};
use std::path::PathBuf;

use eframe::wasm_bindgen::JsValue;
use eframe::web_sys::HtmlCanvasElement;
use egui::accesskit::TreeUpdate;
use egui::{Context, DroppedFileHandle, FullOutput, Plugin};
use serde_json::json;

use super::{App, State, session};
use sindyscope_system::{browser, fs};

thread_local! {
    /// True until it was told that the page computes by itself.
    static LIMITED: Cell<bool> = const { Cell::new(false) };
    static SHOWN: RefCell<(Option<Context>, Option<TreeUpdate>)> = const { RefCell::new((None, None)) };
}

/// Opens the window on a canvas, as it was left; the page goes on drawing it.
///
/// # Errors
/// The browser cannot draw it.
pub async fn run_on_page(canvas: HtmlCanvasElement) -> Result<(), JsValue> {
    let session = session::file();
    // Files that were opened once and that nothing names any more only take room.
    let texts: Vec<String> = session.iter().filter_map(|path| fs::read_to_string(path).ok()).collect();
    browser::files::drop_unnamed(&texts);
    let create = move |cc: &eframe::CreationContext<'_>| -> Result<Box<dyn eframe::App>, _> {
        cc.egui_ctx.add_plugin(Describer);
        SHOWN.with_borrow_mut(|shown| shown.0 = Some(cc.egui_ctx.clone()));
        if !browser::has_workers() {
            LIMITED.set(true);
        }
        Ok(Box::new(match session {
            Some(session) => App::revived(&cc.egui_ctx, session, &[]),
            None => App::with_state(&cc.egui_ctx, State::default()),
        }))
    };
    let runner = eframe::WebRunner::new();
    browser::tell_panics();
    runner.start(canvas, eframe::WebOptions::default(), Box::new(create)).await?;
    // The page lives as long as the program.
    std::mem::forget(runner);
    Ok(())
}

/// What is on the page, as JSON: every labelled thing with its role and its place in points. Nothing at the first call, which asks for it.
pub fn described() -> String {
    SHOWN.with_borrow(|(ctx, tree)| {
        if let Some(ctx) = ctx {
            ctx.enable_accesskit();
            ctx.request_repaint();
        }
        let nodes = tree.iter().flat_map(|tree| &tree.nodes).filter_map(|(_, node)| {
            let (text, bounds) = (node.label().or(node.value())?, node.bounds()?);
            let value = node.value().map(str::to_owned).or(node.numeric_value().map(|v| v.to_string()));
            Some(json!({
                "text": text,
                "value": value,
                "role": format!("{:?}", node.role()),
                "disabled": node.is_disabled(),
                "rect": [bounds.x0, bounds.y0, bounds.x1, bounds.y1],
            }))
        });
        let pixels = ctx.as_ref().map(|ctx| ctx.zoom_factor());
        json!({ "zoom": pixels, "nodes": nodes.collect::<Vec<_>>() }).to_string()
    })
}

/// The title of the browser's tab.
pub(super) fn set_title(_ctx: &Context, title: &str) {
    if let Some(document) = eframe::web_sys::window().and_then(|window| window.document()) {
        document.set_title(title);
    }
}

/// What went wrong beside the window, in sentences.
pub(super) fn complaints() -> Vec<String> {
    let unkept = browser::unkept().map(|reason| {
        format!("This browser does not keep your work: {reason}; save the project before you leave the page")
    });
    let crashed = browser::crashed().map(|reason| {
        format!("A computation ended by an error of the program itself ({reason}); reload the page: your work is kept")
    });
    let limited = LIMITED.take().then(|| {
        let told = "The browser gives this page one core only, since it came neither by https nor from this computer itself: \
                    the page stands still while it searches";
        told.to_owned()
    });
    limited.into_iter().chain(unkept).chain(crashed).collect()
}

/// Files that were dropped on the page, with the paths under which they are kept.
pub(super) async fn received(dropped: Vec<DroppedFileHandle>) -> Option<Vec<PathBuf>> {
    let mut files = Vec::with_capacity(dropped.len());
    for file in dropped {
        // What cannot be read is a folder.
        if let Ok(bytes) = file.bytes_async().await {
            files.push((file.path().to_string_lossy().into_owned(), bytes));
        }
    }
    Some(browser::files::place(files)).filter(|paths| !paths.is_empty())
}

/// Keeps what is on the page in words, once they are asked for.
struct Describer;

impl Plugin for Describer {
    fn debug_name(&self) -> &'static str {
        "describer"
    }

    fn output_hook(&mut self, _ctx: &Context, output: &mut FullOutput) {
        if let Some(update) = output.platform_output.accesskit_update.take() {
            SHOWN.with_borrow_mut(|shown| shown.1 = Some(update));
        }
    }
}
