//! The threads that read the sources.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::net::UdpSocket;
use std::path::Path;
use std::process::Command;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use super::{Arrival, StreamSource};
use sindyscope_core::study::Cancel;

/// How long a source that has nothing is left alone.
const PAUSE: Duration = Duration::from_millis(30);
/// Bytes that are read at once: more than a datagram can hold.
const CHUNK: usize = 1 << 16;

/// What arrives from a source.
#[derive(Debug)]
pub struct Arriving {
    receiver: Receiver<Arrival>,
}

impl Arriving {
    /// Opens a source, on a thread of its own, until `cancel` is set.
    ///
    /// # Errors
    /// The source cannot be opened: a sentence.
    pub fn open(source: &StreamSource, cancel: &Cancel) -> Result<Self, String> {
        let (sender, receiver) = channel();
        let reader = SourceReader { sender, cancel: cancel.clone() };
        match source {
            StreamSource::File(path) => {
                if path.is_dir() {
                    return Err(format!("{} is a folder: give a file that grows", path.display()));
                }
                let path = path.clone();
                start(move || reader.follow(&path))?;
            }
            StreamSource::Input => start(move || reader.read(&mut io::stdin().lock()))?,
            StreamSource::Udp(address) => {
                let socket = UdpSocket::bind(address).map_err(|e| format!("cannot listen at {address}: {e}"))?;
                socket.set_read_timeout(Some(PAUSE)).map_err(|e| format!("cannot listen at {address}: {e}"))?;
                start(move || reader.listen(&socket))?;
            }
            StreamSource::Serial { device, baud } => {
                set_up(device, *baud)?;
                let mut line =
                    File::open(device).map_err(|e| format!("cannot open the serial line {}: {e}", device.display()))?;
                start(move || reader.read(&mut line))?;
            }
        }
        Ok(Self { receiver })
    }

    /// What arrives next; none if nothing does for a while.
    pub fn next(&self, wait: Duration) -> Option<Arrival> {
        match self.receiver.recv_timeout(wait) {
            Ok(arrival) => Some(arrival),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Arrival::Ended),
        }
    }
}

/// Starts the thread that reads a source.
fn start(reading: impl FnOnce() + Send + 'static) -> Result<(), String> {
    sindyscope_system::thread::spawn("stream".into(), reading).map_err(|e| format!("cannot read the stream: {e}"))
}

/// A thread's end of a source.
struct SourceReader {
    sender: Sender<Arrival>,
    cancel: Cancel,
}

/// What tells a file from another one of the same name.
#[cfg(unix)]
fn identity(file: &File) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt as _;
    file.metadata().ok().map(|m| (m.dev(), m.ino()))
}

/// What tells a file from another one of the same name: when it was made.
#[cfg(not(unix))]
fn identity(file: &File) -> Option<std::time::SystemTime> {
    file.metadata().ok().and_then(|m| m.created().ok())
}

impl SourceReader {
    /// Hands something on; false if nobody wants it any more.
    fn tell(&self, arrival: Arrival) -> bool {
        !self.cancel.is_cancelled() && self.sender.send(arrival).is_ok()
    }

    /// Hands on the last there is; whether anybody wants it does not matter any more.
    fn last(&self, arrival: Arrival) {
        self.tell(arrival);
    }

    /// Reads to the end, which comes once whatever writes has closed.
    fn read(&self, from: &mut impl Read) {
        let mut buffer = vec![0; CHUNK];
        loop {
            let told = match from.read(&mut buffer) {
                Ok(0) => return self.last(Arrival::Ended),
                Ok(count) => self.tell(Arrival::Bytes(buffer[..count].to_vec())),
                Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => {
                    thread::sleep(PAUSE);
                    !self.cancel.is_cancelled()
                }
                Err(error) => return self.last(Arrival::Failed(format!("the source broke off: {error}"))),
            };
            if !told {
                return;
            }
        }
    }

    /// Takes datagrams; one that ends within a line ends the line.
    fn listen(&self, socket: &UdpSocket) {
        let mut buffer = vec![0; CHUNK];
        loop {
            let told = match socket.recv(&mut buffer) {
                Ok(count) => {
                    let mut bytes = buffer[..count].to_vec();
                    if bytes.last().is_some_and(|b| *b != b'\n') {
                        bytes.push(b'\n');
                    }
                    self.tell(Arrival::Bytes(bytes))
                }
                // Nothing came, or a sender was told that nobody had listened yet.
                Err(_) => !self.cancel.is_cancelled(),
            };
            if !told {
                return;
            }
        }
    }

    /// Reads a file as it grows. One that was cut begins anew, and so does another one in its place, once what the old one had
    /// is read to its end.
    fn follow(&self, path: &Path) {
        let mut waiting = false;
        let mut open: Option<(File, u64)> = None;
        let mut buffer = vec![0; CHUNK];
        while !self.cancel.is_cancelled() {
            let Some((file, read)) = &mut open else {
                match File::open(path) {
                    Ok(file) => (open, waiting) = (Some((file, 0)), false),
                    Err(error) if error.kind() == ErrorKind::NotFound => {
                        if !waiting && !self.tell(Arrival::Waiting(format!("waiting for {}", path.display()))) {
                            return;
                        }
                        waiting = true;
                        thread::sleep(PAUSE);
                    }
                    Err(error) => {
                        return self.last(Arrival::Failed(format!("cannot open {}: {error}", path.display())));
                    }
                }
                continue;
            };
            if file.metadata().is_ok_and(|m| m.len() < *read) {
                // The same file, cut: what stands in it now is new.
                open = File::open(path).ok().map(|file| (file, 0));
                if !self.tell(Arrival::Anew) {
                    return;
                }
                continue;
            }
            match file.read(&mut buffer) {
                Ok(0) => {
                    let replaced = File::open(path).ok().filter(|other| identity(other) != identity(file));
                    match replaced {
                        // What was written to the old one until then is read first.
                        Some(other) if file.metadata().is_ok_and(|m| m.len() == *read) => {
                            open = Some((other, 0));
                            if !self.tell(Arrival::Anew) {
                                return;
                            }
                        }
                        _ => thread::sleep(PAUSE),
                    }
                }
                Ok(count) => {
                    *read += count as u64;
                    if !self.tell(Arrival::Bytes(buffer[..count].to_vec())) {
                        return;
                    }
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => {
                    return self.last(Arrival::Failed(format!("cannot read {}: {error}", path.display())));
                }
            }
        }
    }
}

/// Sets a serial line's speed, and that its bytes come as they are, by the system's own `stty`.
fn set_up(device: &Path, baud: u32) -> Result<(), String> {
    let device_option = if cfg!(any(target_os = "macos", target_os = "ios")) { "-f" } else { "-F" };
    let baud = baud.to_string();
    let mut stty = Command::new("stty");
    stty.arg(device_option).arg(device).args([&*baud, "raw", "-echo", "min", "1", "time", "0"]);
    let name = device.display();
    let done = stty.output().map_err(|e| {
        format!(
            "cannot set up the serial line {name}: there is no `stty` here ({e}); pipe what the line sends into `-`"
        )
    })?;
    if done.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&done.stderr);
    Err(format!("cannot set up the serial line {name}: {}", said.lines().next().unwrap_or("stty refused it").trim()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;
    use std::time::Instant;

    /// What arrives until it holds `until`, and whether the source began anew on the way.
    fn text(arriving: &Arriving, until: &str) -> (String, usize) {
        let (mut text, mut anew) = (String::new(), 0);
        let deadline = Instant::now() + Duration::from_secs(20);
        while !text.contains(until) && Instant::now() < deadline {
            match arriving.next(Duration::from_millis(100)) {
                Some(Arrival::Bytes(bytes)) => text += &String::from_utf8_lossy(&bytes),
                Some(Arrival::Anew) => anew += 1,
                Some(Arrival::Ended) => break,
                _ => {}
            }
        }
        (text, anew)
    }

    #[test]
    fn a_file_is_waited_for_followed_and_read_anew_where_it_was_cut_or_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        let cancel = Cancel::default();
        let arriving = Arriving::open(&StreamSource::File(path.clone()), &cancel).unwrap();
        assert!(
            matches!(arriving.next(Duration::from_secs(20)), Some(Arrival::Waiting(what)) if what.contains("log.csv"))
        );
        let mut file = File::create(&path).unwrap();
        file.write_all(b"t,x\n0,1\n1,").unwrap();
        assert_eq!(text(&arriving, "1,"), ("t,x\n0,1\n1,".into(), 0));
        file.write_all(b"2\n").unwrap();
        assert_eq!(text(&arriving, "2\n"), ("2\n".into(), 0));
        // Cut, and written from its beginning.
        std::fs::write(&path, "t,x\n").unwrap();
        assert_eq!(text(&arriving, "x\n"), ("t,x\n".into(), 1));
        // Put aside with a last line, another one in its place.
        let mut old = File::options().append(true).open(&path).unwrap();
        old.write_all(b"5,5\n").unwrap();
        std::fs::rename(&path, folder.path().join("log.1")).unwrap();
        std::fs::write(&path, "6,6\n").unwrap();
        assert_eq!(text(&arriving, "6,6\n"), ("5,5\n6,6\n".into(), 1));
        cancel.cancel();
    }

    #[test]
    fn datagrams_arrive_as_lines() {
        let free = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let cancel = Cancel::default();
        let arriving = Arriving::open(&StreamSource::Udp(free), &cancel).unwrap();
        let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
        sender.send_to(b"t,x\n0,1", free).unwrap();
        sender.send_to(b"1,2\n", free).unwrap();
        assert_eq!(text(&arriving, "1,2\n").0, "t,x\n0,1\n1,2\n");
        let taken = Arriving::open(&StreamSource::Udp(free), &cancel).expect_err("somebody listens there");
        assert!(taken.contains("cannot listen"), "{taken}");
        cancel.cancel();
    }

    #[test]
    fn a_serial_line_that_is_none_is_refused() {
        let line = StreamSource::Serial { device: "/no/such/line".into(), baud: 9600 };
        let refused = Arriving::open(&line, &Cancel::default()).expect_err("no such line");
        assert!(refused.contains("/no/such/line"), "{refused}");
    }
}
