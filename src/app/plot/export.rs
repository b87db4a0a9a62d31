//! Pictures of pixels as PNG.

use std::path::Path;

use image::RgbaImage;

/// Writes a picture as PNG.
///
/// # Errors
/// The sentence to show: what could not be written, and why.
pub(crate) fn save_png(path: &Path, image: &RgbaImage) -> Result<(), String> {
    image
        .save_with_format(path, image::ImageFormat::Png)
        .map_err(|e| format!("the picture was not saved: {e}; choose another folder ({})", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_that_cannot_be_written_says_so() {
        let error = save_png(Path::new("/no/such/folder/a.png"), &RgbaImage::new(2, 2)).unwrap_err();
        assert!(error.contains("/no/such/folder/a.png"), "{error}");
    }
}
