//! Where the bytes of a stream come from: a growing file, standard input, datagrams, a serial line. Each is read by a thread of
//! its own, which hands on all that arrives, however long whoever takes it is busy.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

#[cfg(target_arch = "wasm32")]
mod absent;
#[cfg(not(target_arch = "wasm32"))]
mod native;
#[cfg(target_arch = "wasm32")]
pub use absent::Arriving;
#[cfg(not(target_arch = "wasm32"))]
pub use native::Arriving;

/// A source of rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StreamSource {
    /// A file that grows; one that is cut or replaced is read anew from its beginning, one that is not there yet is waited for.
    File(PathBuf),
    /// Standard input.
    Input,
    /// Datagrams to this address, one or more rows each.
    Udp(SocketAddr),
    /// A serial line of so many bits a second.
    Serial {
        /// The device.
        device: PathBuf,
        /// Bits a second.
        baud: u32,
    },
}

/// What a source tells.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// This has arrived.
    Bytes(Vec<u8>),
    /// What follows is read from the beginning again.
    Anew,
    /// The source is not there yet, or is gone and waited for: what is waited for.
    Waiting(String),
    /// Nothing comes any more.
    Ended,
    /// The source cannot be read: why.
    Failed(String),
}

/// Speed of a serial line of which none is said, bits a second.
const BAUD: u32 = 115_200;

impl FromStr for StreamSource {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "-" {
            return Ok(Self::Input);
        }
        if let Some(address) = text.strip_prefix("udp://") {
            // An address without a host is the machine itself.
            let address = if address.starts_with(':') { format!("127.0.0.1{address}") } else { address.to_owned() };
            let wrong = || format!("`{text}` is no address: write udp://ADDRESS:PORT, as udp://127.0.0.1:9000");
            return address.parse().map(Self::Udp).map_err(|_| wrong());
        }
        if let Some(line) = text.strip_prefix("serial://") {
            let (device, options) = line.split_once('?').unwrap_or((line, ""));
            let wrong = || format!("`{text}` is no serial line: write serial:///dev/ttyUSB0?baud=115200");
            let baud = match options {
                "" => BAUD,
                _ => options.strip_prefix("baud=").and_then(|b| b.parse().ok()).ok_or_else(wrong)?,
            };
            if device.is_empty() || baud == 0 {
                return Err(wrong());
            }
            return Ok(Self::Serial { device: device.into(), baud });
        }
        match text.split_once("://") {
            Some((scheme, _)) => Err(format!("`{scheme}` is no source: give a file, `-`, udp://… or serial://…")),
            None if text.is_empty() => Err("give a file, `-`, udp://ADDRESS:PORT or serial://DEVICE".into()),
            None => Ok(Self::File(text.into())),
        }
    }
}

impl fmt::Display for StreamSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Input => f.write_str("-"),
            Self::Udp(address) => write!(f, "udp://{address}"),
            Self::Serial { device, baud } => write!(f, "serial://{}?baud={baud}", device.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_written_as_they_are_read() {
        for text in ["-", "run.csv", "udp://127.0.0.1:9000", "udp://[::1]:9000", "serial:///dev/ttyS0?baud=9600"] {
            assert_eq!(text.parse::<StreamSource>().unwrap().to_string(), text);
        }
        assert_eq!("udp://:9000".parse(), Ok(StreamSource::Udp(([127, 0, 0, 1], 9000).into())));
        for text in ["", "udp://here", "tcp://127.0.0.1:1", "serial://", "serial:///dev/ttyS0?baud=fast"] {
            assert!(text.parse::<StreamSource>().is_err(), "{text}");
        }
    }
}
