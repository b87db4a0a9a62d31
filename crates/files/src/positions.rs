//! Where sensors stand, as the head of a text file says: `# position: a1=0,0.5; a2=0,1.0`.

use std::path::Path;

/// Lines of a file's head that are looked at, and bytes of it.
const LINES: usize = 200;
const BYTES: usize = 1 << 16;

/// What the comments of a text say of the sensors' positions, joined by `;`; none where they say nothing.
pub fn position_comments(text: &str) -> Option<String> {
    let of = |line: &str| {
        let comment = line.trim().strip_prefix(['#', '%'])?.trim_start();
        let (key, rest) = comment.split_once(':')?;
        matches!(key.trim().to_ascii_lowercase().as_str(), "position" | "positions").then(|| rest.trim().to_owned())
    };
    let found: Vec<String> = text.lines().take(LINES).filter_map(of).collect();
    (!found.is_empty()).then(|| found.join("; "))
}

/// The same of a file; none of one that cannot be read, or is no text.
pub fn positions_in(path: &Path) -> Option<String> {
    let bytes = sindyscope_system::fs::read(path).ok()?;
    position_comments(&String::from_utf8_lossy(&bytes[..bytes.len().min(BYTES)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_tell_where_sensors_stand() {
        let text = "# a tower\n# position: a1=0,0.5\n% Positions : a2=0,1.0; a3=0,1.5\nt,a1,a2,a3\n0,1,2,3\n";
        assert_eq!(position_comments(text).as_deref(), Some("a1=0,0.5; a2=0,1.0; a3=0,1.5"));
        assert_eq!(position_comments("# made: today\nt,position: x\n"), None);
    }
}
