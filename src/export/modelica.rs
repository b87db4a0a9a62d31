use super::Export;
use super::switched::Switched;
pub(super) fn program(_: &Export<'_>, _: &Switched, _: &str) -> String {
    String::new()
}
